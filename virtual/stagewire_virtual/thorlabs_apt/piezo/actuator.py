"""An actuator with a strain gauge: how it is counted, how far it goes, and what is read at the beginning."""

from __future__ import annotations

import math
from typing import Final

from stagewire.errors import BadValueError
from stagewire_virtual.clock import SECOND
from stagewire_virtual.errors import BadOptionError
from stagewire_virtual.options import Settings

__all__ = ["DEFAULT_TRAVEL", "FULL_SCALE", "READING_TIME", "finite", "travel_and_share"]

FULL_SCALE: Final = 32767
"""Counts of the maximum voltage and of the whole travel (pages 96 and 97)."""

READING_TIME: Final = SECOND
"""How long the position is read before it is taken as zero (page 117 has no figure)."""

DEFAULT_TRAVEL: Final = 200
"""20 µm in steps of 100 nm, as in the example of page 118."""

_LARGEST: Final = 0xFFFF  # what PZ_GET_MAXTRAVEL holds


def travel_and_share(settings: Settings) -> tuple[int, float]:
    """Return the travel in steps of 100 nm, and which share of it the strain gauge reads at the beginning.

    Raises :class:`~stagewire_virtual.errors.BadOptionError` for a travel that no message holds, and for a
    position beyond it.
    """
    travel = DEFAULT_TRAVEL if settings.travel is None else settings.travel
    if not 0 <= travel <= _LARGEST:
        raise BadOptionError(
            f"the travel of an actuator is given in steps of 100 nm, from 0 to {_LARGEST}, not {travel}"
        )
    position = settings.position or 0
    if abs(position) > travel:
        raise BadOptionError(
            f"a strain gauge with a travel of {travel} steps of 100 nm reads from {-travel} to {travel}, "
            f"not {position}"
        )
    return travel, position / travel if travel else 0.0


def finite(share: float) -> float:
    """Return a share of full scale as a user told it.

    Raises :class:`~stagewire.errors.BadValueError` for what is not a finite number: no message holds it.
    """
    if not math.isfinite(share):
        raise BadValueError(f"a signal is a share of full scale, such as 0.5, not {share}")
    return share
