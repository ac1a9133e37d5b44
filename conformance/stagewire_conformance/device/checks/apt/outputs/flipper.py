"""``flipper`` and ``flipper-time``: a filter flipper moves in its transit time (Issue 37, page 182).

A jog forward goes to one position and a jog reverse to the other; the device decides which (page 86),
and which status bit shows which. A flipper reports no end of a move, so the check watches both bits
in its status. The document calls the transit time approximate.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from stagewire_apt import messages as m
from stagewire_apt.enumerations import MoveDirection
from stagewire_apt.flags import DcStatusBits
from stagewire_conformance.device.causes import EFFECT, Cause
from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.apt.outputs.output_check import output_check
from stagewire_conformance.device.checks.apt.settings.sets import PlacedSet, parameter_sets

if TYPE_CHECKING:
    from stagewire_conformance.device.targets import Target
    from stagewire_conformance.device.trial import Trial

_PARAMETERS: Final = "MOT_MFF_OPERPARAMS"
_MESSAGES: Final = (
    "MOT_MOVE_JOG",
    "MOT_REQ_STATUSBITS",
    "MOT_GET_STATUSBITS",
    "MOT_SET_MFF_OPERPARAMS",
    "MOT_REQ_MFF_OPERPARAMS",
    "MOT_GET_MFF_OPERPARAMS",
)
_JOG: Final = Cause("MOT_MOVE_JOG", EFFECT)
_TICK: Final = 0.02
"""Seconds between two looks at the status."""
_STILL: Final = 0.1
"""Seconds in which a flipper leaves its position after a jog."""
_LATE: Final = 1.5
"""Seconds after the transit time at which a flipper should be at its position."""
_SHARE: Final = 4
"""A move takes between 3/4 and 5/4 of the transit time; page 182 calls the time approximate."""
_LONGEST: Final = 2800
"""The longest transit time in ms (page 182)."""
_ADC: Final = (10_000_000, -1.591)
"""The factor and the exponent of the counts of a transit time (page 182)."""

POSITIONS = Kind(
    name="flipper",
    title="The flipper moves to both of its positions",
    rules=(
        "flipper-positions",
        "flipper-position-bits",
        "flipper-transit-time",
        "flipper-reports-no-end",
    ),
)
TIME = Kind(
    name="flipper-time",
    title="A move of the flipper takes the transit time that is set",
    rules=("flipper-transit-time", "flipper-transit-counts"),
)


class _Flipper:
    """The flipper on a channel, with its status and its moves."""

    def __init__(self, trial: Trial, place: Target, channel: int) -> None:
        self.trial, self.place, self.channel = trial, place, channel
        self.mirrored: bool | None = (
            None  # whether a jog forward goes to the position of the reverse bit
        )
        sets = parameter_sets(trial.declared, place)
        self.placed = PlacedSet(
            place, channel, next(one for one in sets if one.name == _PARAMETERS)
        )

    def ends(self) -> tuple[bool, bool]:
        """Return whether it is at its first and at its second position."""
        request = m.MotReqStatusBits(self.channel)
        bits = DcStatusBits(self.trial.reply(request, self.place.address).message.status_bits)
        ends = bits.forward_hardware_limit, bits.reverse_hardware_limit
        self.trial.need(
            ends != (True, True),
            f"the status of {self.place.name} reports both positions at once",
            rule="flipper-position-bits",
            cause=Cause("MOT_GET_STATUSBITS", "both positions"),
        )
        return ends

    def jog(self, to: MoveDirection) -> None:
        """Send the jog to the position of a status bit."""
        way = _other(to) if self.mirrored else to
        self.trial.line.send(m.MotMoveJog(self.channel, way), self.place.address)

    def _learn(self, to: MoveDirection) -> None:
        """Find out which jog has no effect at the present position: that is the one that goes there."""
        at = _other(to)
        self.mirrored = False
        self.jog(at)
        if not self.stays() and self.at() is to:
            self.mirrored = True
            self.jog(at)
            self.trial.need(
                not self.stays() and self.at() is at,
                f"MOT_MOVE_JOG moved {self.place.name} to its {to.name.lower()} position in both directions",
                rule="flipper-positions",
                cause=_JOG,
            )

    def stays(self) -> bool:
        """Return whether the status shows the same ends for a while."""
        ends, line = self.ends(), self.trial.line
        limit = line.now + _STILL
        while line.now < limit:
            line.pause(_TICK)
            if self.ends() != ends or ends == (False, False):
                return False
        return True

    def at(self) -> MoveDirection:
        """Return its position by the status bits; the check ends if it has none."""
        line, limit = self.trial.line, self.trial.line.now + _LONGEST / 1000 + _LATE
        while line.now < limit:
            match self.ends():
                case True, False:
                    return MoveDirection.FORWARD
                case False, True:
                    return MoveDirection.REVERSE
            line.pause(_TICK)
        self.trial.need(
            False,
            f"the status of {self.place.name} never shows one of the two positions",
            rule="flipper-position-bits",
            cause=Cause("MOT_GET_STATUSBITS", "no position"),
        )
        raise AssertionError  # need has ended the check

    def move(self, to: MoveDirection, transit: float) -> float | None:
        """Move to the other position, and return how long that took; None if that was not seen."""
        trial, line = self.trial, self.trial.line
        if self.mirrored is None:
            self._learn(to)
        start = line.now
        self.jog(to)
        left = False
        while line.now < start + 2 * transit + _LATE:
            line.pause(_TICK)
            ends = self.ends()
            left = left or ends == (False, False)
            if ends[0 if to is MoveDirection.FORWARD else 1]:
                took = line.now - start
                seen = trial.should(
                    left,
                    f"{self.place.name} reported no time between its positions during a move",
                    rule="flipper-position-bits",
                    cause=Cause("MOT_GET_STATUSBITS", "in motion"),
                )
                return took if seen else None
        trial.must(
            False,
            f"MOT_MOVE_JOG did not move {self.place.name} to its {to.name.lower()} position: its status "
            f"still shows {'no position' if ends == (False, False) else 'the other one'}",
            rule="flipper-positions",
            cause=_JOG,
        )
        return None

    def back(self, to: MoveDirection, transit: float) -> None:
        """Move back at the end of the check."""
        self.trial.undo(
            f"the position of {self.place.name}", lambda: self._return(to, transit), moves=True
        )

    def _return(self, to: MoveDirection, transit: float) -> None:
        self.jog(to)
        self.trial.line.pause(transit + _LATE)


def _other(at: MoveDirection) -> MoveDirection:
    return MoveDirection.REVERSE if at is MoveDirection.FORWARD else MoveDirection.FORWARD


@output_check(
    POSITIONS,
    "MOT_MOVE_JOG moves {output} to each of its positions",
    messages=_MESSAGES,
    does="moves the flipper to its other position and back",
    seconds=3.5,
)
def _positions(trial: Trial, place: Target, channel: int) -> None:
    flipper = _Flipper(trial, place, channel)
    transit = flipper.placed.read(trial)["transit_time"] / 1000
    start = flipper.at()
    flipper.back(start, transit)
    for to in (_other(start), start):
        took = flipper.move(to, transit)
        if took is None:
            return
        _judge_time(trial, place, took, transit)
        flipper.jog(to)
        trial.line.pause(_TICK)
        trial.must(
            flipper.ends() != (False, False) and flipper.at() is to,
            f"a second MOT_MOVE_JOG to the position of {place.name} moved it again",
            rule="flipper-positions",
            cause=_JOG,
        )
    for heard in trial.line.listen(0):
        trial.should(
            heard.name not in trial.line.ends,
            f"{place.name} sent {heard.name}; a flipper reports its position in the status only",
            came=heard.raw,
            rule="flipper-reports-no-end",
            cause=Cause(heard.name, "unsolicited"),
        )


@output_check(
    TIME,
    "A move of {output} takes the transit time that was set",
    messages=_MESSAGES,
    does="makes the flipper slower, moves it to its other position and back, and restores the "
    "transit time",
    seconds=4,
)
def _transit(trial: Trial, place: Target, channel: int) -> None:
    flipper = _Flipper(trial, place, channel)
    trial.depends_on(_JOG)
    before = flipper.placed.read(trial)
    factor, exponent = _ADC
    trial.should(
        abs(before["transit_time_adc"] - factor * before["transit_time"] ** exponent)
        <= 2 + before["transit_time_adc"] / 50,
        f"{place.name}: transit_time_adc is {before['transit_time_adc']}; for {before['transit_time']} ms, "
        f"page 182 of Issue 37 gives {factor * before['transit_time'] ** exponent:.0f}",
        rule="flipper-transit-counts",
        cause=Cause("MOT_GET_MFF_OPERPARAMS", "transit_time_adc"),
    )
    slower = min(_LONGEST, 2 * before["transit_time"])
    if slower <= before["transit_time"]:
        trial.inconclusive(f"{place.name} already has the longest transit time")
        return
    start = flipper.at()
    flipper.placed.undo(trial, before)
    flipper.back(start, slower / 1000)
    counts = round(factor * slower**exponent)
    flipper.placed.write(trial, {**before, "transit_time": slower, "transit_time_adc": counts})
    took = flipper.move(_other(start), slower / 1000)
    if took is not None:
        _judge_time(trial, place, took, slower / 1000)


def _judge_time(trial: Trial, place: Target, took: float, transit: float) -> None:
    trial.must(
        abs(took - transit) <= transit / _SHARE + 2 * _TICK,
        f"a move of {place.name} took {took:.2f} s; its transit time is {transit:.2f} s",
        rule="flipper-transit-time",
        cause=Cause("MOT_SET_MFF_OPERPARAMS", EFFECT),
    )
