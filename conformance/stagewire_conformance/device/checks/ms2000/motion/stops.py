"""Stop and start: a stopped axis is at rest and disabled, a started one can move (sections 15 and 16)."""

from __future__ import annotations

from typing import Final

from stagewire_conformance.device.causes import EFFECT, Cause
from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.ms2000.axis import DITHER
from stagewire_conformance.device.checks.ms2000.motion.judgement import judge_rest
from stagewire_conformance.device.checks.ms2000.motion.mover import (
    ARRIVED,
    TARGET,
    Mover,
    Sample,
    motion_check,
)
from stagewire_conformance.device.trial import EnoughError
from stagewire_ms2000 import messages as m

_STANDS: Final = 0.4
"""Seconds in which a stopped axis must come to rest; the document has no ramp for a stop."""
_STILL: Final = 0.05
"""Seconds between two readings that show whether an axis is at rest."""
_DISABLED: Final = 0.3
"""Seconds in which a disabled axis must not start a move."""
_NOT_BUSY_FROM: Final = (3, 3)
"""The first firmware in which a disabled axis is not busy."""
_RESUMES: Final = 0.8
"""Seconds in which a stopped axis must not resume its motion."""
IGNORED: Final = Cause("STOP_MOTOR", EFFECT)
"""The cause that an axis does not stop on command. Later checks do not move it at a vector speed then."""


def stop(mover: Mover, goal: int | None = None) -> int:
    """Stop an axis, check that it comes to rest, and return its position.

    :param goal: the target on its way to which it is stopped, if it has one.
    """
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
            f"axis {mover.name} was stopped, but {_STANDS:g} s later it moved from {before} to "
            f"{place} at {speed} µm/s",
            rule="stop-disables",
            cause=IGNORED,
        )
    line.moving.discard(mover.address)
    trial.need(
        goal is None or abs(place - goal) > ARRIVED,
        f"axis {mover.name} was stopped on its way, but went on to its target {goal}",
        rule="stop-disables",
        cause=Cause("STOP_MOTOR", EFFECT),
    )
    status = mover.status
    trial.must(
        not status.motor_signal,
        f"axis {mover.name} was stopped and is at rest, but its status byte is "
        f"{int(status):#04x}, with bit 0, which means motion",
        came=bytes((int(status),)),
        rule="status-moving-bit",
        cause=Cause("status byte", "motion at rest"),
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
    "{axis} stops on command, stays at rest, and can move again after a start",
    messages=(
        "STOP_MOTOR",
        "START_MOTOR",
        "READ_STATUS_BYTE",
    ),
    seconds=3.1,
)
def _stop_and_start(mover: Mover) -> None:
    mover.ready()
    line = mover.line
    goal = mover.goal(0.6)
    far = abs(goal - mover.start)
    mover.begin(m.WriteTargetPosition(goal))
    seen = mover.follow(
        "on its way", far, until=lambda at: abs(at.position - mover.start) > far // 3
    )
    stood = stop_on_the_way(mover, seen[-1], goal)
    _judge_letter(mover, stood)
    line.listen(_RESUMES)
    mover.trial.need(
        abs(mover.position - stood) <= DITHER,
        f"axis {mover.name} was stopped and was at rest at {stood}, but then moved on to {mover.position}",
        rule="stop-disables",
        cause=IGNORED,
    )
    line.send(m.WriteTargetPosition(mover.start), mover.address)
    line.listen(_DISABLED)
    judge_disabled(mover, stood, "a new target")
    _start(mover, stood)
    mover.begin(m.WriteTargetPosition(goal))
    mover.follow("enabled again", abs(goal - stood) + far)
    judge_rest(mover, goal)


def stop_on_the_way(mover: Mover, last: Sample, goal: int) -> int:
    """Stop an axis on its way to a target, and return its position; end the check if it ignores the stop."""
    _is_in_time(mover, last, goal)
    return stop(mover, goal)


def judge_disabled(mover: Mover, stood: int, what: str) -> None:
    """Check that a stopped axis has not moved, and end the check if it has."""
    now = mover.position
    mover.trial.need(
        abs(now - stood) <= DITHER,
        f"axis {mover.name} was stopped, which disables it, but moved from {stood} to {now} for {what}",
        rule="stop-disables",
        cause=Cause("STOP_MOTOR", "disables"),
    )


def _is_in_time(mover: Mover, last: Sample, goal: int) -> None:
    """End the check if replies are so slow that an axis may have arrived before it is stopped."""
    left = abs(goal - last.position) / mover.counts_in(1.0)
    late = mover.line.now - last.time + 2 * last.blur  # since its position was sent
    if not last.busy or late > left / 2:
        mover.trial.inconclusive(
            f"replies are too slow to stop axis {mover.name} on its way: {left:.2f} s are left, "
            f"and its last reply is {late:.2f} s old"
        )
        raise EnoughError


def _judge_letter(mover: Mover, stood: int) -> None:
    """Judge the letter of a disabled axis away from its target, which depends on the firmware."""
    trial, firmware = mover.trial, mover.trial.declared.firmware
    away, busy = abs(mover.target - stood) > DITHER, mover.is_busy
    told = (
        f"axis {mover.name} is disabled at {stood} with the target {mover.target}, and "
        "READ_STATUS returned"
    )
    if not away:
        trial.must(
            not busy,
            f"{told} B",
            wanted=b"b",
            came=b"B",
            rule="status-not-busy",
            cause=Cause("READ_STATUS", "busy at rest"),
        )
    elif firmware is not None and _version(firmware) >= _NOT_BUSY_FROM:
        trial.must(
            not busy,
            f"{told} B; since firmware 3.3 it should return b",
            wanted=b"b",
            came=b"B",
            rule="disabled-not-busy",
            cause=Cause("READ_STATUS", "busy when disabled"),
        )
    else:
        trial.info(f"{told} {'B, as before firmware 3.3' if busy else 'b, as since firmware 3.3'}")


def _version(firmware: str) -> tuple[int, ...]:
    return tuple(int(part) for part in firmware.split(".") if part.isdigit())


def _start(mover: Mover, stood: int) -> None:
    """Start the axis, and check that it either goes on to its target or stays where it is."""
    line = mover.line
    line.send(m.StartMotor(), mover.address)
    mover.follow("started", abs(stood - mover.start))
    mover.silent(m.StartMotor())
    found = mover.position
    if mover.trial.must(
        min(abs(found - mover.start), abs(found - stood)) <= ARRIVED,
        f"axis {mover.name}, disabled at {stood} with the target {mover.start}, is at "
        f"{found} after START_MOTOR; it should be at one of the two",
        rule="start-enables",
        cause=Cause("START_MOTOR", EFFECT),
        because=(TARGET,),
    ):
        stays = abs(found - stood) < abs(found - mover.start)
        mover.trial.info(
            "START_MOTOR "
            f"{'only enables the axis, which stays there' if stays else 'lets the axis go to its target'}"
        )
