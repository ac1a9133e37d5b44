"""The end of a session: a lost link, and a session that was closed."""

from __future__ import annotations

import pytest
from stepped_core import Commands, Framed, dc_status, said, vel_params

from stagewire.errors import SessionClosedError, StagewireError, TransportLostError
from stagewire_apt import messages as m
from stagewire_ms2000 import messages as c

ENDS = {
    "lost": (lambda core, now: core.lose("/dev/ttyUSB0 is lost", now), TransportLostError),
    "closed": (lambda core, now: core.close(now), SessionClosedError),
}


@pytest.fixture(params=ENDS)
def end(request):
    return ENDS[request.param]


def test_all_exchanges_end_immediately_with_separate_errors(end):
    finish, error = end
    talk = Framed()
    waiting = [
        talk.ask(),
        talk.ask(),
        talk.ask(dest=0x21),
        talk.move(0x22),
        talk.send(),
        talk.halt(0x22),
        talk.core.halt(m.MotMoveStop(1, 2), None, 0x23, 1.0, talk.now),
    ]
    told = []
    for exchange in waiting:
        exchange.on_done = told.append
    finish(talk.core, talk.now)
    assert sorted(map(id, told)) == sorted(map(id, waiting))
    assert {type(exchange.error) for exchange in waiting} == {error}
    assert len({id(exchange.error) for exchange in waiting}) == len(waiting)
    assert talk.core.due is None


def test_the_error_states_whether_the_message_was_sent(end):
    finish, _ = end
    talk = Framed()
    sent, waiting = talk.move(), talk.ask()
    finish(talk.core, talk.now)
    assert "MOT_MOVE_ABSOLUTE was sent but not answered" in str(sent.error)
    assert "MOT_REQ_VELPARAMS was not sent" in str(waiting.error)


def test_later_exchanges_fail_and_nothing_is_written(end):
    finish, error = end
    talk = Framed()
    talk.core.keep_alive(m.MotAckDcStatusUpdate(), (0x50,))
    talk.ask()
    finish(talk.core, talk.now)
    talk.wrote = b""
    later = [talk.ask(), talk.send(), talk.move(), talk.move(), talk.halt()]
    assert {type(exchange.error) for exchange in later} == {error}
    assert not any(exchange.written for exchange in later)
    talk.core.keep_alive(m.MotAckDcStatusUpdate(), (0x50,))
    talk.core.settled(0x50, 1)
    talk.cancel(later[0])
    assert talk.later(100) == b""
    assert talk.wrote == b""


def test_bytes_after_the_end_are_ignored(end):
    finish, error = end
    talk = Framed()
    asked = talk.ask()
    news = talk.core.subscribe()
    finish(talk.core, talk.now)
    talk.hear(said(vel_params()), said(dc_status()))
    assert isinstance(asked.error, error)
    assert len(news) == 0


def test_a_lost_session_can_be_closed_and_keeps_its_first_error():
    talk = Framed()
    asked = talk.ask()
    talk.core.lose("unplugged", talk.now)
    talk.core.lose("again", talk.now)
    assert "unplugged" in str(asked.error)
    assert "unplugged" in str(talk.ask().error)
    talk.core.close(talk.now)
    assert isinstance(talk.ask().error, TransportLostError)
    assert "unplugged" in str(talk.ask().error)


def test_a_callback_may_use_the_core(end):
    finish, error = end
    talk = Framed()
    asked = talk.ask()
    found = []
    asked.on_done = lambda exchange: found.append((talk.core.due, talk.ask().error))
    finish(talk.core, talk.now)
    [(due, refused)] = found
    assert due is None
    assert isinstance(refused, error)


def test_command_exchanges_end_the_same_way(end):
    finish, error = end
    talk = Commands()
    waiting = [talk.ask(c.ReadStatus()), talk.ask(c.ReadMotorPosition()), talk.send(c.StartMotor())]
    finish(talk.core, talk.now)
    assert {type(exchange.error) for exchange in waiting} == {error}
    later = [talk.ask(c.ReadStatus()), talk.core.halt(c.StopMotor(), 24, 1.0, talk.now)]
    assert {type(exchange.error) for exchange in later} == {error}
    assert talk.hear(b"NNN") == b""
    assert talk.later(100) == b""


def test_all_errors_derive_from_stagewire_error(end):
    _, error = end
    assert issubclass(error, StagewireError)
