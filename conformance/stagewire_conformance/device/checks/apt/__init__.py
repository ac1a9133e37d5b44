"""The checks of Thorlabs APT, kind by kind: those that only ask first, then those that change something."""

from __future__ import annotations

from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.apt import (
    answers,
    bays,
    bursts,
    damage,
    frames,
    identification,
    identify,
    keep_alive,
    motion,
    odd_frames,
    outputs,
    quiet,
    settings,
    status,
    timing,
    updates,
)

__all__ = ["KINDS"]

KINDS: tuple[Kind, ...] = (
    quiet.KIND,
    identification.KIND,
    bays.KIND,
    frames.KIND,
    answers.KIND,
    status.KIND,
    identify.KIND,
    bursts.KIND,
    timing.KIND,
    *odd_frames.KINDS,
    *damage.KINDS,
    updates.KIND,
    keep_alive.KIND,
    *settings.KINDS,
    *outputs.KINDS,
    *motion.KINDS,
)
"""In the order in which they are run."""
