"""Motions: one per channel, their ends, stops, and the unknown state after a timeout."""

from __future__ import annotations

import pytest
from stepped_core import MOVED, Framed, dc_status, said

from stagewire.errors import (
    ControllerFaultError,
    MotionStoppedError,
    MotionTimeoutError,
    MotionUnderWayError,
    ReplyTimeoutError,
)
from stagewire.sessions import Ends
from stagewire_apt import messages as m
from undocumented import HwUnprinted

COMPLETED = said(m.MotMoveCompletedHeader(1))
STOPPED_HERE = m.MotMoveStoppedHeader(1)
STOPPED = said(STOPPED_HERE)
MOVE = m.MotMoveAbsolute(1, 1000).pack(0x50, 1)
STOP = m.MotMoveStop(1, 2).pack(0x50, 1)


def test_a_motion_ends_with_its_completion():
    talk = Framed()
    move = talk.move()
    assert talk.wrote == MOVE
    talk.later(30)
    assert not move.done
    talk.hear(COMPLETED)
    assert move.value().message == m.MotMoveCompletedHeader(1)


def test_a_motion_stopped_by_something_else_raises():
    talk = Framed()
    move = talk.move()
    talk.hear(STOPPED)
    with pytest.raises(
        MotionStoppedError, match="MOT_MOVE_ABSOLUTE was stopped before its end"
    ) as stopped:
        move.value()
    assert stopped.value.message == STOPPED_HERE
    assert talk.move().written is False  # paced, not refused


def test_homing_ends_with_homed_but_not_with_completed():
    talk = Framed()
    ends = Ends(completed=(m.MotMoveHomed,), stopped=MOVED.stopped)
    home = talk.core.begin(m.MotMoveHome(1), ends, 0x50, 60, talk.now)
    talk.flush()
    talk.hear(COMPLETED)
    assert not home.done
    talk.hear(said(m.MotMoveHomed(1)))
    assert home.value().message == m.MotMoveHomed(1)


def test_an_end_before_the_command_was_written_is_ignored():
    talk = Framed()
    talk.send()  # pacing delays the move
    move = talk.move()
    talk.hear(COMPLETED)
    assert (move.written, move.done) == (False, False)
    talk.later(0.01)
    assert move.written
    talk.hear(COMPLETED)
    assert move.done


def test_a_motion_whose_end_is_not_reported_ends_when_written():
    talk = Framed()
    move = talk.move(ends=Ends())
    assert move.done
    assert move.value() is None
    talk.later(1)
    assert talk.move().written


def test_a_second_motion_on_a_channel_is_refused_before_writing():
    talk = Framed()
    talk.move()
    talk.later(1)
    with pytest.raises(
        MotionUnderWayError, match="MOT_MOVE_ABSOLUTE is in progress on channel 1 of 0x50"
    ):
        talk.move()
    assert talk.wrote == MOVE
    assert talk.move(chan_ident=2).written
    assert talk.move(0x21).written


def test_a_motion_that_waits_to_be_sent_counts_as_in_progress():
    talk = Framed()
    talk.send()
    talk.move()
    with pytest.raises(MotionUnderWayError):
        talk.move()


def test_after_an_end_another_may_begin():
    talk = Framed()
    talk.move()
    talk.hear(COMPLETED)
    talk.later(1)
    assert talk.move().written


def test_a_motion_that_times_out_is_unknown():
    talk = Framed()
    move = talk.move(timeout=10)
    for _ in range(3):
        talk.later(3)
        talk.hear(said(dc_status()), said(m.MotGetStatusBits(1, 0)))
    talk.later(1)
    with pytest.raises(MotionTimeoutError) as refused:
        move.value()
    text = str(refused.value)
    assert "no MOT_MOVE_COMPLETED or MOT_MOVE_STOPPED arrived from there within 10 s" in text
    assert "3 x MOT_GET_DCSTATUSUPDATE, 3 x MOT_GET_STATUSBITS" in text
    assert "may still be in progress" in text
    with pytest.raises(MotionUnderWayError, match="given up before its end was reported"):
        talk.move()
    talk.later(3600)  # time alone does not stop a motor
    with pytest.raises(MotionUnderWayError):
        talk.move()


def rich(
    request: int = 0, code: int = 7, text: bytes = b"over current", source: int = 0x50
) -> bytes:
    """Return HW_RICHRESPONSE."""
    data = request.to_bytes(2, "little") + code.to_bytes(2, "little") + text.ljust(64, b"\0")
    return m.HwRichResponse.unpack(bytes(6) + data).pack(0x01, source)


