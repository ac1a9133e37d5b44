"""Both directions of a line are decoded, in whatever chunks the bytes arrive."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from stagewire.capture import Heading
from stagewire.protocols import Direction
from stagewire_cli.selection import Selection
from stagewire_cli.virtual_log import Conversation

HOST, CONTROLLER = Direction.TO_CONTROLLER, Direction.TO_HOST  # the senders
MOVE = bytes.fromhex("53 04 06 00 D0 01 01 00 40 0D 03 00")
MOVE_WORDS = "0x01->0x50 MOT_MOVE_ABSOLUTE chan_ident=1 absolute_distance=200000"
COMPLETED = bytes.fromhex("64 04 0E 00 81 50 01 00 68 AA A0 01 00 00 00 00 30 00 00 80")
READ_POSITION, READ_STATUS = bytes.fromhex("18 61 03 3A"), bytes.fromhex("18 3F 3A")
STOP = bytes.fromhex("18 42 00 3A")


def conversation(protocol: str, unit: str | None = None) -> Conversation:
    return Conversation(Selection(recorded=Heading(protocol, unit)).task())


def words(pieces: list[tuple[bytes, str]]) -> list[str]:
    return [text for _, text in pieces]


def test_frames_of_both_directions_are_decoded() -> None:
    talk = conversation("thorlabs_apt", "TDC001")
    assert talk.pieces(HOST, MOVE + bytes.fromhex("05 00 00 00 50 01")) == [
        (MOVE, MOVE_WORDS),
        (bytes.fromhex("05 00 00 00 50 01"), "0x01->0x50 HW_REQ_INFO"),
    ]
    [(raw, text)] = talk.pieces(CONTROLLER, COMPLETED)
    assert raw == COMPLETED
    assert text.startswith("0x50->0x01 MOT_MOVE_COMPLETED (data:dc) chan_ident=1 position=27306600")


def test_a_frame_in_two_chunks_is_described_at_its_end() -> None:
    talk = conversation("thorlabs_apt")
    assert talk.pieces(HOST, MOVE[:7]) == [(MOVE[:7], "incomplete")]
    assert talk.pieces(HOST, MOVE[7:]) == [(MOVE[7:], MOVE_WORDS)]


def test_held_garbage_is_described_with_the_next_event() -> None:
    talk = conversation("thorlabs_apt")
    noise = bytes.fromhex("53 04 06")
    assert talk.pieces(HOST, noise) == [(noise, "incomplete")]
    assert words(talk.pieces(HOST, MOVE)) == [f"garbage; {MOVE_WORDS}"]


def test_text_is_shown_until_the_low_level_format_begins() -> None:
    talk = conversation("asi_ms2000")
    assert words(talk.pieces(HOST, b"W ")) == ["incomplete 'W '"]
    assert words(talk.pieces(HOST, b"X\r/\r")) == ["text 'W X\\r'", "text '/\\r'"]
    assert words(talk.pieces(CONTROLLER, b":A 0\r\nN\r\n")) == [
        "text ':A 0\\r\\n'",
        "text 'N\\r\\n'",
    ]
    assert words(talk.pieces(HOST, b"\xffB" + READ_POSITION)) == [
        "setup SWITCH_TO_LOW_LEVEL",
        "axis 0x18 (X) READ_MOTOR_POSITION",
    ]
    assert words(talk.pieces(CONTROLLER, b"\r\nN")) == [
        "command READ_MOTOR_POSITION (reply) position=5114381"
    ]


def test_replies_are_decoded_by_their_requests() -> None:
    talk = conversation("asi_ms2000")
    assert words(talk.pieces(HOST, READ_POSITION + READ_STATUS)) == [
        "axis 0x18 (X) READ_MOTOR_POSITION",
        "axis 0x18 (X) READ_STATUS",
    ]
    assert words(talk.pieces(CONTROLLER, b"\x01\x02")) == ["incomplete"]
    assert words(talk.pieces(CONTROLLER, b"\x03B")) == [
        "command READ_MOTOR_POSITION (reply) position=197121",
        "command READ_STATUS (reply) status=66",
    ]
    assert words(talk.pieces(CONTROLLER, b"\xff")) == ["garbage"]


def test_a_lost_reply_does_not_shift_later_ones() -> None:
    talk = conversation("asi_ms2000")
    talk.pieces(HOST, READ_POSITION)
    talk.pieces(CONTROLLER, b"\x01")
    talk.pieces(HOST, READ_STATUS)
    assert words(talk.pieces(CONTROLLER, b"B")) == [
        "garbage; command READ_STATUS (reply) status=66"
    ]


def test_a_command_without_reply_gives_up_no_reply() -> None:
    talk = conversation("asi_ms2000")
    talk.pieces(HOST, READ_POSITION)
    talk.pieces(HOST, STOP)
    assert words(talk.pieces(CONTROLLER, bytes(3))) == [
        "command READ_MOTOR_POSITION (reply) position=0"
    ]


@pytest.mark.parametrize("protocol", ["thorlabs_apt", "asi_ms2000"])
@given(
    chunks=st.lists(
        st.tuples(st.sampled_from([HOST, CONTROLLER]), st.binary(max_size=40)), max_size=20
    )
)
def test_every_byte_is_returned_once(protocol: str, chunks: list[tuple[Direction, bytes]]) -> None:
    talk = conversation(protocol)
    for direction, data in chunks:
        pieces = talk.pieces(direction, data)
        assert b"".join(raw for raw, _ in pieces) == data
        assert all(raw and text for raw, text in pieces)
