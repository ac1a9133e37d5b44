"""The top speed: no move is faster (sections 12 and 24)."""

from __future__ import annotations

from typing import Final

from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.ms2000.harmless import harmless_value
from stagewire_conformance.device.checks.ms2000.motion.judging import judge_course, judge_rest
from stagewire_conformance.device.checks.ms2000.motion.motion_check import motion_check
from stagewire_conformance.device.checks.ms2000.motion.mover import Mover
from stagewire_conformance.device.checks.ms2000.stored import TOP_SPEED, keep
from stagewire_ms2000 import messages as m

_SECONDS: Final = 0.5
"""How long the move takes at the speed that is set."""
_SPARE: Final = 0.9
"""The part of the time that a move needs at least at its top speed, as far as it is known when it began."""


KIND: Final = Kind(
    name="top-speed",
    title="A move is no faster than the top speed",
    rules=("top-speed-limits-travel", "top-speed-written", "maximum-speed-reply"),
)


@motion_check(
    KIND,
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
    mover.top_speed = TOP_SPEED.of(mover)  # which may be rounded
    goal = mover.goal(_SECONDS)
    far = abs(goal - mover.start)
    began = mover.line.now
    mover.begin(m.WriteTargetPosition(goal))
    samples = mover.follow(f"on its way to {goal}", far)
    took, least = mover.line.now - began, _SPARE * far / mover.counts_in(1.0)
    mover.trial.must(
        took >= least,
        f"axis {mover.name}, whose top speed was set to {speed} µm/s, went {far} counts in {took:.3f} s; at "
        f"this speed it takes {least / _SPARE:.3f} s",
    )
    judge_course(mover, goal, samples)
    judge_rest(mover, goal)
