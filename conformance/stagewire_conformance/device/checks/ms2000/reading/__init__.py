"""Checks that only ask, and send what has an error, which is ignored."""

from __future__ import annotations

from typing import Final

from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.ms2000.reading import (
    back_to_back,
    colons,
    identification,
    quiet,
    reads,
    silence,
    sizes,
    status,
    timing,
    wrong_size,
)

KINDS: Final[tuple[Kind, ...]] = (
    identification.KIND,
    reads.KIND,
    sizes.KIND,
    status.KIND,
    quiet.KIND,
    silence.KIND,
    wrong_size.KIND,
    colons.KIND,
    back_to_back.KIND,
    timing.KIND,
)
"""In the order in which they are run."""
