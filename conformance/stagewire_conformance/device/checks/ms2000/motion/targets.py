"""Moves to a target, from rest and on the way (section 18)."""

from __future__ import annotations

from typing import Final

from stagewire_conformance.device.causes import Cause
from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.ms2000.axis import DITHER, Axis
from stagewire_conformance.device.checks.ms2000.motion.judgement import judge_course, judge_rest
from stagewire_conformance.device.checks.ms2000.motion.mover import Mover, motion_check
from stagewire_ms2000 import messages as m

_SHORT: Final = 0.2
"""The duration in seconds of a move that only has to be long enough for a few requests."""


TARGETS: Final = Kind(
    name="move-target",
    title="An axis moves to its target, and reports its state correctly on the way and afterwards",
    rules=(
        "target-written",
        "target-moves",
        "target-no-reply",
        "target-reply",
        "status-busy",
        "status-not-busy",
        "status-moving-bit",
        "status-ramping-bits",
        "current-speed-reply",
    ),
)


@motion_check(TARGETS, "{axis} moves to a target and back, and reports busy meanwhile", seconds=2.0)
def _there_and_back(mover: Mover) -> None:
    """Move to a target and back; the other axes must not move."""
    mover.ready()
    others = _others(mover)
    goal = mover.goal()
    for place in (goal, mover.start):
        began = mover.position
        mover.begin(m.WriteTargetPosition(place))
        mover.trial.must(
            mover.target == place,
            f"WRITE_TARGET_POSITION of axis {mover.name} wrote {place}, but "
            f"READ_TARGET_POSITION returned {mover.target}",
            rule="target-written",
            cause=Cause("READ_TARGET_POSITION", "target"),
        )
        samples = mover.follow(f"on its way to {place}", abs(place - began))
        judge_rest(mover, place)
        judge_course(mover, place, samples)
        mover.silent(m.WriteTargetPosition(place))
        for axis, was in others.items():
            found = axis.position
            mover.trial.must(
                abs(found - was) <= DITHER,
                f"axis {mover.name} was moved, and axis {axis.name} also moved, from {was} "
                f"to {found}",
                rule="target-moves",
                cause=Cause("motion", "another axis"),
            )


def _others(mover: Mover) -> dict[Axis, int]:
    axes = [Axis(mover.trial, place) for place in mover.trial.declared.places]
    return {axis: axis.position for axis in axes if axis.address != mover.address}


@motion_check(TARGETS, "{axis} accepts another target on its way", seconds=1.5, name="turned-round")
def _turned_round(mover: Mover) -> None:
    """Set another target on the way."""
    mover.ready()
    goal = mover.goal()
    far = abs(goal - mover.start)
    mover.begin(m.WriteTargetPosition(goal))
    mover.follow(
        f"on its way to {goal}", far, until=lambda at: abs(at.position - mover.start) > far // 3
    )
    mover.begin(m.WriteTargetPosition(mover.start))
    mover.follow(f"turned back to {mover.start}", far)
    judge_rest(mover, mover.start)


@motion_check(
    TARGETS,
    "The status byte of {axis} reports motion while it moves, and not afterwards",
    messages=("READ_STATUS_BYTE",),
    seconds=1.4,
    name="status-byte",
)
def _status_byte(mover: Mover) -> None:
    """Read the status byte alone, on the way and at the end."""
    mover.ready()
    goal = mover.goal(_SHORT)
    far = abs(goal - mover.start)
    mover.begin(m.WriteTargetPosition(goal))
    mover.follow(
        f"on its way to {goal}", far, until=lambda at: abs(at.position - mover.start) > far // 3
    )
    before, byte, after = mover.sample(), mover.status, mover.sample()
    mover.trial.must(
        not (before.status.motor_signal and after.status.motor_signal) or byte.motor_signal,
        f"axis {mover.name} on its way from {before.position} to {after.position}: "
        f"READ_STATUS_BYTE returned {int(byte):#04x}, without bit 0, which means motion; "
        f"READ_MOTOR_POSITION_AND_STATUS returned {int(after.status):#04x}",
        wanted=bytes((int(after.status),)),
        came=bytes((int(byte),)),
        rule="status-moving-bit",
        cause=Cause("READ_STATUS_BYTE", "motion"),
    )
    mover.follow(f"on its way to {goal}", far)
    judge_rest(mover, goal)
    byte = mover.status
    mover.trial.must(
        not byte.motor_signal and not byte.ramping,
        f"axis {mover.name} is no longer busy, but READ_STATUS_BYTE returned "
        f"{int(byte):#04x}, which reports motion",
        came=bytes((int(byte),)),
        rule="status-moving-bit",
        cause=Cause("READ_STATUS_BYTE", "motion at rest"),
    )
