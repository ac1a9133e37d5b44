"""Checks that only ask, and send what has an error, which is ignored."""

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
"""In the order in which they are run."""
