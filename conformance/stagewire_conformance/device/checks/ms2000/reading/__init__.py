"""Checks that only send requests, or commands with errors, which must be ignored."""

from __future__ import annotations

from typing import Final

from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.ms2000.reading import (
    colons,
    reads,
    silence,
    sizes,
    status,
    timing,
)

KINDS: Final[tuple[Kind, ...]] = (
    reads.IDENTIFICATION,
    reads.READS,
    sizes.SIZES,
    status.KIND,
    silence.QUIET,
    silence.SILENCE,
    sizes.WRONG_SIZE,
    colons.KIND,
    timing.BACK_TO_BACK,
    timing.TIMING,
)
"""The kinds in the order in which they run."""
