"""The hardware information of controllers in HW_GET_INFO (pages 21 and 22)."""

from __future__ import annotations

import random
from collections.abc import Mapping
from typing import Any, Final, NamedTuple

from stagewire import Stage
from stagewire.quantities import find_stages
from stagewire_apt import messages as m
from stagewire_apt.enumerations import HardwareType
from stagewire_virtual.errors import BadOptionError
from stagewire_virtual.instrument import Unit
from stagewire_virtual.options import Options

DIGITS: Final = 1_000_000
"""A serial number has a prefix of two digits, which identifies the unit, and six more digits (page 7)."""


class _Versions(NamedTuple):
    """The versions that a unit reports.

    :param firmware: major, interim and minor version of the firmware.
    :param hardware: version of the hardware.
    """

    firmware: tuple[int, int, int] = (1, 0, 0)
    hardware: int = 0


_VERSIONS: Final[Mapping[str, _Versions]] = {
    "KDC101": _Versions((2, 2, 10), 3),
    "KST201": _Versions((2, 0, 8), 4),
    "LTS150": _Versions((3, 0, 11), 3),
    "LTS300": _Versions((3, 0, 11), 3),
    "BSC201": _Versions((3, 1, 5)),
}
"""The versions of units on which clients depend; other units are of version 1.0.0.

Since hardware version 3 an LTS has 2048 microsteps, and the vendor's XA software opens no older one. The
BSC201 is that of github MSLNZ/msl-equipment, motion.py at 51b9be3; the others are those of the simulated
controllers in thorlabs_xa 1.9.1.28993 (get_hardware_info).
"""

# The model of the card in the example of page 22. The registry lists it for the units whose cards report it.
# Other cards report the name of their unit.
_CARD: Final = "ION001"
_CARD_MODEL: Final = "ION001 "  # the example also has the space

_NO_PREFIX: Final = 99
"""The prefix of units without a known one, or the next lower one that the registry knows for no unit."""

_NO_SERIAL_NUMBER: Final = 0  # always replaced before the message is sent
_LARGEST: Final = 2**31 - 1
_WORD: Final = 0xFFFF
_MODEL: Final = 8
"""The number of characters of the model (page 22)."""

_STAGE_ID_FIELD: Final = "HW_GET_INFO.stage_id"
_ACTUATOR_FIELD: Final = "HW_GET_INFO.mod_state"
_STAGE_ID: Final = 6 + 76
"""The offset of the stage id in the frame.

Later issues shorten the notes to 48 bytes, followed by 12 bytes "for internal use only" (Issue 37, page 52).
The vendor's XA software reads the last two of these, bytes 76 and 77 of the payload, as the id of the stage,
and does not open a controller in which they are 0. In Issue 3 the notes include them.
"""


_ACTUATORS: Final[Mapping[str, bytes]] = {"KPC101": b"PAZ009"}
"""The part number of the actuator that a unit reports in the bytes "for internal use only", from byte 66.

The simulated KPC101 of thorlabs_xa 1.9.1.28993 reports it, and the vendor's software opens no KPC101 without
it.
"""
_INTERNAL: Final = "internal_use"


def stand_alone(unit: Unit, options: Options, stage: Stage | None) -> m.HwGetInfo:
    """Return the information of a unit with one address, and with a stage that it may report.

    Raises :class:`~stagewire_virtual.errors.BadOptionError` for an option that does not fit into the message.
    """
    information = _information(unit, _type(unit), unit.facts["channels"])
    number = reported_id(unit, stage, _STAGE_ID_FIELD)
    actuator = reported_id(unit, stage, _ACTUATOR_FIELD)
    if actuator:
        information = information.replace(mod_state=actuator)
    if unit.name in _ACTUATORS and _INTERNAL in m.HwGetInfo.layout.fields:
        information = information.replace(internal_use=_ACTUATORS[unit.name].ljust(10, b"\0"))
    return _with_options(information, unit, options, number)


def reported_id(unit: Unit, stage: Stage | None, field: str) -> int:
    """Return the number of a stage in a field in which a unit reports it; 0 if the registry has none.

    The variants with the suffixes B and V have other mountings and the number of the stage without a suffix.
    """
    if stage is None or unit.family.get("reports_stage", {}).get("field") != field:
        return 0
    alike = find_stages(unit.protocol.package, stage.name.rstrip("BV"))
    return next((each.ids[field] for each in (stage, *alike) if field in each.ids), 0)


