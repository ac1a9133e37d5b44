"""Messages and frames as values: immutable, equal only to their own class, hashable, picklable."""

from __future__ import annotations

import copy
import pickle

import pytest

from stagewire import End, Frame
from stagewire.errors import BadValueError, OutOfRangeError, UnknownFieldError, UnsupportedError
from stagewire.framing import Received
from stagewire_apt import PROTOCOL, enumerations, flags
from stagewire_apt import messages as m

MOVE = bytes.fromhex("5304 0600 d001 0100 400d0300")


def test_the_architecture_s_example_decodes() -> None:
    frame = m.decode(MOVE)
    assert frame == Frame(m.MotMoveAbsolute(chan_ident=1, absolute_distance=200_000), 0x50, 0x01)
    assert frame.encode() == MOVE
    assert repr(frame) == (
        "Frame(MotMoveAbsolute(chan_ident=1, absolute_distance=200000), dest=0x50, source=0x01)"
    )


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
    for raw in (MOVE, out_of_range, bytes.fromhex("8100 0200 81 50 abcd")):
        frame = m.decode(raw)
        assert copied(frame) == frame
        assert copied(frame).encode() == raw
        assert hash(copied(frame)) == hash(frame)


def test_matching() -> None:
    match m.decode(MOVE):
        case Frame(m.MotMoveAbsolute(1, distance), dest=0x50):
            assert distance == 200_000
        case _:
            pytest.fail("no match")


def test_values_out_of_range_are_kept_when_decoded_and_refused_when_set() -> None:
    raw = bytes.fromhex("a0041400d001 0100 ffffffff 00000000 00000000 00000000 0f00")
    message = m.decode(raw).message
    assert isinstance(message, m.MotSetDcPidParams)
    assert message.proportional == -1
    with pytest.raises(
        OutOfRangeError, match=r"MOT_SET_DCPIDPARAMS\.proportional takes 0 to 32767"
    ):
        message.replace(integral=1)


def test_wrong_kinds_are_refused() -> None:
    for wrong in ("1", 1.0, None, True, b"1"):
        with pytest.raises(BadValueError, match=r"MOT_MOVE_ABSOLUTE\.chan_ident"):
            m.MotMoveAbsolute(wrong, 5)  # type: ignore[arg-type]
    with pytest.raises(BadValueError, match=r"€"):
        m.HwGetInfo(1, "€", 44, bytes(4), "", 1)


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
    status = flags.DcStatusBits(0x80000430 | 0x100)
    assert status.homed
    assert not status.settled
    assert status.names == ("moving_forward", "moving_reverse", "homed", "channel_enabled")
    assert status.unnamed == 0x100
    assert flags.DcStatusBits.homed == 0x400
    assert flags.DcStatusBits.of(homed=True, settled=False) == 0x400
    with pytest.raises(UnknownFieldError, match="no bit nothing"):
        flags.DcStatusBits.of(nothing=True)
    raw = bytes.fromhex("91040e00 8150 0100 00000000 0000 0000 00040000")
    message = m.decode(raw).message
    assert isinstance(message, m.MotGetDcStatusUpdate)
    assert message.status_bits_flags.homed


def test_unnamed_header_parameters_are_kept() -> None:
    raw = bytes.fromhex("2302 0700 5001")
    frame = m.decode(raw)
    assert frame.message == m.ModIdentify(param1=7)
    assert frame.encode() == raw
    assert repr(m.ModIdentify()) == "ModIdentify()"


def test_a_framer_yields_frames_that_are_decoded_when_asked() -> None:
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
    assert Frame(m.HwRichResponse(b"ab"), 1, 0x50).encode() == bytes.fromhex("810002008150") + b"ab"
    assert Frame(m.HwRichResponse(param1=3), 1, 0x50).encode() == bytes.fromhex("810003000150")
    for wrong in (lambda: m.HwRichResponse("ab"), lambda: m.HwRichResponse(b"ab", param1=1)):  # type: ignore[arg-type]
        with pytest.raises(BadValueError):
            wrong()
    with pytest.raises(OutOfRangeError):
        m.HwRichResponse(bytes(256))
