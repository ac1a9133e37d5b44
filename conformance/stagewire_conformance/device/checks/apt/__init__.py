"""The checks of Thorlabs APT: those that only ask first, then those that change something.

A folder each; beside the folders stands what several of them use.
"""

from __future__ import annotations

from typing import Final

from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.apt import (
    motion,
    outputs,
    reading,
    settings,
)

KINDS: Final[tuple[Kind, ...]] = (
    *reading.KINDS,
    *settings.KINDS,
    *outputs.KINDS,
    *motion.KINDS,
)
"""In the order in which they are run."""
