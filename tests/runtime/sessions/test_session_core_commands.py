"""Commands: one read at a time, stops at any time, poison until the line was silent, and modes."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from stepped_core import Commands

from stagewire.errors import (
    BadValueError,
    OutOfRangeError,
    ReplyTimeoutError,
    StagewireError,
    WrongModeError,
)
from stagewire.framing import Garbage
from stagewire_ms2000 import enumerations
from stagewire_ms2000 import messages as c

X, Y = enumerations.Axis.X, enumerations.Axis.Y
POSITION = bytes((160, 134, 1))  # 100000
READ_X = c.ReadMotorPosition().pack(X)
READ_Y = c.ReadMotorPosition().pack(Y)
START = c.StartMotor().pack(X)
STOP = c.StopMotor().pack(X)
TO_LOW, TO_HIGH = c.SwitchToLowLevel(), c.SwitchToHighLevel()


@given(st.lists(st.integers(0, 3), max_size=6))
def test_a_reply_in_any_chunks_answers_the_outstanding_read(sizes):
    talk = Commands()
    asked = talk.ask(c.ReadMotorPosition(), X)
    assert talk.wrote == READ_X
    rest = POSITION
    for size in (*sizes, 3):
        talk.hear(rest[:size])
        rest = rest[size:]
    assert asked.value() == c.ReadMotorPositionReply(100_000)
    assert talk.core.due is None or talk.core.due > talk.now


def test_reads_are_sent_one_at_a_time_in_order():
    talk = Commands()
    first, second = talk.ask(c.ReadMotorPosition(), X), talk.ask(c.ReadMotorPosition(), Y)
    assert talk.wrote == READ_X
    assert talk.hear(POSITION) == READ_Y
    talk.hear(bytes(3))
    assert first.value().position == 100_000
    assert second.value().position == 0


def test_a_write_waits_for_an_earlier_read():
    talk = Commands()
    talk.ask(c.ReadMotorPosition(), X)
    sent = talk.send(c.StartMotor(), X)
    assert (sent.written, sent.done) == (False, False)
    assert talk.hear(POSITION) == START
    assert sent.value() is None


def test_writes_are_paced_and_reads_are_not():
    talk = Commands(pacing=0.02)
    talk.send(c.StartMotor(), X)
    asked = talk.ask(c.ReadMotorPosition(), X)
    assert not asked.written
    assert talk.later(0.02) == READ_X
    assert talk.hear(POSITION) == b""
    assert talk.ask(c.ReadMotorPosition(), Y).written


def test_the_pause_after_a_write_begins_when_the_bytes_were_written():
    talk = Commands(pacing=0.02)
    talk.send(c.StartMotor(), X)
    talk.now += 0.015
    talk.core.wrote(talk.now)
    talk.ask(c.ReadMotorPosition(), X)
    assert talk.later(0.019) == b""
    assert talk.later(0.001) == READ_X
    talk.core.wrote(talk.now + 5)  # no pause after a read
    assert talk.hear(POSITION) == b""
    assert talk.ask(c.ReadMotorPosition(), Y).written


@pytest.mark.parametrize("came", [0, 1, 2])
def test_a_stop_is_sent_at_any_time_without_shifting_replies(came):
    talk = Commands(pacing=5)
    talk.send(c.StartMotor(), X)
    talk.later(5)
    asked = talk.ask(c.ReadMotorPosition(), X, timeout=60)
    waiting = talk.ask(c.ReadMotorPosition(), Y, timeout=60)
    talk.hear(POSITION[:came])
    stop = talk.core.halt(c.StopMotor(), X, 1.0, talk.now)
    assert talk.flush() == STOP
    assert stop.done
    talk.hear(POSITION[came:])
    assert asked.value().position == 100_000
    assert not waiting.done


def test_a_stop_is_sent_first_even_on_a_poisoned_line():
    talk = Commands()
    talk.hear(b"?")
    talk.ask(c.ReadMotorPosition(), X)
    talk.core.send(c.StartMotor(), X, 1.0, talk.now)
    talk.core.halt(c.StopMotor(), X, 1.0, talk.now)
    assert talk.flush() == STOP


def test_a_cancelled_stop_is_still_written():
    talk = Commands()
    stop = talk.core.halt(c.StopMotor(), X, 1.0, talk.now)
    talk.core.cancel(stop, talk.now)
    assert talk.flush() == STOP


def test_a_silent_controller_causes_a_timeout():
    talk = Commands()
    asked = talk.ask(c.ReadMotorPosition(), X, timeout=0.5)
    talk.hear(POSITION[:2])
    talk.later(0.4)
    assert not asked.done
    talk.later(0.1)
    with pytest.raises(ReplyTimeoutError) as refused:
        asked.value()
    text = str(refused.value)
    assert f"READ_MOTOR_POSITION ({READ_X.hex(' ')}) was sent" in text
    assert "within 0.5 s (received only a0 86)" in text
    assert talk.core.statistics.garbage == 2


def test_a_late_reply_is_discarded_and_never_matched_to_the_next_read():
    talk = Commands(drain=0.2)
    talk.ask(c.ReadMotorPosition(), X)
    talk.later(1)
    again = talk.ask(c.ReadMotorPosition(), Y)
    assert not again.written
    talk.later(0.1)
    talk.hear(POSITION)
    assert talk.later(0.1999) == b""
    assert talk.later(0.0001) == READ_Y
    talk.hear(bytes(3))
    assert again.value().position == 0


def test_the_silence_counts_from_the_last_byte():
    talk = Commands(drain=0.2)
    talk.ask(c.ReadMotorPosition(), X)
    talk.later(1)
    again = talk.ask(c.ReadMotorPosition(), Y)
    for _ in range(4):
        talk.later(0.15)
        assert talk.hear(b"\1") == b""
    assert talk.later(0.2) == READ_Y
    assert again.written


def test_after_an_early_timeout_the_late_reply_is_awaited_for_the_usual_time():
    talk = Commands(drain=0.2, reply_timeout=1.0)
    talk.ask(c.ReadMotorPosition(), X, timeout=0.05)
    talk.later(0.05)
    again = talk.ask(c.ReadMotorPosition(), Y, timeout=2)
    talk.later(0.7)
    assert talk.hear(POSITION) == b""
    assert talk.later(0.2) == READ_Y
    talk.hear(bytes(3))
    assert again.value().position == 0


def test_noise_does_not_count_as_the_late_reply():
    talk = Commands(drain=0.2, reply_timeout=1.0)
    talk.ask(c.ReadMotorPosition(), X, timeout=0.05)
    talk.later(0.05)
    again = talk.ask(c.ReadMotorPosition(), Y, timeout=3)
    talk.hear(b"\xff")
    assert talk.later(0.5) == b""  # although the line was silent long enough
    talk.hear(POSITION)
    assert talk.later(0.2) == READ_Y
    talk.hear(bytes(3))
    assert again.value().position == 0


def test_without_a_late_reply_the_silence_counts_from_its_usual_time():
    talk = Commands(drain=0.2, reply_timeout=1.0)
    talk.ask(c.ReadMotorPosition(), X, timeout=0.05)
    talk.later(0.05)
    talk.ask(c.ReadMotorPosition(), Y, timeout=2)
    assert talk.later(1.1499) == b""
    assert talk.later(0.0001) == READ_Y


def test_unexpected_bytes_poison_the_line_and_are_dispatched():
    talk = Commands(drain=0.2)
    news = talk.core.subscribe()
    talk.hear(b"hello")
    asked = talk.ask(c.ReadMotorPosition(), X)
    assert not asked.written
    assert news.take() == Garbage(b"hello")
    assert talk.later(0.2) == READ_X


def test_bytes_after_a_reply_poison_the_line():
    talk = Commands(drain=0.2)
    asked = talk.ask(c.ReadMotorPosition(), X)
    talk.hear(POSITION + b"!")
    assert asked.done
    assert not talk.ask(c.ReadMotorPosition(), Y).written


def test_writes_are_sent_on_a_poisoned_line():
    talk = Commands()
    talk.hear(b"?")
    assert talk.send(c.StartMotor(), X).done


def test_the_timeout_of_an_unsent_read_names_the_reason():
    talk = Commands(drain=5)
    talk.hear(b"?")
    asked = talk.ask(c.ReadMotorPosition(), X, timeout=1)
    assert talk.later(1) == b""
    assert "was not sent within 1 s: the line was not silent for long enough" in str(asked.error)
    assert talk.later(60) == b""


def test_cancelling_reads_before_and_after_they_were_sent():
    talk = Commands(drain=0.2, reply_timeout=0.3)
    sent, waiting = talk.ask(c.ReadMotorPosition(), X), talk.ask(c.ReadStatus(), X)
    talk.cancel(waiting)
    talk.cancel(sent)
    talk.cancel(sent)
    assert [type(one.error) for one in (sent, waiting)] == [StagewireError] * 2
    again = talk.ask(c.ReadMotorPosition(), Y)
    assert not again.written
    talk.hear(POSITION)
    assert talk.later(0.2) == READ_Y
    assert talk.core.statistics.cancelled == 2


def test_nothing_is_sent_while_the_mode_is_unknown():
    talk = Commands(low_level=False)
    assert talk.core.mode == "unknown"
    for refused in (
        lambda: talk.ask(c.ReadStatus(), X),
        lambda: talk.send(c.StartMotor(), X),
        lambda: talk.text("WHERE X"),
    ):
        with pytest.raises(WrongModeError, match="was not sent: it is unknown"):
            refused()
    assert talk.later(10) == b""


def test_a_stop_is_sent_in_any_mode_and_restores_text_mode():
    talk = Commands(low_level=False)
    stop = c.StopMotor().pack(X)
    assert talk.core.halt(c.StopMotor(), X, 1.0, talk.now).done is False
    assert talk.later(0) == bytes((255, 66)) + stop
    assert talk.core.mode == "low_level"
    talk.send(TO_HIGH, None)
    talk.later(1)
    asked = talk.text("WHERE X")
    talk.core.halt(c.StopMotor(), X, 1.0, talk.now)
    assert talk.later(0) == bytes((255, 66)) + stop + bytes((255, 65))
    assert talk.core.mode == "high_level"
    talk.hear(b":A 0\r\n")
    assert asked.value() == ":A 0"


def test_setup_commands_switch_the_mode():
    talk = Commands(low_level=False)
    talk.send(TO_HIGH, None)
    assert talk.wrote == bytes((255, 65))
    assert talk.core.mode == "high_level"
    with pytest.raises(
        WrongModeError, match="READ_STATUS was not sent: the controller accepts only lines"
    ):
        talk.ask(c.ReadStatus(), X)
    talk.later(1)
    talk.send(TO_LOW, None)
    assert talk.core.mode == "low_level"
    with pytest.raises(WrongModeError, match="switch it to the high-level format first"):
        talk.text("WHERE X")
    talk.later(1)
    talk.send(c.ResetController(), None)
    assert talk.core.mode == "unknown"


def test_calls_after_a_waiting_switch_need_its_mode():
    talk = Commands()
    talk.ask(c.ReadMotorPosition(), X)
    talk.send(TO_HIGH, None)
    assert talk.core.mode == "low_level"
    with pytest.raises(WrongModeError):
        talk.send(c.StartMotor(), X)
    line = talk.text("WHERE X")
    assert talk.hear(POSITION) == bytes((255, 65))
    assert talk.later(1) == b"WHERE X\r"
    assert line.written


def test_calls_after_a_cancelled_switch_are_not_sent():
    talk = Commands()
    talk.ask(c.ReadMotorPosition(), X)
    switch = talk.send(TO_HIGH, None)
    line = talk.text("WHERE X")
    talk.cancel(switch)
    assert talk.hear(POSITION) == b""
    with pytest.raises(WrongModeError):
        line.value()


@pytest.mark.parametrize("end", [b"\r\n", b"\n"])
def test_a_line_answers_a_line_of_text(end):
    talk = Commands(low_level=False)
    talk.send(TO_HIGH, None)
    talk.later(1)
    first, second = talk.text("WHERE X"), talk.text("WHERE Y")
    assert talk.wrote.endswith(b"WHERE X\r")
    assert talk.hear(b":A 1234.5", b" ") == b""
    assert talk.hear(end) == b"WHERE Y\r"
    assert first.value() == ":A 1234.5 "
    talk.hear(b":A 1" + end)
    assert second.value() == ":A 1"


def test_a_late_line_of_text_is_discarded():
    talk = Commands(low_level=False)
    talk.send(TO_HIGH, None)
    talk.later(1)
    late = talk.text("WHERE X")
    talk.hear(b":A ")
    talk.later(1)
    assert "WHERE X" in str(late.error)
    assert "3a 41 20" in str(late.error)
    again = talk.text("WHERE Y")
    talk.hear(b"1234\r\n")
    assert talk.later(0.2) == b"WHERE Y\r"
    talk.hear(b":A 5\r\n")
    assert again.value() == ":A 5"


def test_an_endless_line_of_text_takes_bounded_memory():
    talk = Commands(low_level=False)
    talk.send(TO_HIGH, None)
    talk.later(1)
    asked = talk.text("WHERE X", timeout=600)
    for _ in range(1000):
        talk.hear(b"x" * 100)
    assert len(talk.core._text) <= 4096
    assert talk.core.statistics.garbage == 100_000 - 4096
    talk.hear(b"\r\n")
    assert len(asked.value()) == 4096


@pytest.mark.parametrize(
    "line", ["", "two\rlines", "tab\t", "µm", "\xff\x41", "x" * 5000, b"WHERE X", None]
)
def test_invalid_lines_of_text(line):
    talk = Commands(low_level=False)
    talk.send(TO_HIGH, None)
    with pytest.raises(BadValueError, match="printable ASCII"):
        talk.text(line)


def test_ask_requires_a_reply_and_send_requires_none():
    talk = Commands()
    with pytest.raises(BadValueError, match="READ_STATUS has a reply"):
        talk.send(c.ReadStatus(), X)
    with pytest.raises(BadValueError, match="STOP_MOTOR has no reply"):
        talk.ask(c.StopMotor(), X)
    with pytest.raises(BadValueError, match="cannot be sent ahead of others"):
        talk.core.halt(c.ReadStatus(), X, 1.0, talk.now)
    with pytest.raises(OutOfRangeError):
        talk.ask(c.ReadStatus(), 300)
    with pytest.raises(OutOfRangeError, match="seconds above 0"):
        talk.ask(c.ReadStatus(), X, timeout=0)
    assert talk.wrote == b""


def test_values_that_look_like_setup_commands_are_refused_on_request():
    position = int.from_bytes(bytes((255, 65, 0)), "little", signed=True)
    assert Commands().send(c.WriteTargetPosition(position), X).written
    talk = Commands(refuse_prefix_bytes=True)
    with pytest.raises(OutOfRangeError):
        talk.send(c.WriteTargetPosition(position), X)
    assert talk.wrote == b""
