"""Checks that move motors, within the range that was allowed."""

from __future__ import annotations

from typing import Final

from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.apt.motion import (
    alone,
    home,
    jog,
    limits,
    stops,
    suspending,
    targeted,
    updates,
    velocity,
)

KINDS: Final[tuple[Kind, ...]] = (
    home.KIND,
    targeted.ABSOLUTE,
    targeted.RELATIVE,
    targeted.STORED,
    jog.KIND,
    velocity.KIND,
    stops.KIND,
    suspending.KIND,
    updates.KIND,
    limits.KIND,
    alone.KIND,
)
"""In the order in which they are run; homing first, because positions count from there."""