@pytest.mark.parametrize(
    ("report", "code", "fault", "shown"),
    [
        (said(m.HwResponse()), 0, "", "HW_RESPONSE without a code"),
        (said(m.HwResponse(param1=3, param2=1)), 0x103, "", "HW_RESPONSE code 259"),
        (rich(), 7, "over current", "HW_RICHRESPONSE code 7, 'over current'"),
        (rich(0x0453), 7, "over current", "code 7, 'over current'"),
        (rich(text=b"\xff\x00"), 7, "ff", "code 7, 'ff'"),
        (HwUnprinted(b"").pack(0x01, 0x50), 0, "", "without a code"),
        (said(m.HwResponse(), source=1, dest=0x50), 0, "", "HW_RESPONSE"),  # unswapped
        (said(m.HwResponse(), source=0, dest=0), 0, "", "HW_RESPONSE"),
    ],
)
def test_a_fault_report_ends_the_wait_but_not_the_motion(
    report: bytes, code: int, fault: str, shown: str
) -> None:
    talk = Framed()
    move = talk.move()
    talk.later(1)
    talk.hear(report)
    with pytest.raises(ControllerFaultError) as caught:
        move.value()
    assert (caught.value.code, caught.value.fault) == (code, fault)
    assert shown in str(caught.value)
    assert "may still be in progress" in str(caught.value)
    with pytest.raises(MotionUnderWayError):
        talk.move()
    talk.hear(COMPLETED)
    talk.later(1)
    assert talk.move().written


@pytest.mark.parametrize(
    "report",
    [
        said(m.HwResponse(), source=0x22),  # from another bay
        said(m.HwResponse(), source=1, dest=0x22),
        rich(0x0443),  # about another message
    ],
)
def test_an_unrelated_fault_report_ends_no_wait(report: bytes) -> None:
    talk = Framed()
    move = talk.move()
    talk.hear(report)
    assert not move.done
    talk.hear(COMPLETED)
    assert move.value()


def test_a_fault_report_without_an_address_ends_no_wait_of_two_bays() -> None:
    talk = Framed()
    moves = [talk.move(0x21), talk.move(0x22)]
    talk.later(1)
    talk.hear(said(m.HwResponse(), source=0, dest=0))
    assert not any(move.done for move in moves)
    assert talk.core.statistics.ambiguous == 1
    talk.hear(said(m.HwResponse(), source=0x21))
    assert [move.done for move in moves] == [True, False]


def test_a_fault_report_before_the_command_ends_no_wait() -> None:
    talk = Framed()
    talk.send()  # pacing delays the move
    move = talk.move()
    talk.hear(said(m.HwResponse()))
    assert not move.done


def test_a_fault_report_answers_no_request_but_is_named_in_its_timeout() -> None:
    talk = Framed()
    ask = talk.ask()
    talk.hear(rich())
    assert not ask.done
    talk.later(2)
    with pytest.raises(ReplyTimeoutError, match=r"1 x HW_RICHRESPONSE \(code 7, 'over current'\)"):
        ask.value()


def test_a_cancelled_motion_is_unknown_until_its_late_end():
    talk = Framed()
    move = talk.move()
    talk.cancel(move)
    assert talk.wrote == MOVE  # cancelling sends nothing
    with pytest.raises(MotionUnderWayError):
        talk.move()
    talk.hear(COMPLETED)
    talk.later(1)
    assert talk.move().written


def test_a_motion_cancelled_before_it_was_sent_is_not_in_progress():
    talk = Framed()
    talk.send()
    talk.cancel(talk.move())
    again = talk.move()
    assert talk.later(1) == MOVE
    assert again.written


def test_a_motion_that_timed_out_before_it_was_sent_is_not_sent():
    talk = Framed(pacing=5)
    talk.send()
    move = talk.move(timeout=1)
    assert talk.later(10) == b""
    with pytest.raises(MotionTimeoutError, match="was not sent"):
        move.value()
    assert talk.move().written


def test_an_answered_stop_settles_an_unknown_motion():
    talk = Framed()
    talk.move(timeout=1)
    talk.later(1)
    stop = talk.halt()
    talk.hear(STOPPED)
    assert stop.value().message == STOPPED_HERE
    talk.later(1)
    assert talk.move().written


def test_settled_clears_only_unknown_motions():
    talk = Framed()
    talk.move(timeout=1)
    talk.move(0x21)
    talk.later(1)
    for dest in (0x50, 0x21):
        talk.core.settled(dest, 1)
    talk.core.settled(0x22, 1)
    assert talk.move().written
    with pytest.raises(MotionUnderWayError):
        talk.move(0x21)


def test_a_stop_ends_the_motion_when_it_is_answered():
    talk = Framed()
    move = talk.move()
    stop = talk.halt()
    assert talk.wrote == MOVE + STOP
    assert (move.done, stop.done) == (False, False)
    talk.hear(STOPPED)
    assert isinstance(move.error, MotionStoppedError)
    assert stop.value().message == STOPPED_HERE


