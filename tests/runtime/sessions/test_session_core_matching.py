"""Matching of frames to exchanges: by message, by address, and by fields that request and reply share."""

from __future__ import annotations

import itertools

import pytest
from stepped_core import HOST, VEL, Framed, dc_status, said, vel_params

from stagewire._sessions.exchange import Exchange
from stagewire.errors import ReplyTimeoutError
from stagewire_apt import messages as m
from undocumented import HwUnprinted

BAYS = (0x21, 0x22, 0x23)


def test_a_reply_from_the_requested_address_matches():
    talk = Framed()
    asked = talk.ask(dest=0x22)
    assert talk.wrote == m.MotReqVelParams(1).pack(0x22, HOST)
    talk.hear(said(vel_params(5), 0x22))
    assert asked.done
    assert asked.value().message == vel_params(5)
    assert asked.value().source == 0x22


@pytest.mark.parametrize("source", [0x11, 0x21, 0x23, 0x2A, 0x50])
def test_a_reply_from_another_documented_address_never_matches(source):
    talk = Framed()
    asked = talk.ask(dest=0x22)
    talk.hear(said(vel_params(5), source))
    assert not asked.done
    talk.hear(said(vel_params(6), 0x22))
    assert asked.value().message.max_velocity == 6


@pytest.mark.parametrize("addresses", [(HOST, 0x22), (0, 0), (0x22, HOST)])
def test_zero_and_unswapped_addresses_match(addresses):
    talk = Framed()
    asked = talk.ask(dest=0x22)
    dest, source = addresses
    talk.hear(said(vel_params(5), source, dest))
    assert asked.value().message.max_velocity == 5


def test_an_unswapped_reply_matches_the_bay_it_names():
    talk = Framed()
    first, second = talk.ask(dest=0x21), talk.ask(dest=0x22)
    talk.hear(said(vel_params(2), source=HOST, dest=0x22))
    assert (first.done, second.done) == (False, True)


def test_a_reply_for_another_channel_never_matches():
    talk = Framed()
    asked = talk.ask(m.MotReqVelParams(2))
    talk.hear(said(vel_params(5, chan_ident=1)))
    assert not asked.done
    talk.hear(said(vel_params(6, chan_ident=2)))
    assert asked.value().message.max_velocity == 6


def test_the_reply_must_repeat_the_requested_bay():
    talk = Framed()
    asked = talk.ask(m.RackReqBayUsed(1), (m.RackGetBayUsed,), dest=0x11)
    talk.hear(said(m.RackGetBayUsed(0, 1), 0x11))
    assert not asked.done
    talk.hear(said(m.RackGetBayUsed(1, 2), 0x11))
    assert asked.value().message == m.RackGetBayUsed(1, 2)


def test_a_reserved_byte_of_a_request_selects_nothing():
    """The reserved byte of RACK_REQ_STATUSBITS has the same name as the value in the reply."""
    talk = Framed()
    asked = talk.ask(m.RackReqStatusBits(), (m.RackGetStatusBits,), dest=0x11)
    talk.hear(said(m.RackGetStatusBits(status_bits=5), 0x11))
    assert asked.value().message.status_bits == 5


def test_any_of_several_replies_matches():
    talk = Framed()
    replies = (m.MotGetVelParams, m.MotGetJogParams, m.MotGetDcStatusUpdate)
    asked = talk.ask(replies=replies)
    talk.hear(said(dc_status(3)))
    assert asked.value().message == dc_status(3)


def test_a_message_that_was_not_requested_never_matches():
    talk = Framed()
    asked = talk.ask()
    talk.hear(said(dc_status()), said(m.MotGetPosCounter(1, 4)), said(m.MotMoveHomed(1)))
    assert not asked.done
    assert talk.core.statistics.matched == 0


def test_addresses_do_not_wait_for_each_other():
    talk = Framed()
    asked = [talk.ask(dest=bay) for bay in BAYS]
    assert all(one.written for one in asked)
    for bay in reversed(BAYS):
        talk.hear(said(vel_params(bay), bay))
    assert [one.value().message.max_velocity for one in asked] == [*BAYS]


def test_a_reply_without_an_address_matches_none_of_two_requests():
    talk = Framed()
    first, second = talk.ask(dest=0x21), talk.ask(dest=0x22)
    talk.hear(said(vel_params(5), 0, 0))
    assert (first.done, second.done) == (False, False)
    assert talk.core.statistics.ambiguous == 1
    talk.hear(said(vel_params(1), 0x21), said(vel_params(2), 0x22))
    assert [one.value().message.max_velocity for one in (first, second)] == [1, 2]


