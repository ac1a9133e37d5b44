"""Checks that move inertial drives and paddles, within the allowed range.

They have no limit switches and no home position of their own, and an inertial drive only counts its steps, so
the checks of motors do not apply.
"""

from __future__ import annotations

from typing import Final

from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.apt.actuators import counters, jogs, moves, stops

KINDS: Final[tuple[Kind, ...]] = (
    moves.MOVE,
    stops.STOP,
    jogs.JOG,
    moves.HOME,
    stops.DISABLED,
    counters.COUNTER,
)
"""The kinds in the order in which they run: a stop is checked before jogs."""
