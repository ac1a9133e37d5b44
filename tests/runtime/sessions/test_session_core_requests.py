"""Requests: one at a time per address, deadlines, late replies, cancellation."""

from __future__ import annotations

import pytest
from stepped_core import Framed, dc_status, said, vel_params

from stagewire.errors import MotionTimeoutError, OutOfRangeError, ReplyTimeoutError, StagewireError
from stagewire_apt import messages as m
from undocumented import HwUnprinted

VEL_REQUEST = m.MotReqVelParams(1)
JOG = (m.MotReqJogParams(1), (m.MotGetJogParams,))


def jog_params(step: int) -> bytes:
    return said(
        m.MotGetJogParams(
            chan_ident=1, jog_mode=1, jog_step_size=step, jog_min_velocity=0,
            jog_acceleration=1, jog_max_velocity=2, jog_stop_mode=1,
        )
    )  # fmt: skip


def test_requests_to_an_address_are_sent_one_at_a_time_in_order():
    talk = Framed()
    first, second, third = talk.ask(), talk.ask(*JOG), talk.ask()
    assert [one.written for one in (first, second, third)] == [True, False, False]
    assert talk.hear(said(vel_params(1))) == m.MotReqJogParams(1).pack(0x50, 1)
    assert talk.hear(jog_params(2)) == VEL_REQUEST.pack(0x50, 1)
    talk.hear(said(vel_params(3)))
    assert first.value().message.max_velocity == 1
    assert second.value().message.jog_step_size == 2
    assert third.value().message.max_velocity == 3


def test_a_request_does_not_overtake_an_earlier_command():
    talk = Framed(pacing=0.02)
    talk.send()
    sent, asked = talk.send(m.ModIdentify()), talk.ask()
    assert (sent.written, asked.written) == (False, False)
    assert talk.later(0.02) == m.ModIdentify().pack(0x50, 1)
    assert talk.later(0.02) == VEL_REQUEST.pack(0x50, 1)


def test_a_command_waits_for_its_turn_but_not_for_a_reply():
    talk = Framed()
    talk.ask()
    assert talk.send().written
    waiting = talk.ask()
    behind = talk.send()
    talk.later(0.1)
    assert (waiting.written, behind.written) == (False, False)


def test_a_silent_controller_causes_a_timeout():
    talk = Framed()
    asked = talk.ask(timeout=0.25)
    talk.later(0.2499)
    assert not asked.done
    talk.later(0.0001)
    with pytest.raises(ReplyTimeoutError) as refused:
        asked.value()
    text = str(refused.value)
    assert "MOT_REQ_VELPARAMS (14 04 01 00 50 01) was sent to 0x50" in text
    assert "no MOT_GET_VELPARAMS arrived from there within 0.25 s" in text
    assert "received meanwhile: nothing" in text
    assert not isinstance(refused.value, MotionTimeoutError)
    assert isinstance(refused.value, TimeoutError)
    assert talk.core.statistics.timed_out == 1


def test_a_timeout_names_the_messages_received_meanwhile():
    talk = Framed()
    talk.hear(said(dc_status()))
    asked = talk.ask()
    talk.hear(said(dc_status()), said(dc_status()), said(m.HwResponse()))
    talk.hear(said(HwUnprinted(b"\x44\x04" + bytes(66))))
    talk.later(1)
    text = str(asked.error)
    assert "2 x MOT_GET_DCSTATUSUPDATE, 1 x HW_RESPONSE, 1 x HW_UNPRINTED (f1 00 44 00" in text


def test_a_timeout_counts_bytes_that_are_not_a_message():
    talk = Framed()
    talk.hear(b"\xff" * 3)
    talk.later(0.05)  # no request is sent while these bytes may begin a frame
    asked = talk.ask()
    talk.hear(b"\xff" * 5)
    talk.later(1)
    assert "received meanwhile: 5 bytes that are not a message (wrong baud rate" in str(asked.error)