def test_requests_are_sent_one_at_a_time_if_replies_have_no_address():
    talk = Framed()
    talk.ask(dest=0x21)
    talk.hear(said(vel_params(0), 0, 0))
    first, second = talk.ask(dest=0x21), talk.ask(dest=0x22)
    assert (first.written, second.written) == (True, False)
    talk.hear(said(vel_params(1), 0, 0))
    assert second.written
    talk.hear(said(vel_params(2), 0, 0))
    assert [one.value().message.max_velocity for one in (first, second)] == [1, 2]


FORMS = {
    "header": m.MotMoveCompletedHeader(1),
    "dc": m.MotMoveCompletedDc(chan_ident=1, position=4, velocity=0, status_bits=0),
    "stepper": m.MotMoveCompletedStepper(chan_ident=1, position=4, enc_count=0, status_bits=0),
}


@pytest.mark.parametrize("unswapped", [False, True])
@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("order", [*itertools.permutations(BAYS)])
def test_motions_of_three_bays_end_in_any_order(order, form, unswapped):
    talk = Framed()
    moves = {bay: talk.move(bay) for bay in BAYS}
    ended = []
    for bay in order:
        moves[bay].on_done = lambda exchange: ended.append(exchange.dest)
    for count, bay in enumerate(order, 1):
        source, dest = (HOST, bay) if unswapped else (bay, HOST)
        talk.hear(said(FORMS[form], source, dest))
        assert ended == [*order[:count]]
    assert all(move.error is None for move in moves.values())


@pytest.mark.parametrize("status", [{}, {"status": "dc"}, {"status": "stepper"}])
def test_the_context_selects_the_status_layout_of_an_end(status):
    talk = Framed()
    talk.core.tell(0x50, **status)
    move = talk.move()
    talk.hear(said(FORMS["dc"]))
    name = {"dc": "MotMoveCompletedDc", "stepper": "MotMoveCompletedStepper"}.get(
        status.get("status", ""), "MotMoveCompletedUndecided"
    )
    assert type(move.value().message).__name__ == name
    assert move.value().message.position == 4


def test_an_end_without_an_address_ends_the_only_motion():
    talk = Framed()
    move = talk.move(0x22)
    talk.hear(said(FORMS["header"], 0, 0))
    assert move.value().message == FORMS["header"]


def test_an_end_without_an_address_ends_none_of_several_motions():
    talk = Framed()
    moves = [talk.move(bay) for bay in BAYS]
    talk.hear(said(FORMS["dc"], 0, 0))
    assert not any(move.done for move in moves)
    assert talk.core.statistics.ambiguous == 1


def test_the_end_of_another_channel_ends_nothing():
    talk = Framed()
    first, second = talk.move(chan_ident=1), talk.move(chan_ident=2)
    talk.later(1)
    talk.hear(said(m.MotMoveCompletedHeader(2)))
    assert (first.done, second.done) == (False, True)


def test_a_frame_that_began_before_a_request_was_written_does_not_answer_it():
    """A copy of a reply with a damaged length waits for one more byte: the first of the next reply."""
    talk = Framed()
    talk.ask()
    copy = bytearray(said(vel_params(5)))
    copy[2] += 1
    talk.hear(said(vel_params(5)) + bytes(copy))
    asked = talk.ask()
    talk.hear(said(vel_params(6)))
    assert not asked.done
    talk.later(1)
    again = talk.ask()
    talk.later(0.5)
    talk.hear(said(vel_params(7)))
    assert again.value().message.max_velocity == 7


def test_an_end_that_began_before_the_command_was_written_is_ignored():
    talk = Framed()
    completed = said(FORMS["dc"])
    talk.hear(completed[:9])
    move = talk.move()
    talk.hear(completed[9:])
    assert not move.done
    talk.hear(completed)
    assert move.done


INTRUSIONS = {
    "a 20-byte completion": said(FORMS["dc"]),
    "a 6-byte completion": said(FORMS["header"]),
    "a DC status": said(dc_status()),
    "a 34-byte status": bytes.fromhex("81041c008150") + bytes(range(1, 29)),
    "HW_RESPONSE": said(m.HwResponse()),
    "HW_RICHRESPONSE": said(m.HwRichResponse(0, 0, "")),
    "an unknown id": bytes.fromhex("fe7f00000150"),
    "an unknown id whose payload is a frame": bytes.fromhex("fe7f14008150") + said(vel_params(99)),
    "a stray zero": b"\0",
    "three bytes of garbage": bytes.fromhex("fa0c81"),
}


@pytest.mark.parametrize("intrusion", INTRUSIONS)
def test_an_intrusion_before_a_reply_affects_no_reply(intrusion):
    talk = Framed()
    first = talk.ask()
    talk.hear(INTRUSIONS[intrusion])
    talk.hear(said(vel_params(5)))
    second = talk.ask()
    talk.hear(said(vel_params(6)))
    assert [one.value().message.max_velocity for one in (first, second)] == [5, 6]


def test_a_reply_without_a_layout_can_be_requested():
    talk = Framed()
    asked = talk.ask(m.HwReqInfo(), (HwUnprinted,))
    talk.hear(said(HwUnprinted(bytes(68))))
    assert asked.value().message.data == bytes(68)


