"""Order of writing: stops, keep-alive messages, pacing, and the instructions to a driver."""

from __future__ import annotations

import pytest
from stepped_core import Framed, said, vel_params

from stagewire.errors import OutOfRangeError
from stagewire_apt import messages as m

ALIVE = m.MotAckDcStatusUpdate()
REQUEST = m.MotReqVelParams(1).pack(0x50, 1)
COMMAND = m.ModIdentify().pack(0x50, 1)
STOP = m.MotMoveStop(1, 2).pack(0x50, 1)


def test_nothing_is_written_without_a_call():
    talk = Framed()
    assert talk.core.due is None
    assert talk.later(3600) == b""


def test_a_message_without_a_reply_ends_when_written():
    talk = Framed()
    sent = talk.core.send(m.ModIdentify(), 0x50, 1.0, talk.now)
    assert talk.core.due is not None
    assert talk.core.due <= talk.now
    assert not sent.done
    assert talk.flush() == COMMAND
    assert (sent.done, sent.value()) == (True, None)


def test_after_a_command_without_a_reply_the_next_frame_waits():
    talk = Framed(pacing=0.05)
    talk.send()
    later = [talk.send(), talk.ask()]
    assert talk.later(0.049) == b""
    assert talk.later(0.001) == COMMAND
    assert talk.later(0.049) == b""
    assert talk.later(0.001) == REQUEST
    assert all(one.written for one in later)


def test_a_pause_begins_when_the_bytes_were_written():
    talk = Framed(pacing=0.05)
    talk.send()
    talk.now += 0.03
    talk.core.wrote(talk.now)
    later = talk.ask()
    assert talk.later(0.049) == b""
    assert talk.later(0.001) == REQUEST
    assert later.written
    talk.now += 0.03
    talk.core.wrote(talk.now)  # no pause after a request
    talk.hear(said(vel_params()))
    assert talk.ask().written


def test_after_a_move_the_next_frame_also_waits():
    talk = Framed(pacing=0.05)
    talk.move()
    assert not talk.ask().written


def test_after_a_request_the_next_frame_does_not_wait():
    talk = Framed(pacing=0.05)
    talk.ask()
    talk.hear(said(vel_params()))
    assert talk.ask().written


def test_other_addresses_are_not_paced_together():
    talk = Framed(pacing=0.05)
    talk.send(dest=0x21)
    assert talk.send(dest=0x22).written


def test_without_pacing_nothing_waits():
    talk = Framed(pacing=0)
    assert all(talk.send().written for _ in range(3))


def test_a_stop_is_written_immediately_and_first():
    talk = Framed(pacing=5)
    talk.send()
    talk.ask(timeout=60)
    for _ in range(100):
        talk.core.send(m.ModIdentify(), 0x50, 60.0, talk.now)
    talk.core.keep_alive(ALIVE, (0x50,))
    talk.core.halt(m.MotMoveStop(1, 2), None, 0x50, 1.0, talk.now)
    assert talk.core.output(talk.now) == STOP + ALIVE.pack(0x50, 1)


def test_stops_are_written_in_order():
    talk = Framed()
    for bay in (0x22, 0x21):
        talk.core.halt(m.MotMoveStop(1, 1), None, bay, 1.0, talk.now)
    assert talk.flush() == m.MotMoveStop(1, 1).pack(0x22, 1) + m.MotMoveStop(1, 1).pack(0x21, 1)


def test_keep_alive_messages_go_to_each_address_immediately():
    talk = Framed()
    talk.core.keep_alive(ALIVE, (0x21, 0x22), period=0.5)
    signs = ALIVE.pack(0x21, 1) + ALIVE.pack(0x22, 1)
    assert talk.flush() == signs
    assert talk.later(0.4999) == b""
    assert talk.later(0.0001) == signs
    assert talk.later(10) == signs * 20