def test_the_timeout_is_rounded_for_people():
    talk = Framed()
    asked = talk.ask(timeout=1.99996)
    talk.later(2)
    assert "within 2 s" in str(asked.error)


def test_the_timeout_includes_waiting_and_nothing_is_sent_after_it():
    talk = Framed()
    talk.ask(timeout=5)
    waiting = talk.ask(*JOG, timeout=0.5)
    sent = talk.send()
    wrote = talk.later(2)
    assert not waiting.written
    with pytest.raises(
        ReplyTimeoutError,
        match="MOT_REQ_JOGPARAMS to 0x50 was not sent: other exchanges came first",
    ):
        waiting.value()
    assert sent.written  # sent when its turn came
    assert wrote == m.ModIdentify().pack(0x50, 1)


def test_a_late_reply_is_never_matched_to_the_next_request():
    talk = Framed(quiet=0.5)
    late = talk.ask()
    talk.later(1)
    assert isinstance(late.error, ReplyTimeoutError)
    again = talk.ask()
    assert not again.written
    assert talk.hear(said(vel_params(1))) == VEL_REQUEST.pack(0x50, 1)
    assert not again.done
    talk.hear(said(vel_params(2)))
    assert again.value().message.max_velocity == 2
    assert talk.core.statistics.late == 1
    assert isinstance(late.error, ReplyTimeoutError)


def test_two_late_copies_of_a_reply_in_one_read_answer_nothing():
    talk = Framed(quiet=0.5)
    talk.ask()
    talk.later(1)
    again = talk.ask()
    talk.hear(said(vel_params(1)) * 2)
    assert not again.done


def test_after_the_quiet_period_the_same_request_is_sent():
    talk = Framed(quiet=0.5)
    talk.ask()
    talk.later(1)
    again = talk.ask()
    assert talk.later(0.4999) == b""
    assert talk.later(0.0001) == VEL_REQUEST.pack(0x50, 1)
    talk.hear(said(vel_params(2)))
    assert again.value().message.max_velocity == 2


def test_the_timeout_of_a_poisoned_request_states_that_it_was_not_sent():
    talk = Framed(quiet=5)
    talk.ask()
    talk.later(1)
    again = talk.ask()
    talk.later(1)
    assert not again.written
    assert "was not sent: a late reply to an earlier request could still have arrived" in str(
        again.error
    )


def test_requests_that_wait_for_late_replies_keep_their_order():
    talk = Framed(quiet=0.5)
    for question in ((), JOG):
        talk.cancel(talk.ask(*question))
    jog, vel = talk.ask(*JOG), talk.ask()
    other = talk.ask(m.MotReqVelParams(2))
    assert (jog.written, vel.written, other.written) == (False, False, True)
    assert talk.hear(said(vel_params(1, chan_ident=2))) == b""
    assert talk.later(0.5) == m.MotReqJogParams(1).pack(0x50, 1)
    assert talk.hear(jog_params(1)) == VEL_REQUEST.pack(0x50, 1)


def test_other_requests_addresses_and_channels_are_not_delayed():
    talk = Framed(quiet=0.5)
    talk.ask()
    talk.later(1)
    talk.ask()
    others = [
        talk.ask(*JOG),
        talk.ask(dest=0x21),
    ]
    assert all(other.written for other in others)
    talk.hear(jog_params(2))
    second = talk.ask(m.MotReqVelParams(2))
    assert second.written
    talk.hear(said(vel_params(9, chan_ident=2)))
    assert second.value().message.max_velocity == 9


def test_a_late_reply_does_not_answer_a_request_to_another_address():
    talk = Framed(quiet=0.5)
    talk.ask(dest=0x21)
    talk.later(1)
    other = talk.ask(dest=0x22)
    talk.hear(said(vel_params(1), 0x21))
    assert not other.done


