"""Checks of the MS-2000 and the MFC-2000: first those without changes, then those that change something.

Each group has a folder. Modules that several groups use are next to the folders.
"""

from __future__ import annotations

from typing import Final

from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.ms2000 import (
    motion,
    reading,
    settings,
)

KINDS: Final[tuple[Kind, ...]] = (
    *reading.KINDS,
    *settings.KINDS,
    *motion.KINDS,
)
"""The kinds in the order in which they run."""
