"""The checks of the MS-2000 and the MFC-2000: those that only ask first, then those that change something.

A folder each; beside the folders stands what several of them use.
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
"""In the order in which they are run."""
