"""Checks of Thorlabs APT: first those that only send requests, then those that change something.

Each group has a folder. Modules that several groups use are next to the folders.
"""

from __future__ import annotations

from typing import Final

from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.apt import (
    actuators,
    motion,
    outputs,
    reading,
    settings,
)

KINDS: Final[tuple[Kind, ...]] = (
    *reading.KINDS,
    *settings.KINDS,
    *outputs.KINDS,
    *reading.AFTER_OUTPUTS,
    *motion.KINDS,
    *actuators.KINDS,
)
"""The kinds in the order in which they run."""
