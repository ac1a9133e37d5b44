"""Which axes a controller has, and what cannot be told of one."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from stagewire_virtual.asi_ms2000.servo_axis import TRAVEL, ServoAxis
from stagewire_virtual.clock import Clock
from stagewire_virtual.errors import BadOptionError
from stagewire_virtual.options import Options, Settings, known_only
from stagewire_virtual.units import Unit

__all__ = ["fit_axes", "identifiers"]

_FITTED: Final = 3
"""Axes of a controller that nothing is told of: X, Y and Z. A fourth one, F, comes with its settings."""


def identifiers(unit: Unit) -> dict[str, int]:
    """Return the identifiers of all axes by name, in order, without those for the future (section 2)."""
    values = unit.registry["enumerations"]["axis"]["values"]
    found = {name: value["value"] for name, value in values.items() if not value.get("reserved")}
    return dict(sorted(found.items(), key=lambda axis: axis[1]))


def fit_axes(
    unit: Unit, clock: Clock, options: Options, readings: Mapping[str, str]
) -> dict[str, ServoAxis]:
    """Make the axes of a controller, by name.

    Raises :class:`~stagewire_virtual.errors.BadOptionError` for an option that it cannot have.
    """
    names = list(identifiers(unit))
    _check(unit, options, names)
    fitted = names[: max(_FITTED, len(options.channels))]
    return {
        name: ServoAxis(clock, options.settings(index), readings)
        for index, name in enumerate(fitted)
    }


def _check(unit: Unit, options: Options, names: list[str]) -> None:
    known_only("quirk", options.quirks, (), unit.name)
    wrong = {
        "does not report a model": options.model is not None,
        "does not report a serial number": options.serial_number is not None,
        "does not report a hardware type": options.hardware_type is not None,
        "does not report a stage id": options.stage_id is not None,
        "stays silent on what it does not know": options.answer_unsupported,
        "has no bays": bool(options.empty_bays),
        f"has no more axes than {', '.join(names)}": len(options.channels) > len(names),
    }
    for settings in options.channels:
        wrong |= _wrong_of(settings)
    for sentence, is_wrong in wrong.items():
        if is_wrong:
            raise BadOptionError(f"{unit.name} {sentence}")


def _wrong_of(settings: Settings) -> dict[str, bool]:
    travel = TRAVEL if settings.travel is None else settings.travel
    position = 0 if settings.position is None else settings.position
    return {
        "counts in tenths of a micrometre, whatever its stages": settings.stage is not None,
        f"needs a travel above 0, not {travel}": travel <= 0,
        f"cannot stand at {position} of a travel of {travel}": not 0 <= position <= travel,
    }
