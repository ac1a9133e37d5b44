"""Messages and frames as values: immutable, equal only to their own class, hashable, picklable."""

from __future__ import annotations

import copy
import inspect
import pickle
from collections.abc import Callable

import pytest

from stagewire import End, Frame
from stagewire.errors import (
    BadLengthError,
    BadValueError,
    OutOfRangeError,
    TrailingBytesError,
    TruncatedError,
    UnknownFieldError,
    UnsupportedError,
)
from stagewire.framing import Received
from stagewire.protocols import Direction, FramedProtocol, Layout, Message, UndecidedMessage
from stagewire_apt import PROTOCOL, enumerations, flags
from stagewire_apt import messages as m
from undocumented import PROTOCOL as WITH_UNPRINTED
from undocumented import HwUnprinted

MOVE = bytes.fromhex("5304 0600 d001 0100 400d0300")


def test_the_example_of_the_architecture_page_decodes() -> None:
    frame = m.decode(MOVE)
    assert frame == Frame(m.MotMoveAbsolute(chan_ident=1, absolute_distance=200_000), 0x50, 0x01)
    assert frame.encode() == MOVE
    assert repr(frame) == (
        "Frame(MotMoveAbsolute(chan_ident=1, absolute_distance=200000), dest=0x50, source=0x01)"
    )


@pytest.mark.parametrize(
    "buffer",
    [
        bytearray,
        memoryview,
        lambda raw: memoryview(bytearray(raw)),
        lambda raw: memoryview(raw).cast("H"),
        type("Own", (bytes,), {}),
    ],
)
@pytest.mark.parametrize("before", [False, True])
def test_any_buffer_decodes_with_a_new_or_a_known_header(
    buffer: Callable[[bytes], bytes], before: bool
) -> None:
    protocol = FramedProtocol("own", "Own", "own", [m.MotMoveAbsolute], 1, frozenset({0x50}), {})
    if before:
        protocol.decode(MOVE)
    assert protocol.decode(buffer(MOVE)) == m.decode(MOVE)
    with pytest.raises(TrailingBytesError):
        protocol.decode(buffer(MOVE + bytes(2)))


def test_a_message_cannot_be_changed() -> None:
    message = m.MotMoveAbsolute(1, 5)
    with pytest.raises(AttributeError, match="immutable"):
        message.chan_ident = 2
    with pytest.raises(AttributeError, match="immutable"):
        del message.chan_ident
    with pytest.raises(AttributeError, match="immutable"):
        message.other = 2  # type: ignore[attr-defined]
    decoded = m.decode(MOVE)
    with pytest.raises(AttributeError, match="immutable"):
        decoded.dest = 1
    with pytest.raises(AttributeError, match="immutable"):
        decoded.message.absolute_distance = 1  # type: ignore[attr-defined]
    assert message.replace(absolute_distance=6) == m.MotMoveAbsolute(1, 6)
    assert not hasattr(message, "__dict__")


class _Own(m.MotMoveAbsolute):
    """A user's subclass of a generated class."""

    layout = m.MotMoveAbsolute.layout

    def doubled(self) -> _Own:
        return self.replace(absolute_distance=2 * self.absolute_distance)


class _OwnStopped(m.MotMoveStoppedUndecided):
    __slots__ = ()


def test_a_subclass_of_a_message_is_a_message() -> None:
    own = _Own(1, 100_000).doubled()
    assert type(own) is _Own
    assert own.pack(0x50, 0x01) == MOVE
    assert own != m.MotMoveAbsolute(1, 200_000)
    with pytest.raises(AttributeError, match="immutable"):
        own.absolute_distance = 1
    assert type(_Own.unpack(MOVE)) is _Own
    assert type(_OwnStopped(bytes(14))) is _OwnStopped
    assert type(m.MotMoveAbsolute(1, 2)) is m.MotMoveAbsolute