def test_a_stop_ends_a_motion_that_does_not_list_this_end():
    talk = Framed()
    move = talk.move(ends=Ends(completed=MOVED.completed))
    talk.halt()
    talk.hear(STOPPED)
    assert isinstance(move.error, MotionStoppedError)


def test_a_motion_that_completes_before_its_stop_is_answered_has_completed():
    talk = Framed()
    move, stop = talk.move(), talk.halt()
    talk.hear(COMPLETED)
    assert move.value().message == m.MotMoveCompletedHeader(1)
    assert not stop.done
    talk.hear(STOPPED)
    assert stop.done


def test_a_stop_cancels_a_motion_that_was_not_sent():
    talk = Framed()
    talk.send()
    move = talk.move()
    talk.wrote = b""
    stop = talk.halt()
    assert isinstance(move.error, MotionStoppedError)
    assert "nothing was sent" in str(move.error)
    assert talk.later(1) == b""
    assert talk.wrote == STOP
    talk.hear(STOPPED)
    assert stop.done


def test_a_stop_ends_only_the_motion_at_its_address():
    talk = Framed()
    moves = [talk.move(bay) for bay in (0x21, 0x22)]
    talk.halt(0x22)
    talk.hear(said(STOPPED_HERE, 0x22))
    assert [move.done for move in moves] == [False, True]


def test_no_motion_begins_while_a_stop_waits_for_its_answer():
    talk = Framed()
    talk.halt()
    with pytest.raises(
        MotionUnderWayError, match="MOT_MOVE_STOP on channel 1 of 0x50 was not answered yet"
    ):
        talk.move()
    talk.hear(STOPPED)
    talk.later(1)
    assert talk.move().written


def test_an_unanswered_stop_times_out_and_the_motion_continues():
    talk = Framed()
    move, stop = talk.move(), talk.halt(timeout=0.5)
    talk.later(0.5)
    assert type(stop.error) is ReplyTimeoutError
    assert not move.done
    talk.hear(STOPPED)  # late, but still the end of that motion
    assert isinstance(move.error, MotionStoppedError)


def test_the_late_answer_to_a_stop_does_not_end_a_later_motion():
    talk = Framed(quiet=0.5)
    talk.cancel(talk.halt())
    talk.later(0.1)
    move = talk.move()
    assert move.written
    talk.hear(STOPPED * 2)  # the answer and a copy
    assert not move.done
    assert talk.core.statistics.late == 2
    talk.hear(STOPPED)  # the motion's own
    assert isinstance(move.error, MotionStoppedError)


def test_the_late_answer_to_a_stop_does_not_answer_a_later_stop():
    talk = Framed(quiet=0.5)
    talk.cancel(talk.halt())
    talk.later(0.1)
    move, stop = talk.move(), talk.halt()
    talk.hear(STOPPED)
    assert (move.done, stop.done) == (False, False)
    talk.later(0.1)
    talk.hear(STOPPED)
    assert isinstance(move.error, MotionStoppedError)
    assert stop.done


def test_after_the_quiet_period_an_end_ends_the_motion():
    talk = Framed(quiet=0.5)
    talk.cancel(talk.halt())
    talk.later(0.5)
    move = talk.move()
    talk.hear(STOPPED)
    assert isinstance(move.error, MotionStoppedError)


def test_one_answer_ends_two_stops_and_the_second_is_ignored():
    talk = Framed(quiet=0.5)
    stops = [talk.halt(), talk.halt()]
    talk.later(0.8)
    talk.hear(STOPPED)
    assert all(stop.done for stop in stops)
    talk.later(0.1)
    move = talk.move()
    talk.hear(STOPPED)
    assert not move.done


def test_a_missing_second_answer_does_not_affect_a_later_motion():
    talk = Framed(quiet=0.5)
    talk.halt(timeout=60)
    talk.halt(timeout=60)
    talk.later(10)
    talk.hear(STOPPED)
    talk.later(0.5)
    move = talk.move()
    talk.hear(STOPPED)
    assert isinstance(move.error, MotionStoppedError)


def test_a_stop_without_an_answer_ends_when_written():
    talk = Framed()
    move = talk.move()
    stop = talk.halt(ends=None)
    assert stop.done
    assert stop.value() is None
    assert not move.done


def test_a_stop_cancelled_before_it_was_written_is_still_written():
    talk = Framed()
    move = talk.move()
    stop = talk.core.halt(m.MotMoveStop(1, 2), Ends((m.MotMoveStoppedDc,)), 0x50, 1.0, talk.now)
    talk.core.cancel(stop, talk.now)
    assert talk.flush() == STOP
    talk.hear(STOPPED)
    assert isinstance(move.error, MotionStoppedError)