def test_a_request_is_poisoned_at_all_addresses_if_replies_have_none():
    talk = Framed(quiet=0.5)
    talk.ask(dest=0x21)
    talk.hear(said(vel_params(0), 0, 0))
    talk.ask(dest=0x21)
    talk.later(1)
    other = talk.ask(dest=0x22)
    assert not other.written
    talk.hear(said(vel_params(1), 0, 0))
    assert other.written
    talk.hear(said(vel_params(2), 0, 0))
    assert other.value().message.max_velocity == 2


def test_a_status_request_that_timed_out_waits_for_a_status():
    """An unsolicited status also counts, because it cannot be distinguished from the late one."""
    talk = Framed()
    status = (m.MotReqDcStatusUpdate(1), (m.MotGetDcStatusUpdate,))
    talk.ask(*status)
    talk.later(1)
    again = talk.ask(*status)
    talk.hear(said(dc_status(1)))
    assert (again.written, again.done) == (True, False)
    talk.hear(said(dc_status(2)))
    assert again.value().message.position == 2


def test_a_request_cancelled_before_it_was_sent_is_not_sent():
    talk = Framed()
    talk.ask()
    waiting = talk.ask(*JOG)
    behind = talk.ask()
    ended = []
    waiting.on_done = ended.append
    talk.cancel(waiting)
    assert ended == [waiting]
    assert type(waiting.error) is StagewireError
    assert talk.hear(said(vel_params(1))) == VEL_REQUEST.pack(0x50, 1)
    talk.hear(said(vel_params(2)))
    assert behind.value().message.max_velocity == 2


def test_cancelling_a_sent_request_poisons_it():
    talk = Framed()
    cancelled = talk.ask()
    talk.cancel(cancelled)
    again = talk.ask()
    assert not again.written
    talk.hear(said(vel_params(1)))
    assert again.written
    talk.hear(said(vel_params(2)))
    assert again.value().message.max_velocity == 2
    assert talk.core.statistics.cancelled == 1


def test_cancelling_a_request_releases_the_next_at_its_address():
    talk = Framed()
    first, second = talk.ask(), talk.ask(*JOG)
    assert talk.cancel(first) == m.MotReqJogParams(1).pack(0x50, 1)
    assert second.written


def test_cancelling_an_ended_request_has_no_effect():
    talk = Framed()
    asked = talk.ask()
    talk.hear(said(vel_params(1)))
    talk.cancel(asked)
    assert asked.value().message.max_velocity == 1
    assert talk.ask().written
    assert talk.core.statistics.cancelled == 0


def test_callbacks_are_called_once_and_in_order():
    talk = Framed()
    asked = talk.core.ask(VEL_REQUEST, (m.MotGetVelParams,), 0x50, 1.0, talk.now)
    told = []
    asked.on_written = lambda exchange: told.append(("written", exchange.written, exchange.done))
    asked.on_done = lambda exchange: told.append(("done", exchange.written, exchange.done))
    assert told == []
    talk.flush()
    assert told == [("written", True, False)]
    talk.hear(said(vel_params(1)), said(vel_params(2)))
    talk.later(5)
    assert told == [("written", True, False), ("done", True, True)]


@pytest.mark.parametrize("timeout", [0, -1, float("nan"), float("inf")])
def test_an_invalid_timeout_is_refused_before_writing(timeout):
    talk = Framed()
    with pytest.raises(OutOfRangeError, match="seconds above 0"):
        talk.ask(timeout=timeout)
    with pytest.raises(OutOfRangeError, match="seconds above 0"):
        talk.move(timeout=timeout)
    assert talk.wrote == b""
    assert talk.move().written  # the refused motion is not in progress


def test_an_invalid_address_is_refused_before_writing():
    talk = Framed()
    for wrong in (0x80, -1):
        with pytest.raises(OutOfRangeError, match="address"):
            talk.ask(dest=wrong)
    assert talk.later(5) == b""


@pytest.mark.parametrize("name", ["pacing", "quiet", "silence", "drain", "reply_timeout"])
def test_options_must_be_numbers_of_seconds(name):
    for wrong in (-1, float("nan"), float("inf"), "1"):
        with pytest.raises(OutOfRangeError, match=name):
            Framed(**{name: wrong})
