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
    together,
    vector,
)

KINDS: Final[tuple[Kind, ...]] = (
    targets.TARGETS,
    together.TOGETHER,
    increments.INCREMENTS,
    stops.KIND,
    speeds.SPEEDS,
    vector.KIND,
    speeds.RAMPS,
    limits.KIND,
    increments.COUNTER,
)
