"""Moves by the increment, up and down (sections 19 to 21)."""

from __future__ import annotations

from typing import Final

from stagewire.protocols import Command
from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.ms2000.axis import DITHER
from stagewire_conformance.device.checks.ms2000.motion.judging import judge_course, judge_rest
from stagewire_conformance.device.checks.ms2000.motion.motion_check import motion_check
from stagewire_conformance.device.checks.ms2000.motion.mover import Mover
from stagewire_conformance.device.checks.ms2000.stored import INCREMENT, keep
from stagewire_ms2000 import messages as m

KIND: Final = Kind(
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
    KIND,
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
