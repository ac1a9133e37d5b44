"""The top speed, which no move exceeds (sections 12 and 24), and the ramp time.

An axis reaches its top speed evenly within the ramp time (sections 10, 22 and 25).
"""

from __future__ import annotations

from typing import Final

from stagewire_conformance.device.causes import EFFECT, Cause
from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.ms2000.harmless import harmless_value
from stagewire_conformance.device.checks.ms2000.motion.judgement import judge_course, judge_rest
from stagewire_conformance.device.checks.ms2000.motion.mover import (
    SPEED_REPLY,
    Mover,
    Sample,
    motion_check,
)
from stagewire_conformance.device.checks.ms2000.motion.stops import IGNORED, stop
from stagewire_conformance.device.checks.ms2000.stored import RAMP_TIME, TOP_SPEED, keep
from stagewire_conformance.device.trial import EnoughError
from stagewire_ms2000 import messages as m

_SECONDS: Final = 0.5
"""The duration of the move at the set speed in seconds."""
_SPARE: Final = 0.9
"""The minimum fraction of the calculated duration of a move, because its start is not known exactly."""


SPEEDS: Final = Kind(
    name="top-speed",
    title="A move is no faster than the top speed",
    rules=("top-speed-limits-travel", "top-speed-written", "maximum-speed-reply"),
)


