"""An axis that is stopped stands and is disabled, one that is started goes (sections 15 and 16)."""

from __future__ import annotations

from typing import Final

from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.ms2000.axis import DITHER
from stagewire_conformance.device.checks.ms2000.motion.judgement import judge_rest
from stagewire_conformance.device.checks.ms2000.motion.mover import (
    ARRIVED,
    Mover,
    Sample,
    motion_check,
)
from stagewire_conformance.device.trial import EnoughError
from stagewire_ms2000 import messages as m

_STANDS: Final = 0.4
"""Seconds in which an axis that is stopped has to stand; the document has no ramp for it."""
_STILL: Final = 0.05
"""Seconds between two looks, by which an axis that stands is at the same place."""
_DISABLED: Final = 0.3
"""Seconds in which a disabled axis does not go to a target."""
_NOT_BUSY_FROM: Final = (3, 3)
"""The firmware from which on a disabled axis is not busy."""


def stop(mover: Mover) -> int:
    """Stop an axis, see that it stands, and return where."""
    trial, line = mover.trial, mover.line
    line.send(m.StopMotor(), mover.address)
    mover.silent(m.StopMotor())
    end = line.now + _STANDS
    place, speed = mover.position, mover.speed
    while True:
        line.listen(_STILL)
        before, place, speed = place, mover.position, mover.speed
        if abs(place - before) <= DITHER and speed == 0:
            break
        trial.need(
            line.now < end,
            f"axis {mover.name} was stopped, and {_STANDS:g} s later it went from {before} to {place} at "
            f"{speed} µm/s",
        )
    line.moving.discard(mover.address)
    status = mover.status
    trial.must(
        not status.motor_signal,
        f"axis {mover.name} was stopped and stands, and its status byte tells {int(status):#04x}, with bit 0",
        came=bytes((int(status),)),
    )
    return place


KIND: Final = Kind(
    name="stop-start",
    title="A stop disables an axis, and a start enables it",
    rules=(
        "stop-disables",
        "stop-no-response",
        "start-enables",
        "start-no-response",
        "disabled-not-busy",
        "status-moving-bit",
        "size-omitted-by-three",
    ),
)


@motion_check(
    KIND,
    "{axis} stands when it is stopped, stays so, and goes when it is started",
    messages=(
        "STOP_MOTOR",
        "START_MOTOR",
        "READ_STATUS_BYTE",
    ),
    seconds=2.5,
)
def _stop_and_start(mover: Mover) -> None:
    mover.ready()
    trial, line = mover.trial, mover.line
    goal = mover.goal(0.6)
    far = abs(goal - mover.start)
    mover.begin(m.WriteTargetPosition(goal))
    seen = mover.follow(
        "on its way", far, until=lambda at: abs(at.position - mover.start) > far // 3
    )
    _is_in_time(mover, seen[-1], goal)
    stood = stop(mover)
    trial.must(
        abs(stood - goal) > ARRIVED,
        f"axis {mover.name} was stopped on its way, and went on to its target {goal}",
    )
    _judge_letter(mover, stood)
    line.send(m.WriteTargetPosition(mover.start), mover.address)
    line.listen(_DISABLED)
    trial.must(
        abs(mover.position - stood) <= DITHER,
        f"axis {mover.name} was stopped, which disables it, and went from {stood} to {mover.position} for a "
        "target",
    )
    _start(mover, stood)
    mover.begin(m.WriteTargetPosition(goal))
    mover.follow("enabled again", abs(goal - stood) + far)
    judge_rest(mover, goal)


def _is_in_time(mover: Mover, last: Sample, goal: int) -> None:
    """End the check where replies are so slow that an axis may have arrived before it is stopped."""
    left = abs(goal - last.position) / mover.counts_in(1.0)
    late = mover.line.now - last.time + 2 * last.blur  # since its position was told
    if not last.busy or late > left / 2:
        mover.trial.inconclusive(
            f"replies are too slow to stop axis {mover.name} on its way: {left:.2f} s are left, and what it "
            f"told was {late:.2f} s old"
        )
        raise EnoughError


def _judge_letter(mover: Mover, stood: int) -> None:
    """Hold the letter of a disabled axis away from its target against its firmware."""
    trial, firmware = mover.trial, mover.trial.declared.firmware
    away, busy = abs(mover.target - stood) > DITHER, mover.is_busy
    told = f"axis {mover.name} is disabled at {stood}, its target is {mover.target}, and READ_STATUS tells"
    if not away:
        trial.must(not busy, f"{told} B", wanted=b"b", came=b"B")
    elif firmware is not None and _version(firmware) >= _NOT_BUSY_FROM:
        trial.must(not busy, f"{told} B; from firmware 3.3 on it tells b", wanted=b"b", came=b"B")
    else:
        trial.info(f"{told} {'B: a reading before firmware 3.3' if busy else 'b, as from 3.3 on'}")


def _version(firmware: str) -> tuple[int, ...]:
    return tuple(int(part) for part in firmware.split(".") if part.isdigit())


def _start(mover: Mover, stood: int) -> None:
    """Start it, and see which of two things it does: go on to its target, or stay where it is."""
    line = mover.line
    line.send(m.StartMotor(), mover.address)
    mover.follow("started", abs(stood - mover.start))
    mover.silent(m.StartMotor())
    found = mover.position
    if mover.trial.must(
        min(abs(found - mover.start), abs(found - stood)) <= ARRIVED,
        f"axis {mover.name}, disabled at {stood} with the target {mover.start}, and started, is at {found}",
    ):
        stays = abs(found - stood) < abs(found - mover.start)
        mover.trial.info(
            f"START_MOTOR {'only enables: it stays where it is' if stays else 'lets it go to its target'}"
        )
