"""What a controller says of itself when it is asked for its hardware information (pages 21 and 22)."""

from __future__ import annotations

import random
from typing import Final

from stagewire_apt import messages as m
from stagewire_apt.enumerations import HardwareType
from stagewire_virtual.errors import BadOptionError
from stagewire_virtual.options import Options
from stagewire_virtual.units import Unit

__all__ = ["card", "motherboard", "stand_alone"]

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

_DIGITS: Final = 1_000_000  # of a serial number that follow the prefix of a unit (page 7)
_NO_PREFIX: Final = 99  # for units of which none is known; no unit has it
_LARGEST: Final = 2**31 - 1


def stand_alone(unit: Unit, options: Options) -> m.HwGetInfo:
    """Return what a unit with one address says of itself.

    Raises :class:`~stagewire_virtual.errors.BadOptionError` for a serial number that no unit can have.
    """
    return _information(unit, _type(unit), _of_unit(unit, options), unit.facts["channels"])


def motherboard(unit: Unit, options: Options, bays: int) -> m.HwGetInfo:
    """Return what the motherboard of a rack says of itself; its channels are the bays that are used.

    Raises :class:`~stagewire_virtual.errors.BadOptionError` for a serial number that no unit can have.
    """
    return _information(unit, HardwareType.MULTI_CHANNEL_MOTHERBOARD, _of_unit(unit, options), bays)


def card(unit: Unit, options: Options, bay: int) -> m.HwGetInfo:
    """Return what the card or module in a bay says of itself; its serial number is its own."""
    prefix = unit.facts.get("card_usb_prefix", _prefix(unit))
    serial_number = _random_number(
        prefix, f"{options.seed}/serial number of {unit.name} in bay {bay}"
    )
    return _information(unit, _type(unit), serial_number, unit.facts["channels"])


def _information(unit: Unit, type: int, serial_number: int, channels: int) -> m.HwGetInfo:
    return m.HwGetInfo(
        serial_number=serial_number,
        model_number=unit.name[:8],
        type=type,
        software_version=_SOFTWARE_VERSION,
        notes=f"Stagewire virtual {unit.name}"[:64],
        nchs=channels,
    )


def _type(unit: Unit) -> int:
    return _TYPES.get(unit.name, _FAMILY_TYPES.get(unit.facts.get("family", ""), 0))


def _of_unit(unit: Unit, options: Options) -> int:
    number = options.serial_number
    if number is None:
        return _random_number(_prefix(unit), f"{options.seed}/serial number of {unit.name}")
    if not 0 < number <= _LARGEST:
        raise BadOptionError(
            f"the serial number {number} does not fit; it has eight digits, such as "
            f"{_prefix(unit) * _DIGITS + 1}"
        )
    return number


def _random_number(prefix: int, stream: str) -> int:
    return prefix * _DIGITS + random.Random(stream).randrange(1, _DIGITS)


def _prefix(unit: Unit) -> int:
    """Return the unit's prefix as printed, as known elsewhere, or that of a sister of its family."""
    printed = unit.facts.get("usb_prefix")
    if printed is not None:
        return int(printed)
    for prefix, known in unit.registry["known_prefixes"].items():
        if known["unit"] == unit.name:
            return int(prefix)
    sisters = [
        sister["usb_prefix"]
        for sister in unit.registry["units"]
        if "usb_prefix" in sister and sister.get("family") == unit.facts.get("family")
    ]
    return min(sisters, default=_NO_PREFIX)