@motion_check(
    SPEEDS,
    "A move of {axis} is no faster than its top speed",
    messages=("WRITE_TOP_SPEED",),
    settings=True,
    seconds=1.5,
)
def _obeys(mover: Mover) -> None:
    mover.ready()
    top = keep(mover, TOP_SPEED)
    speed = harmless_value(mover.trial.random, max(1, top // 4), max(1, top // 2), 2)
    TOP_SPEED.set(mover, speed)
    mover.top_speed = TOP_SPEED.of(mover)  # the value may be rounded
    goal = mover.goal(_SECONDS)
    far = abs(goal - mover.start)
    began = mover.line.now
    mover.begin(m.WriteTargetPosition(goal))
    samples = mover.follow(f"on its way to {goal}", far)
    took, least = mover.line.now - began, _SPARE * far / mover.counts_in(1.0)
    mover.trial.must(
        took >= least,
        f"axis {mover.name}, with a top speed of {speed} µm/s, moved {far} counts in {took:.3f} "
        f"s; at this speed it should take {least / _SPARE:.3f} s",
        rule="top-speed-limits-travel",
        cause=Cause("WRITE_TOP_SPEED", EFFECT),
    )
    judge_course(mover, goal, samples)
    judge_rest(mover, goal)


_RAMP: Final = 0.25
"""The ramp time in seconds, long enough to be observed."""
_LONG: Final = 2.0
"""The length of the move, in ramp times at top speed; its last ramp does not begin before that time."""
_JUDGED: Final = 1.4
"""Ramp times up to which a speed is judged."""
_ON_RAMP: Final = 0.2
"""The tolerance of a speed on a ramp, as a fraction of the top speed: servos and hosts lag."""
_OFF_RAMP: Final = 0.1
"""The tolerance after the ramp has been over for :data:`_ON_RAMP` of its time."""
_FASTEST: Final = 0x7FFF
"""The highest speed that a reply can represent, in µm/s."""
_BLUR: Final = 0.1 * _RAMP
"""The maximum time in seconds between request and reply of a speed; half of its tolerance on a ramp."""
_LEAST: Final = 4
"""Samples that are required."""
_SLOWEST: Final = 50
"""The lowest top speed whose ramp can be judged, in µm/s."""


RAMPS: Final = Kind(
    name="ramps",
    title="An axis reaches its top speed within the ramp time",
    rules=(
        "ramp-time-meaning",
        "ramp-time-acceleration",
        "vector-speed-ramp",
        "status-ramping-bits",
    ),
)


@motion_check(
    RAMPS,
    "{axis} accelerates within its ramp time when it moves to a target",
    messages=("WRITE_RAMPING_TIME", "WRITE_TOP_SPEED"),
    settings=True,
    seconds=2.5,
    name="target",
)
def _to_target(mover: Mover) -> None:
    _prepare(mover)
    goal = mover.goal(_LONG * _RAMP)
    began = mover.begin(m.WriteTargetPosition(goal))
    samples = mover.follow(f"on its way to {goal}", abs(goal - mover.start))
    _judge(mover, began, samples, mover.top_speed)
    judge_course(mover, goal, samples)


@motion_check(
    RAMPS,
    "{axis} accelerates within its ramp time when it moves at a vector speed",
    messages=("WRITE_VECTOR_SPEED", "WRITE_RAMPING_TIME", "WRITE_TOP_SPEED", "STOP_MOTOR"),
    settings=True,
    seconds=2.0,
    name="vector",
)
def _at_speed(mover: Mover) -> None:
    """Move up at half the top speed, which takes half of the ramp. The document has no way to move down."""
    mover.trial.depends_on(IGNORED)
    _prepare(mover)
    goal = mover.goal(_LONG * _RAMP)
    if goal < mover.start:
        mover.go(goal)
    speed, brake = mover.top_speed // 2, mover.high - mover.counts_in(_RAMP)
    began = mover.begin(m.WriteVectorSpeed(speed))
    try:
        samples = mover.follow(
            f"at {speed} µm/s",
            abs(goal - mover.start),
            until=lambda at: at.time > began + _RAMP or at.position > brake,
        )
    finally:
        stop(mover)
    _judge(mover, began, samples, speed)


def _prepare(mover: Mover) -> None:
    """Set the ramp, and half the top speed, or less if the range is too short to reach it."""
    mover.ready()
    trial = mover.trial
    keep(mover, RAMP_TIME)
    top = keep(mover, TOP_SPEED)
    room = max(mover.high - mover.start, mover.start - mover.low)
    speed = min(
        max(top // 2, _SLOWEST), top, _FASTEST, int(room / mover.counts_in(_LONG * _RAMP, 1))
    )
    if speed < _SLOWEST:
        trial.inconclusive(f"{mover.low}..{mover.high} leaves too little room to reach a speed")
        raise EnoughError
    RAMP_TIME.set(mover, round(1000 * _RAMP))
    TOP_SPEED.set(mover, speed)
    mover.ramp_time, mover.top_speed = RAMP_TIME.of(mover), TOP_SPEED.of(mover)


def _judge(mover: Mover, began: float, samples: list[Sample], speed: int) -> None:
    """Compare the speeds of the first ramp, and of the time after it, with the elapsed time.

    :param speed: the speed at the end of the ramp.
    """
    top = mover.top_speed
    # The last ramp may have begun after the judged part.
    judged = [each for each in samples if each.time - began <= _JUDGED * _RAMP]
    sharp = [each for each in judged if each.blur <= _BLUR]
    if len(sharp) < _LEAST:
        mover.trial.inconclusive(f"replies are too slow to show a ramp of {1000 * _RAMP:.0f} ms")
        return
    for sample in sharp:
        passed = (sample.time - began) / _RAMP
        due = min(speed, round(top * passed))
        over = passed > speed / top + _ON_RAMP
        mover.trial.must(
            abs(abs(sample.speed) - due) <= (_OFF_RAMP if over else _ON_RAMP) * top,
            f"{1000 * _RAMP * passed:.0f} ms after the start of the move, axis {mover.name} "
            f"moves at {sample.speed} µm/s; with a ramp of {1000 * _RAMP:.0f} ms to a top speed "
            f"of {top} µm/s, it should be {due}",
            rule="ramp-time-acceleration" if speed == top else "vector-speed-ramp",
            cause=Cause("WRITE_RAMPING_TIME", EFFECT),
            because=(*SPEED_REPLY, *TOP_SPEED.defects, Cause("WRITE_VECTOR_SPEED", EFFECT)),
        )
