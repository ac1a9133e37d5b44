"""Checks that change settings, and restore them."""

from __future__ import annotations

from typing import Final

from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.ms2000.settings import (
    formats,
    joystick,
    marks_in_data,
    readback,
)

KINDS: Final[tuple[Kind, ...]] = (
    formats.KIND,
    readback.READBACK,
    readback.WRITTEN_SIZE,
    marks_in_data.KIND,
    joystick.KIND,
)
"""The kinds in the order in which they run."""