def motherboard(unit: Unit, options: Options, bays: int) -> m.HwGetInfo:
    """Return the information of the motherboard of a rack; its number of channels is that of the used bays.

    Raises the same errors as :func:`stand_alone`.
    """
    type = HardwareType.MULTI_CHANNEL_MOTHERBOARD
    return _with_options(_information(unit, type, bays), unit, options)


def card(unit: Unit, options: Options, bay: int) -> m.HwGetInfo:
    """Return the information of the card or module in a bay, which depends on no option except the seed."""
    prefix = _prefix(unit, "card_usb_prefix") or _prefix(unit) or _free_prefix(unit)
    return _information(unit, _type(unit), unit.facts["channels"]).replace(
        model_number=_CARD_MODEL if _reports_card(unit) else unit.name[:_MODEL],
        serial_number=_random_number(
            prefix, f"{options.seed}/serial number of {unit.name} in bay {bay}"
        ),
    )


def _information(unit: Unit, type: int, channels: int) -> m.HwGetInfo:
    """Return the information without a serial number; fields that only some overlays have are 0."""
    layout = m.HwGetInfo.layout
    values: dict[str, Any] = dict.fromkeys(set(layout.fields) - set(layout.optional), 0)
    versions = _VERSIONS.get(unit.name, _Versions())
    if "hw_version" in values:
        values["hw_version"] = versions.hardware
    values.update(
        serial_number=_NO_SERIAL_NUMBER,
        model_number=unit.name[:_MODEL],
        type=type,
        software_version=bytes((*reversed(versions.firmware), 0)),
        notes=f"Stagewire virtual {unit.name}",
        nchs=channels,
    )
    return m.HwGetInfo(**values)


def _with_options(
    information: m.HwGetInfo, unit: Unit, options: Options, number: int = 0
) -> m.HwGetInfo:
    """Return the information with the values of the options; ``number`` is the default of the stage id."""
    model = information.model_number if options.model is None else options.model
    if not (0 < len(model) <= _MODEL and model.isascii() and model.isprintable()):
        raise BadOptionError(
            f"model must have 1 to {_MODEL} printable ASCII characters, such as {unit.name[:_MODEL]!r}, "
            f"not {model!r}"
        )
    type = information.type if options.hardware_type is None else options.hardware_type
    stage_id = number if options.stage_id is None else options.stage_id
    for name, value in (("hardware type", type), ("stage id", stage_id)):
        if not 0 <= value <= _WORD:
            raise BadOptionError(f"{name} must be from 0 to {_WORD}, not {value}")
    chosen = information.replace(
        model_number=model, serial_number=_serial_number(unit, options), type=type
    )
    raw = chosen.pack(0, 0)
    stage = stage_id.to_bytes(2, "little")
    return m.HwGetInfo.unpack(raw[:_STAGE_ID] + stage + raw[_STAGE_ID + len(stage) :])


def _reports_card(unit: Unit) -> bool:
    return _CARD in unit.facts.get("reported_as", ())


def _type(unit: Unit) -> int:
    """Return the type of a unit or of its cards; 0 if the registry does not know it."""
    value: int = unit.facts.get("hardware_type", {"value": 0})["value"]
    return value


def _serial_number(unit: Unit, options: Options) -> int:
    number = options.serial_number
    prefix = _prefix(unit) or _free_prefix(unit)
    if number is None:
        return _random_number(prefix, f"{options.seed}/serial number of {unit.name}")
    if not 0 < number <= _LARGEST:
        raise BadOptionError(
            f"serial number must be from 1 to {_LARGEST}, usually with eight digits such as "
            f"{prefix * DIGITS + 1}, not {number}"
        )
    return number


def _random_number(prefix: int, stream: str) -> int:
    return prefix * DIGITS + random.Random(stream).randrange(1, DIGITS)


def _free_prefix(unit: Unit) -> int:
    registry = unit.registry
    known = {entry.get(f) for entry in registry["units"] for f in ("usb_prefix", "card_usb_prefix")}
    known |= {int(prefix) for prefix in registry["known_prefixes"]}
    for entry in registry.get("unsupported", {}).values():
        known |= {*entry.get("prefixes", ())}
    return next(number for number in range(_NO_PREFIX, 0, -1) if number not in known)


def _prefix(unit: Unit, fact: str = "usb_prefix") -> int | None:
    """Return the printed prefix of the unit, or one known from elsewhere, or that of its nearest relative.

    The nearest relative is a unit of the same family, or else one with the same address, status and stages.
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
