"""Moves by the increment, up and down (sections 19 to 21), and changes of the position counter (section 17).

Writing the position counter must cause no motion. A controller that keeps its old target would move there, so
this check needs permission for motion in a range.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from stagewire.protocols import Command
from stagewire_conformance.device.causes import EFFECT, Cause
from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.ms2000.axis import DITHER
from stagewire_conformance.device.checks.ms2000.broken_rules import rule_of_increment
from stagewire_conformance.device.checks.ms2000.harmless import harmless_value
from stagewire_conformance.device.checks.ms2000.motion.judgement import judge_course, judge_rest
from stagewire_conformance.device.checks.ms2000.motion.mover import Mover, motion_check
from stagewire_conformance.device.checks.ms2000.motion.stops import judge_disabled, stop_on_the_way
from stagewire_conformance.device.checks.ms2000.stored import INCREMENT, keep
from stagewire_conformance.device.trial import EnoughError
from stagewire_ms2000 import messages as m

INCREMENTS: Final = Kind(
    name="move-increment",
    title="A move by the increment starts at the current position and covers the increment",
    rules=(
        "increment-up",
        "increment-up-no-response",
        "increment-down",
        "increment-down-no-response",
        "increment-used",
        "increment-written",
        "status-busy",
        "status-not-busy",
    ),
)


@motion_check(
    INCREMENTS,
    "{axis} moves up and down by its increment, from its current position",
    messages=(
        "INCREMENT_MOVE_UP",
        "INCREMENT_MOVE_DOWN",
        "WRITE_INCREMENT_VALUE",
        "READ_INCREMENT_VALUE",
    ),
    settings=True,
    seconds=2.0,
)
def _up_and_down(mover: Mover) -> None:
    """Move twice by the increment in each direction, then up and down by a negative increment."""
    mover.ready()
    keep(mover, INCREMENT)
    increment = abs(mover.goal() - mover.start) // 2
    INCREMENT.set(mover, increment)
    up: tuple[Command, int] = (m.IncrementMoveUp(), increment)
    down: tuple[Command, int] = (m.IncrementMoveDown(), -increment)
    fits = mover.start + 2 * increment <= mover.high
    for command, way in (up, up, down, down) if fits else (down, down, up, up):
        _move(mover, command, way)
    INCREMENT.set(mover, -increment)
    for command, way in (down, up) if fits else (up, down):
        _move(mover, command, -way)


@motion_check(
    INCREMENTS,
    "The increment of {axis} counts from its current position, even away from its target",
    messages=(
        "INCREMENT_MOVE_UP",
        "INCREMENT_MOVE_DOWN",
        "WRITE_INCREMENT_VALUE",
        "READ_INCREMENT_VALUE",
        "STOP_MOTOR",
        "START_MOTOR",
    ),
    settings=True,
    seconds=2.0,
    name="after-a-stop",
)
def _after_a_stop(mover: Mover) -> None:
    """Stop on the way to a target. Increments of the disabled axis only change its target."""
    mover.ready()
    keep(mover, INCREMENT)
    goal = mover.goal()
    far = abs(goal - mover.start)
    INCREMENT.set(mover, far // 4)
    mover.begin(m.WriteTargetPosition(goal))
    seen = mover.follow(
        "on its way", far, until=lambda at: abs(at.position - mover.start) > far // 3
    )
    stood = stop_on_the_way(mover, seen[-1], goal)
    for command, way in ((m.IncrementMoveUp(), far // 4), (m.IncrementMoveDown(), -(far // 4))):
        if mover.low <= stood + way <= mover.high:
            mover.tell(command)
            judge_disabled(mover, stood, command.layout.message)
            _judge_target(mover, command, stood, way, f", stopped on its way to {goal}")
            mover.line.listen(_SEES)
            mover.trial.need(
                abs(mover.position - stood) <= DITHER,
                f"axis {mover.name} was stopped at {stood}, which disables it, but moved after "
                f"{command.layout.message}",
                rule="stop-disables",
                cause=Cause("STOP_MOTOR", "disables"),
            )


def _move(mover: Mover, command: Command, way: int) -> None:
    begin, name = mover.position, command.layout.message
    mover.begin(command)
    target = _judge_target(mover, command, begin, way)
    samples = mover.follow(f"after {name}", abs(way))
    judge_course(mover, target, samples)
    judge_rest(mover, target)
    mover.silent(command)


def _judge_target(mover: Mover, command: Command, begin: int, way: int, state: str = "") -> int:
    """Check the target that an increment has set, and return it."""
    target, increment = mover.target, INCREMENT.of(mover)
    mover.trial.need(
        abs(target - (begin + way)) <= DITHER,
        f"{command.layout.message} of axis {mover.name} at {begin}{state}, with the increment {increment}, "
        f"set the target {target}; it should be {begin + way}",
        rule=rule_of_increment(command.layout.message),
        cause=Cause(command.layout.message, EFFECT),
        because=(Cause("READ_TARGET_POSITION", "target"), *INCREMENT.defects),
    )
    return target


_SHIFT: Final = (100, 500)
"""Counts of the first change: 10 to 50 µm."""
_FAR: Final = (0x10000, 0x3FFFF)
"""Counts of the other changes, which need all three bytes."""
_SEES: Final = 0.2
"""Seconds within which an axis that follows the change has moved."""


@dataclass
class _Number:
    """The position counter of an axis.

    :param was: its initial value.
    :param now: the value that was last written.
    :param followed: whether the axis then moved to ``was``.
    """

    mover: Mover
    was: int
    now: int = 0
    followed: bool = False

    def write(self, number: int) -> bool:
        """Write the counter, and check immediately that the new value is reported."""
        self.now = number
        self.mover.line.send(m.WriteMotorPosition(number), self.mover.address)
        return _is_at(self.mover, number, f"after WRITE_MOTOR_POSITION wrote {number}")

    def put_back(self) -> None:
        """Restore the counter."""
        self.mover.line.settle()
        number = 2 * self.was - self.now if self.followed else self.was
        self.mover.line.send(m.WriteMotorPosition(number), self.mover.address)
        _is_at(self.mover, number, f"not restored: after WRITE_MOTOR_POSITION wrote {number}")


COUNTER: Final = Kind(
    name="counter",
    title="The position counter can be set, and nothing moves",
    rules=("position-written", "position-write-no-reply", "data-order", "twos-complement"),
)


@motion_check(
    COUNTER,
    "The position counter of {axis} is set, and nothing moves",
    messages=("WRITE_MOTOR_POSITION",),
    settings=True,
    seconds=0.8,
)
def _renumber(mover: Mover) -> None:
    """Write a value within the range and, if nothing moves, two far outside of it."""
    mover.ready()
    place = _Number(mover, mover.position)
    near = place.was + _shift(mover, place.was)
    what = f"position counter of axis {mover.name}: {place.was}"
    mover.trial.undo(what, place.put_back)
    mover.line.suspect(mover.address)
    if not place.write(near):
        return
    mover.silent(m.WriteMotorPosition(near))
    mover.line.listen(_SEES)
    stays = _is_at(mover, near, f"{_SEES:g} s after WRITE_MOTOR_POSITION wrote {near}")
    place.followed = abs(mover.position - place.was) <= DITHER
    if stays and mover.trial.must(
        not mover.is_busy,
        f"axis {mover.name} is busy after its position counter was set; nothing should move",
        wanted=b"b",
        came=b"B",
        rule="position-written",
        cause=Cause("WRITE_MOTOR_POSITION", "motion"),
    ):
        far = harmless_value(mover.trial.random, *_FAR, 3)
        place.write(far)
        place.write(-far)


def _shift(mover: Mover, was: int) -> int:
    """Return by how much the counter can be changed and changed back."""
    shift = harmless_value(mover.trial.random, *_SHIFT, 3)
    for each in (shift, -shift):
        if mover.sendable(was) == was and mover.sendable(was + each) == was + each:
            return each
    mover.trial.inconclusive(
        f"the position counter of axis {mover.name} is {was}; it could not be restored, or "
        f"{mover.low}..{mover.high} has no other usable value"
    )
    raise EnoughError


def _is_at(mover: Mover, count: int, after: str) -> bool:
    """Report wrong values of the two commands that return the position; return whether both are right."""
    both = mover.ask(m.ReadMotorPositionAndStatus(), quiet=0.0)
    assert isinstance(both, m.ReadMotorPositionAndStatusReply)
    found = {"READ_MOTOR_POSITION": mover.position, both.layout.message: both.position}
    wrong = {name: told for name, told in found.items() if abs(told - count) > DITHER}
    return mover.trial.must(
        not wrong,
        f"{after}, "
        + " and ".join(
            f"{name} of axis {mover.name} returned {told}" for name, told in wrong.items()
        ),
        rule="position-written",
        cause=Cause("WRITE_MOTOR_POSITION", EFFECT),
    )
