"""Checks that move an axis, within the range that was allowed, and bring it back."""

from __future__ import annotations

from typing import Final

from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.ms2000.motion import (
    counter,
    increments,
    limits,
    ramps,
    speeds,
    stopping,
    targets,
    together,
    vector,
)

KINDS: Final[tuple[Kind, ...]] = (
    targets.KIND,
    increments.KIND,
    together.KIND,
    stopping.KIND,
    speeds.KIND,
    vector.KIND,
    ramps.KIND,
    limits.KIND,
    counter.KIND,
)
