"""Checks that move motors, within the allowed range."""

from __future__ import annotations

from typing import Final

from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.apt.motion import (
    home,
    limits,
    messages,
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
    velocity.KIND,
    stops.KIND,
    messages.SUSPEND,
    messages.UPDATES,
    limits.KIND,
    targets.ALONE,
)
"""The kinds in the order in which they run: homing first, because positions count from home."""
