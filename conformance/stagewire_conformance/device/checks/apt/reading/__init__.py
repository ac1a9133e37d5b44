"""Checks that only ask, or send what means nothing.

One sends settings that are cut short, and needs leave to change settings: whether they were taken shows then.
"""

from __future__ import annotations

from typing import Final

from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.apt.reading import (
    answers,
    bays,
    damage,
    frames,
    identification,
    keep_alive,
    odd_frames,
    status,
    timing,
    updates,
)

KINDS: Final[tuple[Kind, ...]] = (
    updates.QUIET,
    identification.IDENTIFICATION,
    bays.KIND,
    frames.KIND,
    answers.KIND,
    status.KIND,
    identification.IDENTIFY,
    timing.BURSTS,
    timing.TIMING,
    odd_frames.UNKNOWN_ID,
    odd_frames.WRONG_LENGTH,
    odd_frames.FOREIGN_DESTINATION,
    damage.TRUNCATED,
    damage.GARBAGE,
    updates.UPDATES,
    keep_alive.KIND,
)
"""In the order in which they are run."""
