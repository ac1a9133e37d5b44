"""Moves by the increment, up and down (sections 19 to 21).

The position counter is given another number, and nothing moves (section 17). A controller that
also keeps the number of its target would go there, so this needs the range of motion.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from stagewire.protocols import Command
from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.ms2000.axis import DITHER
from stagewire_conformance.device.checks.ms2000.harmless import harmless_value
from stagewire_conformance.device.checks.ms2000.motion.judgement import judge_course, judge_rest
from stagewire_conformance.device.checks.ms2000.motion.mover import Mover, motion_check
from stagewire_conformance.device.checks.ms2000.stored import INCREMENT, keep
from stagewire_conformance.device.trial import EnoughError
from stagewire_ms2000 import messages as m

INCREMENTS: Final = Kind(
    name="move-increment",
    title="A move by the increment goes as far, from where the axis is",
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
    "{axis} goes up and down by its increment, from where it is",
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
    """Move twice by the increment in each direction: it is counted from where the axis is."""
    mover.ready()
    keep(mover, INCREMENT)
    increment = abs(mover.goal() - mover.start) // 2
    INCREMENT.set(mover, increment)
    up: tuple[Command, int] = (m.IncrementMoveUp(), increment)
    down: tuple[Command, int] = (m.IncrementMoveDown(), -increment)
    fits = mover.start + 2 * increment <= mover.high
    for command, way in (up, up, down, down) if fits else (down, down, up, up):
        _move(mover, command, way)


def _move(mover: Mover, command: Command, way: int) -> None:
    begin, name = mover.position, command.layout.message
    mover.begin(command)
    target = mover.target
    mover.trial.need(
        abs(target - (begin + way)) <= DITHER,
        f"{name} of axis {mover.name} at {begin}, with the increment {abs(way)}, made the target {target}; "
        f"it is {begin + way}",
    )
    samples = mover.follow(f"after {name}", abs(way))
    judge_course(mover, target, samples)
    judge_rest(mover, target)
    mover.silent(command)


_SHIFT: Final = (100, 500)
"""Counts by which the number is changed first, 10 to 50 µm."""
_FAR: Final = (0x10000, 0x3FFFF)
"""Counts by which it is changed then: numbers that need all three bytes."""
_SEES: Final = 0.2
"""Seconds in which an axis that moves because of it has moved."""


@dataclass
class _Number:
    """What the place of an axis is called.

    :param was: at the beginning.
    :param now: as it was written last.
    :param followed: whether the axis went back to ``was`` when it had been written.
    """

    mover: Mover
    was: int
    now: int = 0
    followed: bool = False

    def write(self, number: int) -> bool:
        """Give the place a number, and see at once that it is told."""
        self.now = number
        self.mover.line.send(m.WriteMotorPosition(number), self.mover.address)
        return _is_at(self.mover, number, f"WRITE_MOTOR_POSITION wrote {number}")

    def put_back(self) -> None:
        """Give the place its number again."""
        self.mover.line.settle()
        number = 2 * self.was - self.now if self.followed else self.was
        self.mover.line.send(m.WriteMotorPosition(number), self.mover.address)
        _is_at(self.mover, number, f"not restored: WRITE_MOTOR_POSITION wrote {number}")


COUNTER: Final = Kind(
    name="counter",
    title="The counter of positions takes another number, and nothing moves",
    rules=("position-written", "position-write-no-reply", "data-order", "twos-complement"),
)


@motion_check(
    COUNTER,
    "The place of {axis} is given another number, and nothing moves",
    messages=("WRITE_MOTOR_POSITION",),
    settings=True,
    seconds=0.8,
)
def _renumber(mover: Mover) -> None:
    """Give the place another number within the range, and, where nothing moves by it, two far away."""
    mover.ready()
    place = _Number(mover, mover.position)
    near = place.was + _shift(mover, place.was)
    what = f"the number of the place of axis {mover.name}: {place.was}"
    mover.trial.undo(what, place.put_back)
    if not place.write(near):
        return
    mover.silent(m.WriteMotorPosition(near))
    mover.line.listen(_SEES)
    stays = _is_at(mover, near, f"{_SEES:g} s after WRITE_MOTOR_POSITION wrote {near}")
    place.followed = abs(mover.position - place.was) <= DITHER
    if stays and mover.trial.must(
        not mover.is_busy,
        f"axis {mover.name} was given another number for its place, and is busy",
        wanted=b"b",
        came=b"B",
    ):
        far = harmless_value(mover.trial.random, *_FAR, 3)
        place.write(far)
        place.write(-far)


def _shift(mover: Mover, was: int) -> int:
    """Return by how much the number can be changed, and changed back."""
    shift = harmless_value(mover.trial.random, *_SHIFT, 3)
    for each in (shift, -shift):
        if mover.sendable(was) == was and mover.sendable(was + each) == was + each:
            return each
    mover.trial.inconclusive(
        f"the place of axis {mover.name} has the number {was}, which could not be put back, or no other in "
        f"{mover.low}..{mover.high}"
    )
    raise EnoughError


def _is_at(mover: Mover, count: int, after: str) -> bool:
    """Say whether both commands that tell the position tell a number."""
    both = mover.ask(m.ReadMotorPositionAndStatus(), quiet=0.0)
    assert isinstance(both, m.ReadMotorPositionAndStatusReply)
    found = {"READ_MOTOR_POSITION": mover.position, both.layout.message: both.position}
    wrong = {name: told for name, told in found.items() if abs(told - count) > DITHER}
    return mover.trial.must(
        not wrong,
        f"{after}, and of axis {mover.name} "
        + " and ".join(f"{name} tells {told}" for name, told in wrong.items()),
    )
