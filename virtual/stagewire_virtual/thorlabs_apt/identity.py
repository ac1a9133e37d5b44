"""What a controller says of itself when it is asked for its hardware information (pages 21 and 22)."""

from __future__ import annotations

import random
from typing import Final

from stagewire_apt import messages as m
from stagewire_apt.enumerations import HardwareType
from stagewire_virtual.errors import BadOptionError
from stagewire_virtual.options import Options
from stagewire_virtual.units import Unit

__all__ = ["DIGITS", "card", "motherboard", "stand_alone"]

DIGITS: Final = 1_000_000
"""A serial number is a prefix of two digits, which tells the unit, and six more (page 7)."""

_SOFTWARE_VERSION: Final = bytes((0, 0, 1, 0))  # minor, interim, major, unused: 1.0.0

# The document lists two types. The numbers of the vendor's own library (README of PyAPT,
# https://github.com/mcleu/PyAPT) have 44 for the BBD10x, as page 22 does, and are taken for the same list;
# the cards of BSC102 and BSC103 stand there as SCC001. Of other units nothing is known: they say 0.
_TYPES: Final = {
    "BSC001": 11, "BSC101": 12, "BSC002": 13, "BSC102": 21, "BSC103": 21, "ODC001": 24,
    "OST001": 25, "MST601": 26, "TST001": 29, "TDC001": 31,
}  # fmt: skip
_FAMILY_TYPES: Final = {
    "brushless_dc": HardwareType.BRUSHLESS_DC_CONTROLLER,
    "brushless_dc_single": HardwareType.BRUSHLESS_DC_CONTROLLER,
}

# What cards call themselves; the example of page 22 has the blank, too. Others say the name of their unit.
_CARD_MODELS: Final[dict[int, str]] = {HardwareType.BRUSHLESS_DC_CONTROLLER: "ION001 "}

_NO_PREFIX: Final = 99  # for units of which none is known; no unit has it
_LARGEST: Final = 2**31 - 1


def stand_alone(unit: Unit, options: Options) -> m.HwGetInfo:
    """Return what a unit with one address says of itself.

    Raises :class:`~stagewire_virtual.errors.BadOptionError` for a serial number that no unit can have.
    """
    number = _of_unit(unit, options)
    return _information(unit, unit.name, _type(unit), number, unit.facts["channels"])


def motherboard(unit: Unit, options: Options, bays: int) -> m.HwGetInfo:
    """Return what the motherboard of a rack says of itself; its channels are the bays that are used.

    Raises :class:`~stagewire_virtual.errors.BadOptionError` for a serial number that no unit can have.
    """
    type = HardwareType.MULTI_CHANNEL_MOTHERBOARD
    return _information(unit, unit.name, type, _of_unit(unit, options), bays)


def card(unit: Unit, options: Options, bay: int) -> m.HwGetInfo:
    """Return what the card or module in a bay says of itself; its serial number is its own."""
    prefix = _prefix(unit, "card_usb_prefix") or _prefix(unit) or _NO_PREFIX
    number = _random_number(prefix, f"{options.seed}/serial number of {unit.name} in bay {bay}")
    type = _type(unit)
    model = _CARD_MODELS.get(type, unit.name)
    return _information(unit, model, type, number, unit.facts["channels"])


def _information(unit: Unit, model: str, type: int, number: int, channels: int) -> m.HwGetInfo:
    return m.HwGetInfo(
        serial_number=number,
        model_number=model[:8],
        type=type,
        software_version=_SOFTWARE_VERSION,
        notes=f"Stagewire virtual {unit.name}"[:64],
        nchs=channels,
    )


def _type(unit: Unit) -> int:
    return _TYPES.get(unit.name, _FAMILY_TYPES.get(unit.facts.get("family", ""), 0))


def _of_unit(unit: Unit, options: Options) -> int:
    number = options.serial_number
    prefix = _prefix(unit) or _NO_PREFIX
    if number is None:
        return _random_number(prefix, f"{options.seed}/serial number of {unit.name}")
    if not 0 < number <= _LARGEST:
        raise BadOptionError(
            f"the serial number {number} does not fit; it has eight digits, such as {prefix * DIGITS + 1}"
        )
    return number


def _random_number(prefix: int, stream: str) -> int:
    return prefix * DIGITS + random.Random(stream).randrange(1, DIGITS)


def _prefix(unit: Unit, fact: str = "usb_prefix") -> int | None:
    """Return a prefix of the unit as printed, as known elsewhere, or that of its nearest relative.

    That is a unit of its family, or else one that is addressed in the same way and drives the same stages.
    """
    printed: int | None = unit.facts.get(fact)
    if printed is not None:
        return printed
    if fact == "usb_prefix":
        for prefix, known in unit.registry["known_prefixes"].items():
            if known["unit"] == unit.name:
                return int(prefix)
    for likeness in (("family",), ("address", "status", "stages")):
        relatives: list[int] = [
            other[fact]
            for other in unit.registry["units"]
            if fact in other and all(other.get(key) == unit.facts.get(key) for key in likeness)
        ]
        if relatives:
            return min(relatives)
    return None
