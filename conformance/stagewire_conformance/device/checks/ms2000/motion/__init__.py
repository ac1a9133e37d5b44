"""Checks that move an axis within the allowed range, and bring it back."""

from __future__ import annotations

from typing import Final

from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.ms2000.motion import (
    increments,
    limits,
    speeds,
    stops,
    targets,
    vector,
)

KINDS: Final[tuple[Kind, ...]] = (
    targets.TARGETS,
    increments.INCREMENTS,
    targets.TOGETHER,
    stops.KIND,
    speeds.SPEEDS,
    vector.KIND,
    speeds.RAMPS,
    limits.KIND,
    increments.COUNTER,
)
