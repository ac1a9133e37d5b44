"""Error messages: the message and field, what was expected, and what was found instead."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from stagewire import End, Frame, Framer, errors
from stagewire.errors import (
    BadLengthError,
    BadValueError,
    MissingFieldError,
    OutOfRangeError,
    StagewireError,
    TrailingBytesError,
    TruncatedError,
    UnknownFieldError,
    UnknownMessageError,
    UnknownProtocolError,
    UnknownScaleError,
    UnsupportedError,
)
from stagewire.protocols import load_protocol
from stagewire.quantities import Scale, UnknownScale, exact
from stagewire_apt import PROTOCOL, flags, stages
from stagewire_apt import messages as m
from undocumented import PROTOCOL as WITH_UNPRINTED
from undocumented import HwUnprinted

MOVE = m.MotMoveAbsolute(1, 5)
RAW = MOVE.pack(0x50, 1)
build: Callable[..., Any] = PROTOCOL.build
REFUSALS: list[tuple[Callable[[], object], type[StagewireError], str]] = [
    # Values
    (
        lambda: m.MotMoveAbsolute(65536, 5),
        OutOfRangeError,
        "MOT_MOVE_ABSOLUTE.chan_ident must be 0 to 65535 (raw counts), not 65536; see page 45 of Issue 3 "
        "and page 84 of Issue 37",
    ),
    (
        lambda: m.MotSetSolCycleParams(1, 99, 400, 0),
        OutOfRangeError,
        "MOT_SET_SOL_CYCLEPARAMS.on_time must be 100 to 40000000 (raw counts of ms), not 99; see page 87 of "
        "Issue 3 and page 189 of Issue 37",
    ),
    (
        lambda: m.MotMoveAbsolute(1, True),
        BadValueError,
        "MOT_MOVE_ABSOLUTE.absolute_distance must be an integer from -2147483648 to 2147483647,"
        " not True",
    ),
    (
        lambda: m.HwGetInfo(1, 2, 44, bytes(4), "", 1, 0, 1),
        BadValueError,
        "HW_GET_INFO.model_number must be text, not 2",
    ),
    (
        lambda: m.HwGetInfo(1, "ab€", 44, bytes(4), "", 1, 0, 1),
        BadValueError,
        "HW_GET_INFO.model_number must be Latin-1 text, which has no character '€'",
    ),
    (
        lambda: m.HwGetInfo(1, "123456789", 44, bytes(4), "", 1, 0, 1),
        OutOfRangeError,
        "HW_GET_INFO.model_number must have at most 8 characters, not 9; see page 53 of Issue 37",
    ),
    (
        lambda: m.HwGetInfo(1, "a\0", 44, bytes(4), "", 1, 0, 1),
        BadValueError,
        "HW_GET_INFO.model_number: omit trailing NULs, encoding adds them",
    ),
    (
        lambda: m.HwGetInfo(1, "a", 44, "abcd", "", 1, 0, 1),
        BadValueError,
        "HW_GET_INFO.software_version must be 4 bytes, not 'abcd'",
    ),
    (
        lambda: m.HwGetInfo(1, "a", 44, bytes(5), "", 1, 0, 1),
        OutOfRangeError,
        "HW_GET_INFO.software_version must be exactly 4 bytes, not 5; see page 53 of Issue 37",
    ),
    (
        lambda: m.MotMoveStoppedUndecided(bytes(13)),
        OutOfRangeError,
        "MOT_MOVE_STOPPED.data must be exactly 14 bytes, not 13",
    ),
    (
        lambda: HwUnprinted(),
        UnsupportedError,
        "HW_UNPRINTED has no documented layout; give the bytes of its data",
    ),
    (lambda: HwUnprinted("ab"), BadValueError, "HW_UNPRINTED.data must be bytes, not 'ab'"),
    (
        lambda: HwUnprinted(bytes(256)),
        OutOfRangeError,
        "HW_UNPRINTED.data must have at most 255 bytes, not 256",
    ),
    (
        lambda: HwUnprinted(b"ab", param2=1),
        BadValueError,
        "HW_UNPRINTED carries data or parameters, not both",
    ),
    (
        lambda: HwUnprinted(param1=256),
        OutOfRangeError,
        "HW_UNPRINTED.param1 must be 0 to 255 (raw counts), not 256",
    ),
    (
        lambda: HwUnprinted(param2="1"),
        BadValueError,
        "HW_UNPRINTED.param2 must be an integer from 0 to 255, not '1'",
    ),
    (
        lambda: MOVE.replace(speed=1),
        UnknownFieldError,
        "MOT_MOVE_ABSOLUTE has no field speed: chan_ident, absolute_distance",
    ),
    (
        lambda: flags.RackDigitalOutputs.of(nothing=True),
        UnknownFieldError,
        "RackDigitalOutputs has no bit nothing (it has: digital_output_1, digital_output_2, "
        "digital_output_3, digital_output_4)",
    ),
    # Frames
    (lambda: MOVE.pack(128, 1), OutOfRangeError, "dest must be an address from 0 to 0x7f, not 128"),
    (
        lambda: MOVE.pack(1, 256),
        OutOfRangeError,
        "source must be an address from 0 to 0xff, not 256",
    ),
    (lambda: MOVE.pack("1", 1), BadValueError, "dest must be an address from 0 to 0x7f, not '1'"),
    (
        lambda: MOVE.pack(1, False),
        BadValueError,
        "source must be an address from 0 to 0xff, not False",
    ),
    (
        lambda: HwUnprinted(b"").pack(1, -1),
        OutOfRangeError,
        "source must be an address from 0 to 0xff, not -1",
    ),
    (
        lambda: m.MotMoveStoppedUndecided(bytes(14)).pack(-1, 1),
        OutOfRangeError,
        "dest must be an address from 0 to 0x7f, not -1",
    ),
    (lambda: Frame("move", 1, 1), BadValueError, "a frame carries a message, not 'move'"),
    (lambda: Frame(MOVE, 1, 1, "ab"), BadValueError, "extra must be bytes, not 'ab'"),
    (
        lambda: Frame(m.ModIdentify(), 1, 1, b"a"),
        BadValueError,
        "MOD_IDENTIFY has no packet to add extra bytes to",
    ),
    (
        lambda: Frame(MOVE, 1, 1, bytes(250)).encode(),
        OutOfRangeError,
        "a packet has at most 255 bytes, not 256",
    ),
    # Bytes
    (lambda: m.decode(b"\x53\x04"), TruncatedError, "a frame has at least 6 bytes, not 2"),
    (
        lambda: m.decode(bytes.fromhex("777700000150")),
        UnknownMessageError,
        "bytes 0 and 1: no message of Thorlabs APT host-controller communications protocol "
        "has the id 0x7777",
    ),
    (
        lambda: m.decode(bytes.fromhex("5304060081500102")),
        TruncatedError,
        "MOT_MOVE_ABSOLUTE: bytes 2 and 3 declare a packet of 6 bytes, but 2 follow the header; "
        "the frame ends before byte 8",
    ),
    (
        lambda: m.decode(bytes.fromhex("53040100815001020304")),
        TrailingBytesError,
        "MOT_MOVE_ABSOLUTE: bytes 2 and 3 declare a packet of 1 bytes, but 4 follow the header; "
        "it ends before byte 7",
    ),
    (
        lambda: m.decode(bytes.fromhex("53040001d050") + bytes(256)),
        BadLengthError,
        "MOT_MOVE_ABSOLUTE: bytes 2 and 3 declare a packet of 256 bytes; no packet has more "
        "than 255",
    ),
    (
        lambda: m.decode(bytes.fromhex("530402008150 0102")),
        BadLengthError,
        "MOT_MOVE_ABSOLUTE: bytes 2 and 3 declare a packet of 2 bytes, but a packet has 6 bytes",
    ),
    (
        lambda: m.decode(bytes.fromhex("230202008150 0102")),
        BadLengthError,
        "MOD_IDENTIFY: bytes 2 and 3 declare a packet of 2 bytes, but the message has no packet",
    ),
    (
        lambda: m.decode(bytes.fromhex("430401005001 0102")),
        TrailingBytesError,
        "MOT_MOVE_HOME: byte 4 (0x50) announces no data packet, so the frame ends after 6 "
        "bytes, but 2 more follow from byte 6",
    ),
    (
        lambda: m.decode(bytes.fromhex("910400000150")),
        BadLengthError,
        "MOT_GET_DCSTATUSUPDATE: byte 4 (0x01) announces no data packet, but the message has "
        "no header-only form (packet of 14 bytes)",
    ),
    (
        lambda: m.decode("5304"),
        BadValueError,
        "decode takes bytes, not str; use bytes.fromhex to convert hex text",
    ),
    (lambda: m.decode([1, 2]), BadValueError, "decode takes bytes, not list"),
    # Names
    (
        lambda: build("MOT_MOVE_ABSOLUT", {}),
        UnknownMessageError,
        "Thorlabs APT host-controller communications protocol has no message "
        "MOT_MOVE_ABSOLUT; did you mean MOT_MOVE_ABSOLUTE or PZMOT_MOVE_ABSOLUTE or MOT_MOVE_RASTER?",
    ),
    (
        lambda: build("NONSENSE", {}),
        UnknownMessageError,
        "Thorlabs APT host-controller communications protocol has no message NONSENSE",
    ),
    (
        lambda: build("MOT_MOVE_ABSOLUTE", {}),
        BadLengthError,
        "MOT_MOVE_ABSOLUTE has several forms; choose one of header, data",
    ),
    (
        lambda: build("MOT_MOVE_STOPPED", {}),
        BadLengthError,
        "MOT_MOVE_STOPPED has several forms; choose one of header, data:dc, data:stepper",
    ),
    (
        lambda: build("MOT_MOVE_ABSOLUTE", {}, "data:dc"),
        BadLengthError,
        "MOT_MOVE_ABSOLUTE has no form data:dc (it has header, data)",
    ),
    (
        lambda: build("MOT_MOVE_ABSOLUTE", {"chan_ident": 1}, "data"),
        MissingFieldError,
        "MOT_MOVE_ABSOLUTE (data) lacks absolute_distance",
    ),
    (
        lambda: build("MOT_MOVE_ABSOLUTE", {"speed": 1}, "data"),
        UnknownFieldError,
        "MOT_MOVE_ABSOLUTE (data) has no field speed: chan_ident, absolute_distance",
    ),
    (
        lambda: build("MOD_IDENTIFY", {}, data=b"a"),
        BadValueError,
        "MOD_IDENTIFY (header) takes fields, not data",
    ),
    (
        lambda: build("MOT_MOVE_STOPPED", {}, "data:undecided"),
        MissingFieldError,
        "MOT_MOVE_STOPPED (data:undecided) requires data=…, its whole packet",
    ),
    (
        lambda: build("MOT_SET_MOVEVELPARAMS", {}),
        UnsupportedError,
        "MOT_SET_MOVEVELPARAMS cannot be used: the document gives it no id",
    ),
    (
        lambda: load_protocol("nonsense"),
        UnknownProtocolError,
        "no protocol nonsense is installed (installed: asi_ms2000, thorlabs_apt)",
    ),
    # Streams
    (
        lambda: PROTOCOL.framer("host"),
        BadValueError,
        "the end of a line must be one of End.HOST, End.DEVICE, End.NONE, not 'host'",
    ),
    (
        lambda: PROTOCOL.framer().tell(256),
        BadValueError,
        "source must be an address from 0 to 0xff, not 256",
    ),
    (lambda: PROTOCOL.framer().feed("ab"), BadValueError, "a framer takes bytes, not str"),
    (
        lambda: Framer(PROTOCOL.framing, End.NONE).feed(RAW)[0].frame,
        UnsupportedError,
        "this event's framer has no protocol; use Protocol.framer",
    ),
    # Scales
    (lambda: exact(True), BadValueError, "True is not a number"),
    (lambda: exact(float("nan")), BadValueError, "nan is not a finite number"),
    (lambda: exact("five"), BadValueError, "'five' is not a number"),
    (lambda: Scale.counts_per("mm", 0), BadValueError, "a scale must be positive, not 0"),
    (
        lambda: UnknownScale("mm", "no page says so").to_counts(1),
        UnknownScaleError,
        "the scale in mm is unknown: no page says so; use raw counts",
    ),
    (
        lambda: stages.Z8.scale("jerk", "TDC001"),
        UnknownScaleError,
        "the scale of jerk of Z8 on TDC001 is unknown (known: acceleration, encoder_position, position, "
        "pot_velocity, velocity)",
    ),
    (
        lambda: stages.MLS203.scale("position", "TDC001"),
        UnknownScaleError,
        "the scales of MLS203 on TDC001 are unknown (known on: BBD10x, BBD30x, KBD101)",
    ),
]


@pytest.mark.parametrize(("call", "kind", "text"), REFUSALS)
def test_error_messages(call: Callable[[], object], kind: type[StagewireError], text: str) -> None:
    with pytest.raises(kind) as caught:
        call()
    assert type(caught.value) is kind
    assert str(caught.value) == text


@pytest.mark.parametrize(
    ("message", "form"), [("HW_UNPRINTED", None), ("MOT_MOVE_STOPPED", "data:undecided")]
)
def test_data_is_an_argument_not_a_field(message: str, form: str | None) -> None:
    data = bytes(14)
    with pytest.raises(UnknownFieldError, match=f"{message} .*: data is the packet, not a field"):
        WITH_UNPRINTED.build(message, {"data": data}, form, data)
    built: Any = WITH_UNPRINTED.build(message, {}, form, data)
    assert built.data == data


def test_codes() -> None:
    """Errors have the codes of the testee protocol."""
    codes = {
        errors.CodecError: "bad_value",
        errors.DecodeError: "bad_value",
        errors.TruncatedError: "truncated",
        errors.TrailingBytesError: "trailing",
        errors.BadLengthError: "bad_length",
        errors.UnknownMessageError: "unknown_message",
        errors.EncodeError: "bad_value",
        errors.UnknownFieldError: "unknown_field",
        errors.MissingFieldError: "missing_field",
        errors.OutOfRangeError: "out_of_range",
        errors.BadValueError: "bad_value",
        errors.UnsupportedError: "unsupported",
    }
    assert {kind: kind.code for kind in codes} == codes