def test_messages_are_equal_only_to_their_own_class() -> None:
    assert m.MotSetPosCounter(1, 5) == m.MotSetPosCounter(1, 5)
    assert m.MotSetPosCounter(1, 5) != m.MotGetPosCounter(1, 5)
    assert m.MotSetPosCounter(1, 5) != (1, 5)
    both = {m.MotSetPosCounter(1, 5), m.MotGetPosCounter(1, 5), m.MotSetPosCounter(1, 5)}
    assert len(both) == 2


@pytest.mark.parametrize(
    "copied", [copy.copy, copy.deepcopy, lambda x: pickle.loads(pickle.dumps(x))]
)
def test_copies_and_pickles_are_equal(copied) -> None:  # type: ignore[no-untyped-def]
    out_of_range = bytes.fromhex("a0041400d001 0100 ffffffff 00000000 00000000 00000000 0f00")
    for raw in (MOVE, out_of_range, bytes.fromhex("f100 0200 81 50 abcd")):
        frame = WITH_UNPRINTED.decode(raw)
        assert copied(frame) == frame
        assert copied(frame).encode() == raw
        assert hash(copied(frame)) == hash(frame)


def test_matching() -> None:
    match m.decode(MOVE):
        case Frame(m.MotMoveAbsolute(1, distance), dest=0x50):
            assert distance == 200_000
        case _:
            pytest.fail("no match")


def test_values_out_of_range_are_kept_when_decoded_but_refused_when_set() -> None:
    raw = bytes.fromhex("a0041400d001 0100 ffffffff 00000000 00000000 00000000 0f00")
    message = m.decode(raw).message
    assert isinstance(message, m.MotSetDcPidParams)
    assert message.proportional == -1
    with pytest.raises(
        OutOfRangeError, match=r"MOT_SET_DCPIDPARAMS\.proportional must be 0 to 32767"
    ):
        message.replace(integral=1)


def test_wrong_types_are_refused() -> None:
    for wrong in ("1", 1.0, None, True, b"1"):
        with pytest.raises(BadValueError, match=r"MOT_MOVE_ABSOLUTE\.chan_ident"):
            m.MotMoveAbsolute(wrong, 5)  # type: ignore[arg-type]
    with pytest.raises(BadValueError, match=r"€"):
        m.HwGetInfo(1, "€", 44, bytes(4), "", 1, 0, 1)
    with pytest.raises(BadValueError, match=r"HW_GET_INFO\.model_number: omit trailing NULs"):
        m.HwGetInfo(1, "TDC001\0", 44, bytes(4), "", 1, 0, 1)


@pytest.mark.parametrize(("dest", "source"), [(-1, 1), (0x80, 1), (1, 256), ("1", 1), (1, None)])
def test_addresses_are_checked(dest: object, source: object) -> None:
    with pytest.raises((OutOfRangeError, BadValueError), match="address"):
        Frame(m.ModIdentify(), dest, source).encode()  # type: ignore[arg-type]


def test_enumerations_are_accepted_and_unknown_values_kept() -> None:
    message = m.MotMoveJog(1, enumerations.MoveDirection.FORWARD)
    assert type(message.direction) is int
    assert m.MotMoveJog(1, 77).direction == 77
    assert enumerations.MoveDirection.of(1) is enumerations.MoveDirection.FORWARD
    assert enumerations.MoveDirection.of(77) == 77


def test_flags_name_their_bits_and_keep_the_others() -> None:
    status = flags.DcStatusBits(0x80000430)
    assert status.homed
    assert not status.settled
    assert status.names == ("moving_forward", "moving_reverse", "homed", "channel_enabled")
    outputs = flags.RackDigitalOutputs(0x103)
    assert outputs.names == ("digital_output_1", "digital_output_2")
    assert outputs.unnamed == 0x100
    assert flags.DcStatusBits.homed == 0x400
    assert flags.DcStatusBits.of(homed=True, settled=False) == 0x400
    with pytest.raises(UnknownFieldError, match="no bit nothing"):
        flags.DcStatusBits.of(nothing=True)
    raw = bytes.fromhex("91040e00 8150 0100 00000000 0000 0000 00040000")
    message = m.decode(raw).message
    assert isinstance(message, m.MotGetDcStatusUpdate)
    assert message.status_bits_flags.homed


