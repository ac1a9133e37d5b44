"""What a controller says of itself when it is asked for its hardware information (pages 21 and 22)."""

from __future__ import annotations

import random
from typing import Final

from stagewire_apt import messages as m
from stagewire_apt.enumerations import HardwareType
from stagewire_virtual.errors import BadOptionError
from stagewire_virtual.instrument import Unit
from stagewire_virtual.options import Options

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
_NO_SERIAL_NUMBER: Final = 0  # replaced in everything that is sent
_LARGEST: Final = 2**31 - 1
_WORD: Final = 0xFFFF
_MODEL: Final = 8
"""Characters of the model (page 22)."""

_STAGE_ID: Final = 76 - 18
"""Where a stage id begins in the notes.

Later issues shorten the notes to 48 bytes, followed by 12 bytes "for internal use only" (Issue 37, page 52).
The vendor's XA software takes the last two of these, bytes 76 and 77 of the payload, for the id of the
stage, and opens no controller in which they are 0. The notes of Issue 3, from byte 18 on, include them.
"""


def stand_alone(unit: Unit, options: Options) -> m.HwGetInfo:
    """Return what a unit with one address says of itself.

    Raises :class:`~stagewire_virtual.errors.BadOptionError` for an option that does not fit into the message.
    """
    return _with_options(_information(unit, _type(unit), unit.facts["channels"]), unit, options)


def motherboard(unit: Unit, options: Options, bays: int) -> m.HwGetInfo:
    """Return what the motherboard of a rack says of itself; its channels are the bays that are used.

    Raises as :func:`stand_alone` does.
    """
    type = HardwareType.MULTI_CHANNEL_MOTHERBOARD
    return _with_options(_information(unit, type, bays), unit, options)


def card(unit: Unit, options: Options, bay: int) -> m.HwGetInfo:
    """Return what the card or module in a bay says of itself; no option but the seed changes that."""
    prefix = _prefix(unit, "card_usb_prefix") or _prefix(unit) or _NO_PREFIX
    type = _type(unit)
    return _information(unit, type, unit.facts["channels"]).replace(
        model_number=_CARD_MODELS.get(type, unit.name[:_MODEL]),
        serial_number=_random_number(
            prefix, f"{options.seed}/serial number of {unit.name} in bay {bay}"
        ),
    )


def _information(unit: Unit, type: int, channels: int) -> m.HwGetInfo:
    return m.HwGetInfo(
        serial_number=_NO_SERIAL_NUMBER,
        model_number=unit.name[:_MODEL],
        type=type,
        software_version=_SOFTWARE_VERSION,
        notes=f"Stagewire virtual {unit.name}",
        nchs=channels,
    )


def _with_options(information: m.HwGetInfo, unit: Unit, options: Options) -> m.HwGetInfo:
    """Return the information with what the options say of the unit."""
    model = information.model_number if options.model is None else options.model
    if not (0 < len(model) <= _MODEL and model.isascii() and model.isprintable()):
        raise BadOptionError(
            f"model {model!r} does not fit: a model has 1 to {_MODEL} printable ASCII characters, such as "
            f"{unit.name[:_MODEL]!r}"
        )
    type = information.type if options.hardware_type is None else options.hardware_type
    stage_id = options.stage_id or 0
    for name, value in (("hardware type", type), ("stage id", stage_id)):
        if not 0 <= value <= _WORD:
            raise BadOptionError(
                f"the {name} {value} does not fit: it is a number from 0 to {_WORD}"
            )
    stage = stage_id.to_bytes(2, "little").decode("latin-1")
    return information.replace(
        model_number=model,
        serial_number=_serial_number(unit, options),
        type=type,
        notes=(information.notes.ljust(_STAGE_ID, "\0") + stage).rstrip("\0"),
    )


def _type(unit: Unit) -> int:
    return _TYPES.get(unit.name, _FAMILY_TYPES.get(unit.facts.get("family", ""), 0))


def _serial_number(unit: Unit, options: Options) -> int:
    number = options.serial_number
    prefix = _prefix(unit) or _NO_PREFIX
    if number is None:
        return _random_number(prefix, f"{options.seed}/serial number of {unit.name}")
    if not 0 < number <= _LARGEST:
        raise BadOptionError(
            f"the serial number {number} does not fit: it is a number from 1 to {_LARGEST}, usually of "
            f"eight digits, such as {prefix * DIGITS + 1}"
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
            if unit.name in (known["unit"], *known.get("shared_with", ())):
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
