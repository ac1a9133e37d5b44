"""Requests: one at a time for an address, deadlines, late replies, cancellation."""

from __future__ import annotations

import pytest
from stepped_core import Framed, dc_status, said, vel_params

from stagewire.errors import MotionTimeoutError, OutOfRangeError, ReplyTimeoutError, StagewireError
from stagewire_apt import messages as m

VEL_REQUEST = m.MotReqVelParams(1)
JOG = (m.MotReqJogParams(1), (m.MotGetJogParams,))


def jog_params(step: int) -> bytes:
    return said(
        m.MotGetJogParams(
            chan_ident=1, jog_mode=1, jog_step_size=step, jog_min_velocity=0,
            jog_acceleration=1, jog_max_velocity=2, jog_stop_mode=1,
        )
    )  # fmt: skip


def test_an_address_is_asked_one_thing_at_a_time_in_order():
    talk = Framed()
    first, second, third = talk.ask(), talk.ask(*JOG), talk.ask()
    assert [one.written for one in (first, second, third)] == [True, False, False]
    assert talk.hear(said(vel_params(1))) == m.MotReqJogParams(1).pack(0x50, 1)
    assert talk.hear(jog_params(2)) == VEL_REQUEST.pack(0x50, 1)
    talk.hear(said(vel_params(3)))
    assert first.value().message.max_velocity == 1
    assert second.value().message.jog_step_size == 2
    assert third.value().message.max_velocity == 3


def test_what_was_asked_after_a_command_does_not_overtake_it():
    talk = Framed(pacing=0.02)
    talk.send()
    sent, asked = talk.send(m.ModIdentify()), talk.ask()
    assert (sent.written, asked.written) == (False, False)
    assert talk.later(0.02) == m.ModIdentify().pack(0x50, 1)
    assert talk.later(0.02) == VEL_REQUEST.pack(0x50, 1)


def test_a_command_does_not_wait_for_a_reply_but_for_its_turn():
    talk = Framed()
    talk.ask()
    assert talk.send().written
    waiting = talk.ask()
    behind = talk.send()
    talk.later(0.1)
    assert (waiting.written, behind.written) == (False, False)


def test_a_silent_controller_is_a_timeout_when_the_time_is_over():
    talk = Framed()
    asked = talk.ask(timeout=0.25)
    talk.later(0.2499)
    assert not asked.done
    talk.later(0.0001)
    with pytest.raises(ReplyTimeoutError) as refused:
        asked.value()
    text = str(refused.value)
    assert "MOT_REQ_VELPARAMS (14 04 01 00 50 01) was sent to 0x50" in text
    assert "no MOT_GET_VELPARAMS came from there within 0.25 s" in text
    assert "meanwhile came nothing" in text
    assert not isinstance(refused.value, MotionTimeoutError)
    assert isinstance(refused.value, TimeoutError)
    assert talk.core.statistics.timed_out == 1


def test_a_timeout_says_what_came_meanwhile():
    talk = Framed()
    talk.hear(said(dc_status()))
    asked = talk.ask()
    talk.hear(said(dc_status()), said(dc_status()), said(m.HwResponse()))
    talk.hear(said(m.HwRichResponse(b"\x44\x04" + bytes(66))))
    talk.later(1)
    text = str(asked.error)
    assert "2 x MOT_GET_DCSTATUSUPDATE, 1 x HW_RESPONSE, 1 x HW_RICHRESPONSE (81 00 44 00" in text


def test_a_timeout_tells_bytes_that_are_no_message():
    talk = Framed()
    talk.hear(b"\xff" * 3)
    talk.later(0.05)  # nothing is asked while these bytes may begin a frame
    asked = talk.ask()
    talk.hear(b"\xff" * 5)
    talk.later(1)
    assert "meanwhile came 5 bytes that are no message (another baud rate" in str(asked.error)


def test_what_is_left_of_a_time_is_said_as_people_would():
    talk = Framed()
    asked = talk.ask(timeout=1.99996)
    talk.later(2)
    assert "within 2 s" in str(asked.error)


def test_time_that_is_spent_waiting_counts_and_nothing_is_sent_after_it():
    talk = Framed()
    talk.ask(timeout=5)
    waiting = talk.ask(*JOG, timeout=0.5)
    sent = talk.send()
    wrote = talk.later(2)
    assert not waiting.written
    with pytest.raises(
        ReplyTimeoutError, match="MOT_REQ_JOGPARAMS to 0x50 was not sent: others waited"
    ):
        waiting.value()
    assert sent.written  # it went on when its turn came
    assert wrote == m.ModIdentify().pack(0x50, 1)