def test_unnamed_header_parameters_are_kept() -> None:
    raw = bytes.fromhex("2302 0007 5001")
    frame = m.decode(raw)
    assert frame.message == m.ModIdentify(param2=7)
    assert frame.encode() == raw
    assert repr(m.ModIdentify()) == "ModIdentify(chan_ident=0)"


def test_a_framer_returns_frames_that_are_decoded_on_demand() -> None:
    completed = bytes.fromhex("64040E0081500100 68AAA001 0000 0000 30000080".replace(" ", ""))
    framer = PROTOCOL.framer(End.HOST)
    (event,) = framer.feed(completed)
    assert isinstance(event, Received)
    assert isinstance(event.frame.message, m.MotMoveCompletedUndecided)
    framer.tell(0x50, status="dc")
    first, second = framer.feed(completed + completed.replace(b"\x81\x50", b"\x81\x22"))
    assert isinstance(first, Received)
    assert isinstance(second, Received)
    assert isinstance(first.frame.message, m.MotMoveCompletedDc)
    assert isinstance(second.frame.message, m.MotMoveCompletedUndecided)
    with pytest.raises(UnsupportedError, match=r"Protocol\.framer"):
        _ = Received(completed).frame


def test_an_undocumented_message_carries_data_or_parameters() -> None:
    assert Frame(HwUnprinted(b"ab"), 1, 0x50).encode() == bytes.fromhex("f10002008150") + b"ab"
    assert Frame(HwUnprinted(param1=3), 1, 0x50).encode() == bytes.fromhex("f10003000150")
    for wrong in (lambda: HwUnprinted("ab"), lambda: HwUnprinted(b"ab", param1=1)):  # type: ignore[arg-type]
        with pytest.raises(BadValueError):
            wrong()
    with pytest.raises(OutOfRangeError):
        HwUnprinted(bytes(256))
    with pytest.raises(UnsupportedError, match="no documented layout"):
        HwUnprinted()


@pytest.mark.parametrize("cls", PROTOCOL.messages, ids=lambda cls: cls.__name__)
def test_a_pattern_has_the_positional_arguments_of_the_constructor(cls: type[Message]) -> None:
    parameters = inspect.signature(cls).parameters.values()
    positional = [p.name for p in parameters if p.kind is p.POSITIONAL_OR_KEYWORD]
    assert list(cls.__match_args__) == positional


def test_a_reserved_word_does_not_shift_a_pattern() -> None:
    match m.MotGetDcStatusUpdate(1, 2, 3, 0x400, motor_current=9):
        case m.MotGetDcStatusUpdate(1, 2, 3, bits, motor_current=9):
            assert bits == 0x400
        case _:
            pytest.fail("no match")


def test_replacing_an_unknown_field() -> None:
    with pytest.raises(UnknownFieldError, match="MOT_MOVE_ABSOLUTE has no field speed: chan_ident"):
        m.MotMoveAbsolute(1, 5).replace(speed=1)


@pytest.mark.parametrize("wrong", [MOVE.hex(), MOVE.hex()[:4], None, list(MOVE)])
def test_only_bytes_are_decoded(wrong: object) -> None:
    with pytest.raises(BadValueError, match="decode takes bytes, not"):
        m.decode(wrong)  # type: ignore[arg-type]
    for right in (bytearray(MOVE), memoryview(MOVE)):
        assert m.decode(right) == m.decode(MOVE)  # type: ignore[arg-type]


@pytest.mark.parametrize("id", [0x0453, 0x0464, 0x0081])
@pytest.mark.parametrize("length", [256, 65535])
def test_no_packet_is_longer_than_255_bytes(id: int, length: int) -> None:
    """The framer treats such a header as garbage, and no frame could be encoded from it."""
    raw = id.to_bytes(2, "little") + length.to_bytes(2, "little") + b"\x81\x50" + bytes(length)
    with pytest.raises(BadLengthError, match="no packet has more than 255"):
        m.decode(raw)
    longest = raw[:2] + b"\xff\0\x81\x50" + bytes(255)
    assert m.decode(longest).encode() == longest