def test_a_frame_that_only_resembles_a_reply_never_matches():
    """The velocity parameters have no header form, and this packet is too short."""
    talk = Framed()
    asked = talk.ask(replies=VEL)
    talk.hear(bytes.fromhex("150404008150 01000000"))
    assert not asked.done
    assert talk.core.statistics.bad_length == 1


# Frames without a match in the error of a timeout


def timed_out(talk: Framed, exchange: Exchange) -> str:
    talk.later(exchange.deadline - talk.now)
    assert isinstance(exchange.error, ReplyTimeoutError)
    return str(exchange.error)


def test_the_timeout_names_ends_without_an_address():
    talk = Framed()
    moves = [talk.move(dest=bay, timeout=3) for bay in BAYS]
    end = said(FORMS["header"], 0, 0)
    talk.hear(end, end)
    for move in moves:
        text = timed_out(talk, move)
        assert (
            "not matched: 2 x MOT_MOVE_COMPLETED without an address while several exchanges wait for one "
            "(the last: 64 04 01 00 00 00)"
        ) in text
        assert "run one motion at a time on this line, or read the status of each channel" in text
        assert "it may still be in progress" in text


def test_the_timeout_names_replies_without_an_address():
    talk = Framed()
    asked = [talk.ask(dest=bay) for bay in BAYS[:2]]
    reply = said(vel_params(5), 0, 0)
    talk.hear(reply)
    for one in asked:
        text = timed_out(talk, one)
        assert (
            "1 x MOT_GET_VELPARAMS without an address while several exchanges wait for one" in text
        )
        assert f"(the last: {reply.hex(' ')})" in text
        assert "requests on this line are sent one at a time" in text


def test_the_timeout_names_an_answer_to_a_stop_without_an_address():
    talk = Framed()
    halts = [talk.halt(dest=bay) for bay in BAYS[:2]]
    talk.hear(said(m.MotMoveStoppedHeader(1), 0, 0))
    for halt in halts:
        assert "1 x MOT_MOVE_STOPPED without an address" in timed_out(talk, halt)


@pytest.mark.parametrize(
    ("source", "channel", "why"),
    [
        (0x21, 1, "from 0x21 (the last"),
        (0x50, 1, "from 0x50 (the last"),
        (0x22, 2, "with chan_ident 2 instead of 1 (the last"),
        (0, 2, "with chan_ident 2 instead of 1 (the last"),
    ],
)
def test_the_timeout_names_a_wrong_address_or_channel(source, channel, why):
    talk = Framed()
    asked, move = talk.ask(dest=0x22), talk.move(dest=0x22, timeout=2)
    for message in (vel_params(5, channel), m.MotMoveCompletedHeader(channel)):
        talk.hear(said(message, source, dest=HOST if source else 0))
    text = timed_out(talk, asked)
    assert f"not matched: 1 x MOT_GET_VELPARAMS {why}" in text
    assert "is right; check that the controller is on" in text
    assert f"not matched: 1 x MOT_MOVE_COMPLETED {why}" in timed_out(talk, move)


def test_the_timeout_names_the_answer_to_an_earlier_stop():
    talk = Framed()
    talk.halt(timeout=0.1)
    talk.later(0.1)
    move = talk.move(timeout=2)
    talk.hear(said(m.MotMoveStoppedHeader(1)))
    assert "1 x MOT_MOVE_STOPPED which answers an earlier stop" in timed_out(talk, move)


def test_the_timeout_shows_the_bytes_of_unknown_messages():
    talk = Framed()
    before = bytes.fromhex("fd7f00000150")
    talk.hear(before)
    asked = talk.ask()
    unknown, short = bytes.fromhex("fe7f02008150abcd"), bytes.fromhex("15040400815001000000")
    talk.hear(unknown, unknown, short)
    text = timed_out(talk, asked)
    assert f"received meanwhile: 2 x unknown message 0x7ffe ({unknown.hex(' ')}), " in text
    assert f"1 x MOT_GET_VELPARAMS that is too short ({short.hex(' ')})" in text
    assert "0x7ffd" not in text


def test_the_timeout_does_not_name_replies_to_other_requests():
    talk = Framed()
    first, second = talk.ask(dest=0x21), talk.ask(dest=0x22)
    talk.hear(said(vel_params(5), 0x21))
    assert first.done
    assert "not matched" not in timed_out(talk, second)


def test_unmatched_frames_take_bounded_memory():
    talk = Framed()
    asked = talk.ask(dest=0x22)
    for channel in range(2, 1000):
        talk.hear(said(vel_params(5, channel), 0x22), bytes([channel % 256, 0x70, 0, 0, 1, 0x22]))
    text = timed_out(talk, asked)
    assert "other unknown messages" in text
    assert len(text) < 6000
