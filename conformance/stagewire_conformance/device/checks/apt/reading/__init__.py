"""Checks that only send requests, or messages without effect.

One check sends truncated settings, which must have no effect. It needs permission to change settings, because
a controller that fails the check applies them.
"""

from __future__ import annotations

from typing import Final

from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.apt.reading import (
    answers,
    bays,
    damage,
    enabled_bit,
    frames,
    identification,
    keep_alive,
    odd_frames,
    status,
    timing,
    updates,
)

KINDS: Final[tuple[Kind, ...]] = (
    keep_alive.REPLY,
    updates.QUIET,
    identification.IDENTIFICATION,
    bays.KIND,
    frames.KIND,
    answers.KIND,
    updates.UPDATES,
    keep_alive.KIND,
    status.KIND,
    identification.IDENTIFY,
    timing.BURSTS,
    timing.TIMING,
    odd_frames.UNKNOWN_ID,
    odd_frames.WRONG_LENGTH,
    odd_frames.FOREIGN_DESTINATION,
    damage.TRUNCATED,
    damage.GARBAGE,
)
"""The kinds in the order in which they run: status messages that come without a request would disturb
others."""

AFTER_OUTPUTS: Final[tuple[Kind, ...]] = (enabled_bit.KIND,)
"""Kinds that run after those of outputs, because these show which of two messages is wrong."""