def test_a_late_reply_is_swallowed_and_the_next_question_gets_its_own():
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


def test_two_late_copies_of_a_reply_answer_nothing_when_they_come_together():
    talk = Framed(quiet=0.5)
    talk.ask()
    talk.later(1)
    again = talk.ask()
    talk.hear(said(vel_params(1)) * 2)
    assert not again.done


def test_after_the_quiet_period_the_question_is_asked_again():
    talk = Framed(quiet=0.5)
    talk.ask()
    talk.later(1)
    again = talk.ask()
    assert talk.later(0.4999) == b""
    assert talk.later(0.0001) == VEL_REQUEST.pack(0x50, 1)
    talk.hear(said(vel_params(2)))
    assert again.value().message.max_velocity == 2


def test_a_poisoned_question_that_times_out_says_that_nothing_was_sent():
    talk = Framed(quiet=5)
    talk.ask()
    talk.later(1)
    again = talk.ask()
    talk.later(1)
    assert not again.written
    assert "was not sent: the late reply to an earlier one might still have come" in str(
        again.error
    )


def test_questions_that_wait_for_late_replies_keep_their_order():
    talk = Framed(quiet=0.5)
    for question in ((), JOG):
        talk.cancel(talk.ask(*question))
    jog, vel = talk.ask(*JOG), talk.ask()
    other = talk.ask(m.MotReqVelParams(2))
    assert (jog.written, vel.written, other.written) == (False, False, True)
    assert talk.hear(said(vel_params(1, chan_ident=2))) == b""
    assert talk.later(0.5) == m.MotReqJogParams(1).pack(0x50, 1)
    assert talk.hear(jog_params(1)) == VEL_REQUEST.pack(0x50, 1)


def test_other_questions_and_addresses_and_channels_go_on_meanwhile():
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


def test_the_late_reply_of_a_question_is_no_answer_to_one_of_another_address():
    talk = Framed(quiet=0.5)
    talk.ask(dest=0x21)
    talk.later(1)
    other = talk.ask(dest=0x22)
    talk.hear(said(vel_params(1), 0x21))
    assert not other.done


def test_where_answers_have_no_address_a_question_is_poisoned_at_all_of_them():
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


def test_a_status_that_was_asked_for_in_vain_is_not_asked_again_before_one_came():
    """One that comes by itself will do: which of them is late, nobody can tell."""
    talk = Framed()
    status = (m.MotReqDcStatusUpdate(1), (m.MotGetDcStatusUpdate,))
    talk.ask(*status)
    talk.later(1)
    again = talk.ask(*status)
    talk.hear(said(dc_status(1)))
    assert (again.written, again.done) == (True, False)
    talk.hear(said(dc_status(2)))
    assert again.value().message.position == 2


def test_what_is_cancelled_before_it_is_sent_is_not_sent():
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


def test_what_is_cancelled_after_it_was_sent_poisons_its_question():
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


def test_a_cancelled_request_lets_the_next_one_of_its_address_go():
    talk = Framed()
    first, second = talk.ask(), talk.ask(*JOG)
    assert talk.cancel(first) == m.MotReqJogParams(1).pack(0x50, 1)
    assert second.written


def test_cancelling_what_has_ended_changes_nothing():
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
def test_a_timeout_that_never_passes_is_refused_before_a_byte(timeout):
    talk = Framed()
    with pytest.raises(OutOfRangeError, match="seconds above 0"):
        talk.ask(timeout=timeout)
    with pytest.raises(OutOfRangeError, match="seconds above 0"):
        talk.move(timeout=timeout)
    assert talk.wrote == b""
    assert talk.move().written  # the refused one is not under way


def test_an_address_that_is_none_is_refused_before_a_byte():
    talk = Framed()
    for wrong in (0x80, -1):
        with pytest.raises(OutOfRangeError, match="address"):
            talk.ask(dest=wrong)
    assert talk.later(5) == b""


@pytest.mark.parametrize("name", ["pacing", "quiet", "silence", "drain", "reply_timeout"])
def test_options_are_numbers_of_seconds(name):
    for wrong in (-1, float("nan"), float("inf"), "1"):
        with pytest.raises(OutOfRangeError, match=name):
            Framed(**{name: wrong})
