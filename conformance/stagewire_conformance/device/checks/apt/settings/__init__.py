"""Checks that change settings: read-back, independence of channels and bays, saving."""

from __future__ import annotations

from typing import Final

from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.apt.settings import (
    channels,
    connectors,
    counters,
    eeprom,
    readback,
)

KINDS: Final[tuple[Kind, ...]] = (
    readback.KIND,
    counters.KIND,
    channels.CHANNELS,
    channels.BAYS_APART,
    connectors.KIND,
    eeprom.KIND,
)
"""The kinds in the order in which they run."""