def test_keep_alive_messages_are_added_and_ended_by_address():
    talk = Framed()
    talk.core.keep_alive(ALIVE, (0x21,))
    talk.flush()
    other = m.PzAckPzStatusUpdate()
    talk.core.keep_alive(other, (0x22,))
    assert talk.flush() == ALIVE.pack(0x21, 1) + other.pack(0x22, 1)
    talk.core.keep_alive(None, (0x21,))
    assert talk.later(0.5) == other.pack(0x22, 1) * 2
    talk.core.keep_alive(None, (0x22,))
    assert talk.later(10) == b""


def test_keep_alive_messages_wait_for_nothing_and_delay_nothing():
    talk = Framed(pacing=60)
    talk.send()
    talk.core.keep_alive(ALIVE, (0x50,), period=0.5)
    talk.flush()
    talk.ask(timeout=50)
    assert talk.later(1) == ALIVE.pack(0x50, 1) * 2
    other = Framed(pacing=60)
    other.core.keep_alive(ALIVE, (0x50,))
    other.flush()
    assert other.ask().written


def test_keep_alive_messages_continue_after_a_timeout():
    talk = Framed()
    talk.core.keep_alive(ALIVE, (0x50,), period=0.5)
    assert talk.flush() == ALIVE.pack(0x50, 1)
    talk.ask(timeout=0.7)
    assert talk.later(2) == ALIVE.pack(0x50, 1) * 4


def test_missed_keep_alive_messages_are_not_made_up_for():
    talk = Framed()
    talk.core.keep_alive(ALIVE, (0x50,), period=0.5)
    talk.flush()
    talk.now += 100
    talk.core.tick(talk.now)
    assert talk.flush() == ALIVE.pack(0x50, 1)


def test_keep_alive_messages_can_be_ended_and_need_a_valid_period():
    talk = Framed()
    talk.core.keep_alive(ALIVE, (0x50,))
    talk.flush()
    talk.core.keep_alive(None, ())
    assert talk.later(10) == b""
    for wrong in (0, -1, float("nan"), float("inf")):
        with pytest.raises(OutOfRangeError, match="period"):
            talk.core.keep_alive(ALIVE, (0x50,), wrong)
    with pytest.raises(OutOfRangeError, match="address"):
        talk.core.keep_alive(ALIVE, (0x80,))
    assert talk.later(10) == b""


def test_output_alone_processes_what_is_due():
    """A driver that calls output for another reason need not call tick first."""
    talk = Framed()
    asked = talk.ask(timeout=1)
    talk.now += 2
    assert talk.core.output(talk.now) == b""
    assert asked.done


def test_a_frame_whose_rest_does_not_arrive_is_given_up():
    talk = Framed(silence=0.05)
    asked = talk.ask()
    reply = said(vel_params(5))
    talk.hear(reply[:10])
    talk.later(0.06)
    assert talk.core.statistics.silences == 1
    assert talk.core.statistics.garbage >= 1
    talk.hear(reply)
    assert asked.value().message.max_velocity == 5


def test_the_rest_of_a_frame_may_arrive_in_pieces():
    talk = Framed(silence=0.05)
    asked = talk.ask()
    for byte in said(vel_params(5)):
        talk.later(0.045)
        talk.hear(bytes([byte]))
    assert asked.value().message.max_velocity == 5
    assert talk.core.statistics.silences == 0


def test_whole_frames_after_a_damaged_header_are_found_after_the_silence():
    talk = Framed(silence=0.05)
    asked = talk.ask()
    damaged = bytearray(said(m.MotGetPosCounter(1, 5)))
    damaged[2] = 200  # the packet would be 200 bytes long
    talk.hear(bytes(damaged) + said(vel_params(5)))
    assert not asked.done
    talk.later(0.05)
    assert asked.value().message.max_velocity == 5


def test_the_late_rest_of_a_frame_answers_nothing():
    talk = Framed(silence=0.05)
    asked = talk.ask()
    reply = said(vel_params(5))
    talk.hear(reply[:10])
    talk.later(0.06)
    talk.hear(reply[10:])
    assert not asked.done
