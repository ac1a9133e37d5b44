"""The checks of the MS-2000 and the MFC-2000, in the order in which they run: first those that only ask."""

from __future__ import annotations

from typing import Final

from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.ms2000 import (
    back_to_back,
    colons,
    formats,
    identification,
    joystick,
    marks_in_data,
    motion,
    quiet,
    readback,
    reads,
    silence,
    sizes,
    status,
    timing,
    written_size,
    wrong_size,
)

__all__ = ["KINDS"]

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
    formats.KIND,
    readback.KIND,
    written_size.KIND,
    marks_in_data.KIND,
    joystick.KIND,
    *motion.KINDS,
)
