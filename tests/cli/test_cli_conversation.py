"""Both directions of a line in words, however the bytes are cut."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from stagewire.protocol import load_protocol
from stagewire_cli.conversation import Conversation

APT, MS2000 = load_protocol("thorlabs_apt"), load_protocol("asi_ms2000")
MOVE = bytes.fromhex("53 04 06 00 D0 01 01 00 40 0D 03 00")
MOVE_WORDS = "0x01->0x50 MOT_MOVE_ABSOLUTE chan_ident=1 absolute_distance=200000"
COMPLETED = bytes.fromhex("64 04 0E 00 81 50 01 00 68 AA A0 01 00 00 00 00 30 00 00 80")
READ_POSITION, READ_STATUS = bytes.fromhex("18 61 03 3A"), bytes.fromhex("18 3F 3A")
STOP = bytes.fromhex("18 42 00 3A")


def words(pieces: list[tuple[bytes, str]]) -> list[str]:
    return [text for _, text in pieces]


def test_frames_of_both_ends() -> None:
    talk = Conversation(APT, {"status": "dc"})
    assert talk.host(MOVE + bytes.fromhex("05 00 00 00 50 01")) == [
        (MOVE, MOVE_WORDS),
        (bytes.fromhex("05 00 00 00 50 01"), "0x01->0x50 HW_REQ_INFO"),
    ]
    [(raw, text)] = talk.controller(COMPLETED)
    assert raw == COMPLETED
    assert text.startswith("0x50->0x01 MOT_MOVE_COMPLETED (data:dc) chan_ident=1 position=27306600")


def test_a_frame_in_two_chunks_is_named_where_it_ends() -> None:
    talk = Conversation(APT)
    assert talk.host(MOVE[:7]) == [(MOVE[:7], "incomplete")]
    assert talk.host(MOVE[7:]) == [(MOVE[7:], MOVE_WORDS)]


def test_what_was_held_and_turns_out_to_be_garbage_is_named_with_what_follows() -> None:
    talk = Conversation(APT)
    noise = bytes.fromhex("53 04 06")
    assert talk.host(noise) == [(noise, "incomplete")]
    assert words(talk.host(MOVE)) == [f"garbage; {MOVE_WORDS}"]


def test_text_is_shown_as_text() -> None:
    assert words(Conversation(MS2000).host(b"W X\r")) == ["incomplete 'W X\\r'"]


def test_replies_are_told_by_what_was_asked() -> None:
    talk = Conversation(MS2000)
    assert words(talk.host(READ_POSITION + READ_STATUS)) == [
        "axis 0x18 (X) READ_MOTOR_POSITION",
        "axis 0x18 (X) READ_STATUS",
    ]
    assert words(talk.controller(b"\x01\x02")) == ["incomplete"]
    assert words(talk.controller(b"\x03B")) == [
        "command READ_MOTOR_POSITION (reply) position=197121",
        "command READ_STATUS (reply) status=66",
    ]
    assert words(talk.controller(b"\xff")) == ["garbage"]


def test_a_reply_that_was_lost_does_not_shift_those_that_follow() -> None:
    talk = Conversation(MS2000)
    talk.host(READ_POSITION)
    talk.controller(b"\x01")
    talk.host(READ_STATUS)
    assert words(talk.controller(b"B")) == ["command READ_STATUS (reply) status=66"]


def test_a_stop_gives_no_reply_up() -> None:
    talk = Conversation(MS2000)
    talk.host(READ_POSITION)
    talk.host(STOP)
    assert words(talk.controller(bytes(3))) == ["command READ_MOTOR_POSITION (reply) position=0"]


@pytest.mark.parametrize("protocol", [APT, MS2000], ids=["frames", "commands"])
@given(chunks=st.lists(st.tuples(st.booleans(), st.binary(max_size=40)), max_size=20))
def test_every_byte_is_given_out_once(protocol: object, chunks: list[tuple[bool, bytes]]) -> None:
    talk = Conversation(protocol)  # type: ignore[arg-type]
    for from_host, data in chunks:
        pieces = talk.host(data) if from_host else talk.controller(data)
        assert b"".join(raw for raw, _ in pieces) == data
        assert all(raw and text for raw, text in pieces)
