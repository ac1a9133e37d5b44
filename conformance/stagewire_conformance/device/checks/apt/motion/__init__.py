"""Checks that move motors, within the allowed range."""

from __future__ import annotations

from typing import Final

from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.apt.motion import (
    alone,
    backlash,
    disabled,
    home,
    home_again,
    in_motion,
    jogs,
    limits,
    mid_move,
    move_updates,
    profile,
    soft_limits,
    stops,
    suspension,
    targets,
    velocity,
)

KINDS: Final[tuple[Kind, ...]] = (
    home.KIND,
    alone.KIND,
    in_motion.KIND,
    targets.ABSOLUTE,
    targets.RELATIVE,
    targets.STORED,
    targets.FAR,
    mid_move.KIND,
    stops.KIND,
    jogs.KIND,
    profile.KIND,
    backlash.KIND,
    velocity.KIND,
    move_updates.KIND,
    disabled.KIND,
    home_again.KIND,
    suspension.KIND,
    limits.KIND,
    soft_limits.KIND,
)
"""The kinds in the order in which they run: homing first, because positions count from home, then whether
motors are confused, and the agreement of the replies, on which all others rely, and stops before the motions
that only a stop ends."""
