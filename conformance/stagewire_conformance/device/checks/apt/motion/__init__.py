"""Checks that move motors, within the allowed range."""

from __future__ import annotations

from typing import Final

from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.apt.motion import (
    home,
    in_motion,
    limits,
    messages,
    profile,
    stops,
    targets,
    velocity,
)

KINDS: Final[tuple[Kind, ...]] = (
    home.KIND,
    targets.ABSOLUTE,
    targets.RELATIVE,
    targets.STORED,
    targets.JOG,
    profile.KIND,
    velocity.KIND,
    stops.KIND,
    messages.SUSPEND,
    messages.UPDATES,
    in_motion.KIND,
    limits.KIND,
    targets.ALONE,
)
"""The kinds in the order in which they run: homing first, because positions count from home."""
