"""Checks that move an axis: their decorator, and the axis, which is watched and moved back."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from typing import Any, Final, NamedTuple, TypeVar

from stagewire.protocols import Command
from stagewire_conformance.device.causes import EFFECT, Cause
from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.ms2000.axis import Axis
from stagewire_conformance.device.checks.ms2000.axis_check import AxisCase, axis_check, every_axis
from stagewire_conformance.device.checks.ms2000.broken_rules import rule_of_motion
from stagewire_conformance.device.checks.ms2000.harmless import harmless_value
from stagewire_conformance.device.checks.ms2000.stored import BYTE_ORDER
from stagewire_conformance.device.declaration import Declaration
from stagewire_conformance.device.permissions import Need, Permissions, RangeError
from stagewire_conformance.device.targets import Target
from stagewire_conformance.device.trial import EnoughError, NotRunError, Trial
from stagewire_ms2000 import PROTOCOL
from stagewire_ms2000 import messages as m
from stagewire_ms2000.flags import StatusBits
from stagewire_ms2000.quantities import POSITION, SPEED

LONGEST: Final = 30.0
"""The maximum duration of a motion in seconds."""
_EXPECTED: Final = 20.0
"""The maximum expected duration of a motion in seconds. A longer one is not started."""
ARRIVED: Final = 10
"""Counts (1 µm) by which an axis may miss its target; the document does not say."""

STOPS_BOTH: Final = Cause("STOP_MOTOR", "another axis")
"""The defect that a stop of one axis also stops another one."""

EVIDENCE: Final = (
    Cause("READ_STATUS", "busy"),
    Cause("READ_STATUS", "busy at rest"),
    Cause("READ_MOTOR_POSITION", "position"),
    Cause("STOP_MOTOR", EFFECT),
    Cause("START_MOTOR", EFFECT),
    STOPS_BOTH,
    BYTE_ORDER,
)
"""The defects with which nothing is moved: where an axis is and whether it moves is unknown, or it does not
stop, or does not move again."""
SPEED_REPLY: Final = (Cause("READ_CURRENT_SPEED", "speed"), Cause("READ_CURRENT_SPEED", "sign"))
"""The defects with which the reported speed shows nothing."""
TARGET: Final = Cause("motion", "target")
"""The defect that a move does not end at its target."""

_MOVES_WITHIN: Final = 0.1
"""Seconds in which an axis that obeys a command has certainly moved."""
_PAUSE: Final = 0.02
"""Seconds between two readings of a moving axis; some controllers do not tolerate continuous requests."""
_SECONDS: Final = 0.4
"""The approximate duration of a move in seconds."""
_LEAST: Final = 100
"""Counts (10 µm) of the shortest move that can be judged."""
_SIZE: Final = 3
"""Bytes of a position."""
COUNTS_PER_SPEED: Final = POSITION.counts_per_unit / SPEED.counts_per_unit
"""Counts per second at a speed of 1 µm/s."""


class Sample(NamedTuple):
    """The values of an axis at about one instant.

    ``time`` is when its speed was received, ``blur`` the seconds since the request for it.
    """

    time: float
    blur: float
    busy: bool
    status: StatusBits
    position: int
    speed: int


class Mover(Axis):
    """An axis with its allowed range.

    :param trial: the trial that gets the findings.
    :param place: the target of the axis.
    """

    def __init__(self, trial: Trial, place: Target) -> None:
        super().__init__(trial, place)
        motion = trial.allowed.motion
        assert motion is not None  # the check requires it
        self.low, self.high = trial.declared.reach(place, None, motion)
        self.start = self.top_speed = self.ramp_time = 0

    def ready(self) -> None:
        """Check that the axis is at rest within the range, and bring it back at the end.

        Otherwise the check ends before anything moves.
        """
        self.trial.depends_on(*EVIDENCE)
        self.start, target = self.position, self.target
        self.top_speed = self.number(m.ReadMaximumSpeed())
        self.ramp_time = self.number(m.ReadRampTime())
        allowed = f"the allowed {self.low}..{self.high} counts"
        if (
            not self.low - ARRIVED <= self.start <= self.high + ARRIVED
        ):  # not the controller's fault
            self.trial.inconclusive(
                f"axis {self.name} is at {self.start}, outside of {allowed}; nothing was moved"
            )
            raise EnoughError
        self.trial.need(
            self.low - ARRIVED <= target <= self.high + ARRIVED,
            f"axis {self.name} has the target {target}, outside of {allowed}; nothing was moved",
            rule="target-reply",
            cause=Cause("READ_TARGET_POSITION", "target"),
        )
        self.trial.need(
            not self.is_busy,
            f"axis {self.name} is busy before a move was started: the joystick is in use, or "
            "the axis is disabled away from its target; nothing was moved",
            rule="status-not-busy",
            cause=Cause("READ_STATUS", "busy at rest"),
        )
        self.trial.need(
            self.top_speed > 0,
            f"the maximum speed of axis {self.name} is 0, so it cannot move",
            rule="maximum-speed-reply",
            cause=Cause("READ_MAXIMUM_SPEED", "value"),
        )
        self.start = self.sendable(max(self.low, min(self.start, self.high)))
        where = f"axis {self.name} at {self.start}, enabled"
        self.trial.undo(where, self._bring_back, moves=True, rule="target-moves")

    # Targets and durations

    def counts_in(self, seconds: float, speed: int | None = None) -> int:
        """Return the distance in a time at a speed in µm/s, by default the top speed."""
        return int((self.top_speed if speed is None else speed) * COUNTS_PER_SPEED * seconds)

    def patience(self, counts: int) -> float:
        """Return the maximum duration of a move in seconds: twice its duration plus five, within the bound.

        End the check before a move that would take too long.
        """
        speed = max(1, self.counts_in(1.0))
        needed = counts / speed + self.ramp_time / 1000 if self.top_speed else 0.0
        if needed > _EXPECTED:
            raise NotRunError(
                f"a motion of axis {self.name} over {counts} counts would take about {needed:.0f} s at "
                f"{speed} counts/s, but the suite starts no motion of more than {_EXPECTED:.0f} s; "
                "set a higher top speed, or allow a smaller range"
            )
        return min(2 * needed + 5, LONGEST)

    def goal(self, seconds: float = _SECONDS, upwards: bool | None = None) -> int:
        """Return a target about so many seconds away, within the range.

        :param upwards: the direction; by default the one with more room.
        """
        here = self.position
        if upwards is None:
            upwards = self.high - here >= here - self.low
        room = self.high - here if upwards else here - self.low
        far = min(self.counts_in(seconds), room)
        if far < _LEAST:
            self.trial.inconclusive(
                f"axis {self.name} is at {here}, where {self.low}..{self.high} leaves only "
                f"{far} counts for a move"
            )
            raise EnoughError
        ends = (here + far * 3 // 4, here + far) if upwards else (here - far, here - far * 3 // 4)
        return self.sendable(harmless_value(self.trial.random, *ends, _SIZE))

    def sendable(self, count: int) -> int:
        """Return the nearest count in the range whose bytes cannot be taken for a setup command."""
        for far in range(self.high - self.low + 1):
            for each in (count - far, count + far):
                if self.low <= each <= self.high and not _holds_setup(each):
                    return each
        return count

    # Motion

    def begin(self, command: Command) -> float:
        """Send a motion command, check that the axis is busy immediately, and return the time."""
        self.line.send(command, self.address)
        began = self.line.now
        if not self.is_busy:
            self._not_busy(command.layout.message)
        return began

    def _not_busy(self, message: str) -> None:
        """Report an axis that is not busy after a motion command: it does not obey, or it does not say so."""
        at = self.position
        self.line.listen(_MOVES_WITHIN)
        obeys = abs(self.position - at) > ARRIVED
        self.trial.need(
            False,
            f"immediately after {message}, READ_STATUS of axis {self.name} returned b; a host would assume "
            f"that the move is over{'' if obeys else ', but it does not begin'}",
            wanted=b"B",
            came=b"b",
            rule="status-busy" if obeys else rule_of_motion(message),
            cause=Cause("READ_STATUS", "busy") if obeys else Cause(message, EFFECT),
            because=EVIDENCE,
        )

    def sample(self) -> Sample:
        """Return the current values."""
        both = self.ask(m.ReadMotorPositionAndStatus(), quiet=0.0)
        assert isinstance(both, m.ReadMotorPositionAndStatusReply)
        asked = self.line.now
        speed = self.speed
        now = self.line.now
        return Sample(now, now - asked, self.is_busy, StatusBits(both.status), both.position, speed)

    def follow(
        self, what: str, counts: int, until: Callable[[Sample], bool] | None = None
    ) -> list[Sample]:
        """Read the axis until it is no longer busy, and return its values meanwhile.

        If it leaves the range, goes much further than its distance, or takes longer than :meth:`patience`,
        the check ends, and the axis is stopped.

        :param what: the motion, for the text of a finding.
        :param counts: the distance.
        :param until: ends the reading earlier.
        """
        end = self.line.now + self.patience(counts)
        samples: list[Sample] = []
        while True:
            samples.append(self.sample())
            sample = samples[-1]
            self.trial.need(
                self.low - ARRIVED <= sample.position <= self.high + ARRIVED,
                f"{what}, axis {self.name} left {self.low}..{self.high}; it is at "
                f"{sample.position}",
                rule="target-moves",
                cause=TARGET,
                because=EVIDENCE,
            )
            gone = abs(sample.position - samples[0].position)
            self.trial.need(
                gone <= counts + counts // 2 + self.counts_in(self.ramp_time / 1000) + _LEAST,
                f"{what}, axis {self.name} went {gone} counts from {samples[0].position}; it should have "
                f"moved {counts}, and was stopped",
                rule="target-moves",
                cause=Cause("motion", "distance"),
                because=EVIDENCE,
            )
            if not sample.busy:
                self.line.moving.discard(self.address)
            if not sample.busy or (until is not None and until(sample)):
                return samples
            self.trial.need(
                self.line.now < end,
                f"{what}, axis {self.name} was still busy after {self.patience(counts):.1f} s; "
                f"it is at {sample.position}",
                rule="status-not-busy",
                cause=Cause("READ_STATUS", "busy at rest"),
            )
            self.line.listen(_PAUSE)

    def go(self, goal: int) -> list[Sample]:
        """Move to a target and wait for the end, without judging the move."""
        self.patience(abs(goal - self.position))
        self.line.send(m.WriteTargetPosition(goal), self.address)
        return self.follow(f"on its way to {goal}", abs(goal - self.position))

    def _bring_back(self) -> None:
        """Bring the axis back to its initial position, enabled, whatever it is doing.

        An axis that does not arrive is stopped, and stays stopped.
        """
        self.line.settle()
        stood, is_stopped = self.position, self.address in self.line.stopped
        back = m.WriteTargetPosition(self.start)
        self.line.send(back, self.address)
        if is_stopped:
            self.line.send(m.StartMotor(), self.address)  # its target does not lead anywhere else
            self.line.send(back, self.address)  # in case the start has set another target
        try:
            self.follow("on its way back", abs(self.start - self.position))
            found = self.position
        except EnoughError:
            self.line.send(m.StopMotor(), self.address)
            self.line.moving.discard(self.address)
            text = f"axis {self.name} was at {self.start}, and was stopped on its way back"
            self.trial.must(False, f"not restored: {text}", because=(*EVIDENCE, TARGET))
        else:
            stays = is_stopped and abs(found - stood) <= ARRIVED
            self.trial.must(
                abs(found - self.start) <= ARRIVED,
                f"not restored: axis {self.name} was at {self.start}, but is at {found}"
                + (", where it stayed after START_MOTOR" if stays else ""),
                rule="start-enables" if stays else "target-moves",
                cause=Cause("START_MOTOR", EFFECT) if stays else TARGET,
                because=(*EVIDENCE, TARGET),
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
"""The messages that every check needs to move an axis, watch it and bring it back."""


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

    :param messages: the messages that it covers, in addition to :data:`MOVES`.
    :param settings: whether it also changes settings.

    For other parameters, see :func:`.axis_check`.
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
            does="moves every axis within {range}, and back to its initial position",
            bound=f"each motion ends within {LONGEST:g} s, or is stopped",
            each=cases,
            **more,
        )(move)
        return look

    return declare


def lacks_of(declared: Declaration, allowed: Permissions, place: Target) -> str:
    """Return why the allowed range cannot be applied to an axis; empty if it can."""
    try:
        if allowed.motion is not None:
            declared.reach(place, None, allowed.motion)
    except RangeError as error:
        return str(error)
    return ""
