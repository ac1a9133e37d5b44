"""Deviations of real controllers from the document, by name; off by default.

Most quirks change frames on their way out, so that behaviours and controllers do not depend on them. Two
concern the motion of a stage and are properties of the channel: :data:`CLOCKWISE_IS_NEGATIVE` and
:data:`ZERO_MOTION_PARAMETERS`. All are facts from public drivers, captures and later issues of the document.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping
from typing import Any, Final

from stagewire import Frame
from stagewire_apt import messages as m
from stagewire_virtual.instrument import Unit
from stagewire_virtual.thorlabs_apt.identity import DIGITS

CLOCKWISE_IS_NEGATIVE: Final = "clockwise_is_negative"
"""The quirk of motors whose position falls clockwise; :class:`.Channel` lists its effects."""

ZERO_MOTION_PARAMETERS: Final = "zero_motion_parameters"
"""The quirk of controllers that power on with unusable parameters, as users report of the K10CR1."""

_MOTION_PARAMETERS: Final[Mapping[str, tuple[str, ...]]] = {
    "MOT_VELPARAMS": ("acceleration", "max_velocity"),
    "MOT_JOGPARAMS": ("jog_step_size", "jog_acceleration", "jog_max_velocity"),
    "MOT_HOMEPARAMS": ("home_velocity",),
}


def without_motion(
    parameters: Mapping[str, Mapping[str, Any]],
) -> Mapping[str, Mapping[str, Any]]:
    """Return the parameters of a new controller with velocities, accelerations and steps of 0."""
    return {
        name: {**values, **dict.fromkeys(_MOTION_PARAMETERS.get(name, ()), 0)}
        for name, values in parameters.items()
    }


Quirk = Callable[[Frame, Unit], Frame]
"""Converts a frame according to the document to the frame that the unit sends."""

_FAULT_CODE: Final = 1
_FAULT_LENGTH: Final = 68
_PACKET: Final = 0x80  # the bit of the destination that announces a packet
_FAULT_TEXT: Final = b"Command refused"


def _header_only_completion(frame: Frame, unit: Unit) -> Frame:
    """Send completions without a status: six bytes instead of twenty."""
    match frame.message:
        case m.MotMoveCompletedDc() | m.MotMoveCompletedStepper() as completed:
            header: m.MotMoveCompletedHeader | m.MotMoveStoppedHeader = m.MotMoveCompletedHeader(
                completed.chan_ident
            )
        case m.MotMoveStoppedDc() | m.MotMoveStoppedStepper() as stopped:
            header = m.MotMoveStoppedHeader(stopped.chan_ident)
        case _:
            return frame
    return Frame(header, frame.dest, frame.source)


def _long_status(frame: Frame, unit: Unit) -> Frame:
    """Send a motor status of 28 bytes, with a second channel ident and three reserved words."""
    match frame.message:
        case m.MotGetStatusUpdate(chan_ident) | m.MotGetDcStatusUpdate(chan_ident):
            extra = chan_ident.to_bytes(2, "little") + bytes(12)
            return Frame(frame.message, frame.dest, frame.source, extra)
    return frame


def _serial_number_of_another_model(frame: Frame, unit: Unit) -> Frame:
    """Begin the serial number with the prefix of another unit, the next one in the registry."""
    if not isinstance(frame.message, m.HwGetInfo):
        return frame
    own, rest = divmod(frame.message.serial_number, DIGITS)
    others = [prefix for prefix in _prefixes(unit.registry["units"]) if prefix != own]
    other = min(others, key=lambda prefix: (prefix < own, prefix))
    message = frame.message.replace(serial_number=other * DIGITS + rest)
    return Frame(message, frame.dest, frame.source)


def _fault_codes_in_response(frame: Frame, unit: Unit) -> Frame:
    """Put a fault code into the parameter bytes of HW_RESPONSE, which are zero on page 19."""
    if not isinstance(frame.message, m.HwResponse):
        return frame
    return Frame(m.HwResponse(param1=_FAULT_CODE), frame.dest, frame.source)


def _rich_responses(frame: Frame, unit: Unit) -> Frame:
    """Send HW_RICHRESPONSE, with a code and a text, instead of HW_RESPONSE."""
    if not isinstance(frame.message, m.HwResponse):
        return frame
    layout = m.HwRichResponse.layout
    header = struct.pack("<HHBx", layout.id, _FAULT_LENGTH, _PACKET)
    data = struct.pack("<HH64s", 0, _FAULT_CODE, _FAULT_TEXT)
    return Frame(m.HwRichResponse.unpack(header + data), frame.dest, frame.source)


def _unswapped_addresses(frame: Frame, unit: Unit) -> Frame:
    """Reply with the addresses of the request in their original order."""
    return Frame(frame.message, frame.source, frame.dest, frame.extra)


def _zero_addresses(frame: Frame, unit: Unit) -> Frame:
    """Send zeros instead of addresses."""
    return Frame(frame.message, 0, 0, frame.extra)


def _prefixes(units: list[Mapping[str, int]]) -> list[int]:
    return sorted({unit["usb_prefix"] for unit in units if "usb_prefix" in unit})


FRAME_QUIRKS: Final[Mapping[str, Quirk]] = {
    "header_only_completion": _header_only_completion,  # steppers; captures of both forms exist
    "long_status": _long_status,  # controllers of later issues of the document
    "serial_number_of_another_model": _serial_number_of_another_model,  # cards, repaired units
    "fault_codes_in_response": _fault_codes_in_response,
    "rich_responses": _rich_responses,  # layout of later issues of the document
    "unswapped_addresses": _unswapped_addresses,
    "zero_addresses": _zero_addresses,
}
"""Quirks that change frames, by name, in the order in which they are applied."""

QUIRKS: Final[Mapping[str, str]] = {
    **{name: (quirk.__doc__ or "").partition("\n")[0] for name, quirk in FRAME_QUIRKS.items()},
    CLOCKWISE_IS_NEGATIVE: "Move to lower positions in direction 1, forward (CW), and report that direction.",
    ZERO_MOTION_PARAMETERS: "Power on with velocities, accelerations and jog steps of 0.",
}
"""The effect of each quirk, in a sentence, by name."""
