"""Checks that move an axis: the decorator that declares them, and the axis, watched and moved back."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from typing import Any, Final, NamedTuple, TypeVar

from stagewire.protocols import Command
from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.ms2000.axis import Axis
from stagewire_conformance.device.checks.ms2000.axis_check import AxisCase, axis_check, every_axis
from stagewire_conformance.device.checks.ms2000.harmless import harmless_value
from stagewire_conformance.device.declaration import Declaration
from stagewire_conformance.device.permissions import Need, Permissions, RangeError
from stagewire_conformance.device.targets import Target
from stagewire_conformance.device.trial import EnoughError, Trial
from stagewire_ms2000 import PROTOCOL
from stagewire_ms2000 import messages as m
from stagewire_ms2000.flags import StatusBits
from stagewire_ms2000.quantities import POSITION, SPEED

ARRIVED: Final = 10
"""Counts, a micrometre, by which an axis may miss its target; the document does not say."""

_PAUSE: Final = 0.02
"""Seconds between two looks at an axis that moves; some controllers do not like to be asked all the time."""
_SECONDS: Final = 0.4
"""About how long a move takes."""
_LEAST: Final = 100
"""Counts, ten micrometres, of the shortest move that tells anything."""
_SIZE: Final = 3
"""Bytes of a position."""
_COUNTS_PER_SPEED: Final = POSITION.counts_per_unit / SPEED.counts_per_unit
"""Counts a second at a speed of 1 µm/s."""


class Sample(NamedTuple):
    """What an axis says at about one instant.

    ``time`` is when it had told its speed, ``blur`` how many seconds before it was asked for.
    """

    time: float
    blur: float
    busy: bool
    status: StatusBits
    position: int
    speed: int


class Mover(Axis):
    """An axis with the range in which it may be.

    :param trial: gets the findings.
    :param place: the axis.
    """

    def __init__(self, trial: Trial, place: Target) -> None:
        super().__init__(trial, place)
        motion = trial.allowed.motion
        assert motion is not None  # the check needs it
        self.low, self.high = trial.declared.reach(place, None, motion)
        self.start = self.top_speed = self.ramp_time = 0

    def ready(self) -> None:
        """See that the axis rests within the range, and let it be brought back there at the end.

        Otherwise the check ends before anything moves.
        """
        self.start, target = self.position, self.target
        self.top_speed = self.number(m.ReadMaximumSpeed())
        self.ramp_time = self.number(m.ReadRampTime())
        allowed = f"{self.low}..{self.high} counts, where it may be"
        if not self.low - ARRIVED <= self.start <= self.high + ARRIVED:  # nobody is to blame for it
            self.trial.inconclusive(
                f"axis {self.name} stands at {self.start}, outside {allowed}; nothing was moved"
            )
            raise EnoughError
        self.trial.need(
            self.low - ARRIVED <= target <= self.high + ARRIVED,
            f"axis {self.name} has the target {target}, outside {allowed}; nothing was moved",
        )
        self.trial.need(
            not self.is_busy,
            f"axis {self.name} is busy before anything moves: the joystick, or it is disabled away from its "
            "target; nothing was moved",
        )
        self.trial.need(
            self.top_speed > 0,
            f"the maximum speed of axis {self.name} is 0, so that nothing can move",
        )
        self.start = self.sendable(max(self.low, min(self.start, self.high)))
        where = f"axis {self.name} at {self.start}, enabled"
        self.trial.undo(where, self._bring_back, moves=True)

    # Where to, and how long it takes

    def counts_in(self, seconds: float, speed: int | None = None) -> int:
        """Return how far it comes at a speed in µm/s, by default the top speed."""
        return int((self.top_speed if speed is None else speed) * _COUNTS_PER_SPEED * seconds)

    def patience(self, counts: int) -> float:
        """Return in how many seconds a move has to be over: twice what it needs, and five more."""
        needed = counts / self.counts_in(1.0) + self.ramp_time / 1000 if self.top_speed else 0.0
        return 2 * needed + 5

    def goal(self, seconds: float = _SECONDS, upwards: bool | None = None) -> int:
        """Return a target about so many seconds away, within the range.

        :param upwards: which way; by default to where there is more room.
        """
        here = self.position
        if upwards is None:
            upwards = self.high - here >= here - self.low
        room = self.high - here if upwards else here - self.low
        far = min(self.counts_in(seconds), room)
        if far < _LEAST:
            self.trial.inconclusive(
                f"axis {self.name} stands at {here}: {self.low}..{self.high} leaves {far} counts for a move"
            )
            raise EnoughError
        ends = (here + far * 3 // 4, here + far) if upwards else (here - far, here - far * 3 // 4)
        return self.sendable(harmless_value(self.trial.random, *ends, _SIZE))

    def sendable(self, count: int) -> int:
        """Return the nearest count of the range whose bytes no controller can take for a setup command."""
        for far in range(self.high - self.low + 1):
            for each in (count - far, count + far):
                if self.low <= each <= self.high and not _holds_setup(each):
                    return each
        return count

    # Moving

    def begin(self, command: Command) -> float:
        """Send a command that moves, see that it is busy at once, and return when it was sent."""
        self.line.send(command, self.address)
        began = self.line.now
        self.trial.must(
            self.is_busy,
            f"right after {command.layout.message}, READ_STATUS of axis {self.name} tells b: a host would "
            "take the move for done",
            wanted=b"B",
            came=b"b",
        )
        return began

    def sample(self) -> Sample:
        """Return what it says now."""
        both = self.ask(m.ReadMotorPositionAndStatus(), quiet=0.0)
        assert isinstance(both, m.ReadMotorPositionAndStatusReply)
        asked = self.line.now
        speed = self.speed
        now = self.line.now
        return Sample(now, now - asked, self.is_busy, StatusBits(both.status), both.position, speed)

    def follow(
        self, what: str, counts: int, until: Callable[[Sample], bool] | None = None
    ) -> list[Sample]:
        """Look at it until it is busy no more, and return what it said meanwhile.

        It must not leave the range, nor take longer than :meth:`patience`; both end the check.

        :param what: what it does, for the text of a finding.
        :param counts: how far it goes.
        :param until: ends the looking before.
        """
        end = self.line.now + self.patience(counts)
        samples: list[Sample] = []
        while True:
            samples.append(self.sample())
            sample = samples[-1]
            self.trial.need(
                self.low - ARRIVED <= sample.position <= self.high + ARRIVED,
                f"{what}, axis {self.name} left {self.low}..{self.high}: it is at {sample.position}",
            )
            if not sample.busy:
                self.line.moving.discard(self.address)
            if not sample.busy or (until is not None and until(sample)):
                return samples
            self.trial.need(
                self.line.now < end,
                f"{what}, axis {self.name} was busy for {self.patience(counts):.1f} s and is still; it is at "
                f"{sample.position}",
            )
            self.line.listen(_PAUSE)

    def go(self, goal: int) -> list[Sample]:
        """Move to a target and wait for the end, without a look at how it is done."""
        self.line.send(m.WriteTargetPosition(goal), self.address)
        return self.follow(f"on its way to {goal}", abs(goal - self.position))

    def _bring_back(self) -> None:
        """Bring it back to where it was, enabled, whatever it does at this instant.

        An axis that does not come to an end is stopped, and stays so.
        """
        self.line.settle()
        back = m.WriteTargetPosition(self.start)
        self.line.send(back, self.address)
        if self.address in self.line.stopped:
            self.line.send(m.StartMotor(), self.address)  # its target leads nowhere else
            self.line.send(back, self.address)  # in case that a start has made another one
        try:
            self.follow("on its way back", abs(self.start - self.position))
            found = self.position
        except EnoughError:
            self.line.send(m.StopMotor(), self.address)
            self.line.moving.discard(self.address)
            text = f"axis {self.name} was at {self.start}, and is stopped where it is"
            self.trial.must(False, f"not restored: {text}")
        else:
            self.trial.must(
                abs(found - self.start) <= ARRIVED,
                f"not restored: axis {self.name} was at {self.start}, and is at {found}",
            )


def _holds_setup(count: int) -> bool:
    raw = (count % 256**_SIZE).to_bytes(_SIZE, "little")
    marks = PROTOCOL.marks
    return any(raw[at] == marks.prefix and raw[at + 1] in marks.setup for at in range(_SIZE - 1))


_Look = TypeVar("_Look", bound=Callable[..., None])

MOVES: Final = (
    "WRITE_TARGET_POSITION", "READ_TARGET_POSITION", "READ_MOTOR_POSITION", "READ_STATUS",
    "READ_MOTOR_POSITION_AND_STATUS", "READ_CURRENT_SPEED", "READ_MAXIMUM_SPEED",
    "READ_RAMP_TIME",
)  # fmt: skip
"""What every check needs that moves an axis, watches it, and brings it back."""


def motion_check(
    kind: Kind,
    title: str,
    *,
    messages: tuple[str, ...] = (),
    settings: bool = False,
    each: Callable[[Declaration, Permissions], Iterable[AxisCase]] = every_axis,
    **more: Any,
) -> Callable[[_Look], _Look]:
    """Declare a function that moves an axis as a check; a decorator.

    :param messages: what it covers besides :data:`MOVES`.
    :param settings: whether it also changes settings.

    All others: see :func:`.axis_check`.
    """

    def cases(declared: Declaration, allowed: Permissions) -> Iterator[AxisCase]:
        for case in each(declared, allowed):
            yield replace(case, lacks=lacks_of(declared, allowed, case.place) or case.lacks)

    def declare(look: _Look) -> _Look:
        def move(axis: Axis, **arguments: object) -> None:
            look(Mover(axis.trial, axis.place), **arguments)

        axis_check(
            kind,
            title,
            messages=tuple(dict.fromkeys((*messages, *MOVES))),
            needs={Need.MOTION, Need.SETTINGS} if settings else {Need.MOTION},
            does="moves every axis within {range}, and back to where it was",
            each=cases,
            **more,
        )(move)
        return look

    return declare


def lacks_of(declared: Declaration, allowed: Permissions, place: Target) -> str:
    """Return why the range that was allowed says nothing of an axis; empty where it does."""
    try:
        if allowed.motion is not None:
            declared.reach(place, None, allowed.motion)
    except RangeError as error:
        return str(error)
    return ""
