"""The travel of an actuator with a strain gauge, as its user told it."""

from __future__ import annotations

from typing import Final

from stagewire_virtual.errors import BadOptionError
from stagewire_virtual.thorlabs_apt.channel import Settings

__all__ = ["DEFAULT_TRAVEL", "travel_and_share"]

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
