"""Permissions for tests that need everything."""

from __future__ import annotations

from stagewire_conformance.device.permissions import HAZARDS, Permissions, Range

ALL_HAZARDS: dict[str, bool] = {str(hazard): True for hazard in HAZARDS}
"""The permissions for all hazards, as keyword arguments of :class:`Permissions`."""


def everything(motion: Range | None) -> Permissions:
    """Return all permissions, with motion within a range."""
    return Permissions(motion=motion, settings=True, tuning=True, eeprom=True, **ALL_HAZARDS)


def everything_but(allowed: Permissions, without: str) -> Permissions:
    """Return permissions without one of them."""
    given = {need: getattr(allowed, need) for need in allowed.granted if need != without}
    return Permissions(**given)