@pytest.mark.parametrize(
    ("raw", "error", "said"),
    [
        (MOVE[:3], TruncatedError, "at least 6 bytes, not 3"),
        (
            MOVE[:-1],
            TruncatedError,
            "a packet of 6 bytes, but 5 follow the header; .* before byte 11$",
        ),
        (
            MOVE + b"a",
            TrailingBytesError,
            "6 bytes, but 7 follow the header; it ends before byte 12$",
        ),
        (
            bytes.fromhex("430401005001") + b"ab",
            TrailingBytesError,
            "but 2 more follow from byte 6",
        ),
    ],
)
def test_errors_name_the_wrong_byte(raw: bytes, error: type[Exception], said: str) -> None:
    with pytest.raises(error, match=said):
        m.decode(raw)


class Short(UndecidedMessage):
    __slots__ = ()
    layout = Layout("TWO_LENGTHS", 0x04FE, Direction.TO_HOST, "data:short", ("data",), 4)


class Long(UndecidedMessage):
    __slots__ = ()
    layout = Layout("TWO_LENGTHS", 0x04FE, Direction.TO_HOST, "data:long", ("data",), 12)


@pytest.mark.parametrize(
    ("length", "cls"), [(4, Short), (6, Short), (11, Short), (12, Long), (13, Long)]
)
def test_a_packet_is_decoded_by_the_longest_layout_it_fills(
    length: int, cls: type[Message]
) -> None:
    two = FramedProtocol("two", "Two", "two", [Short, Long], 1, frozenset({0x50}), {})
    frame = two.decode(bytes((0xFE, 0x04, length, 0, 0x81, 0x50)) + bytes(length))
    assert type(frame.message) is cls
    assert len(frame.extra) == length - cls.layout.length
    with pytest.raises(BadLengthError, match="but a packet has 4 or 12 bytes"):
        two.decode(bytes((0xFE, 0x04, 3, 0, 0x81, 0x50)) + bytes(3))


def test_a_frame_refuses_parts_of_the_wrong_type() -> None:
    move = m.MotMoveAbsolute(1, 5)
    frame = Frame(move, 0x50, 1, bytearray(b"ab"))  # type: ignore[arg-type]
    assert frame.extra == b"ab"
    assert type(frame.extra) is bytes
    assert hash(frame) == hash(Frame(move, 0x50, 1, b"ab"))
    for wrong in (("move", 0x50, 1), (move, "0x50", 1), (move, 0x50, 1, "ab"), (move, 0x50, 1, 2)):
        with pytest.raises(BadValueError):
            Frame(*wrong)  # type: ignore[arg-type]
    with pytest.raises(OutOfRangeError, match="dest must be an address"):
        Frame(move, 0xD0, 1)
    with pytest.raises(BadValueError, match="no packet to add extra bytes to"):
        Frame(m.ModIdentify(), 0x50, 1, b"a")


def test_fields_must_agree_with_the_data_of_an_undecided_message() -> None:
    data = bytes.fromhex("0100 68aaa001 0000 0000 30000080")
    name, form = "MOT_MOVE_COMPLETED", "data:undecided"
    assert PROTOCOL.build(name, {"chan_ident": 1}, form, data).pack(1, 0x50)[6:] == data
    with pytest.raises(BadValueError, match="chan_ident is 1 in data, not 2"):
        PROTOCOL.build(name, {"chan_ident": 2}, form, data)


def test_invalid_calls_of_a_framer() -> None:
    with pytest.raises(BadValueError, match="end of a line"):
        PROTOCOL.framer("host")  # type: ignore[arg-type]
    for source in ("0x50", True, -1, 256):
        with pytest.raises(BadValueError, match="source must be an address"):
            PROTOCOL.framer().tell(source, status="dc")  # type: ignore[arg-type]
    with pytest.raises(BadValueError, match="a framer takes bytes"):
        PROTOCOL.framer().feed("53")  # type: ignore[arg-type]
