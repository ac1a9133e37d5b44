"""SUSPEND and RESUME of end-of-move messages and error responses (pages 82 and 83)."""

from __future__ import annotations

import pytest
from apt_host import BAY

from stagewire_apt import messages as m

STOP = m.MotMoveStop(1, 1)


def test_suspended_messages_are_not_sent_until_resumed(host):
    far = host("TDC001")
    far.say(m.MotSuspendEndOfMoveMsgs())
    assert far.ask(STOP) == []
    far.say(m.MotResumeEndOfMoveMsgs())
    assert [type(message) for message in far.ask(STOP)] == [m.MotMoveStoppedDc]


def test_suspended_messages_are_lost(host):
    far = host("TDC001")
    far.say(m.MotSuspendEndOfMoveMsgs())
    far.say(STOP)
    assert far.ask(m.MotResumeEndOfMoveMsgs()) == []


def test_answers_and_updates_are_not_suspended(host):
    far = host("TDC001")
    far.say(m.MotSuspendEndOfMoveMsgs())
    far.say(m.HwStartUpdateMsgs(10))
    assert len(far.ask(m.MotReqDcStatusUpdate(1))) == 1
    far.clock.advance(0.1)
    assert [type(message) for message in far.messages()] == [m.MotGetDcStatusUpdate]


def test_stopping_updates_does_not_mute_requests(host):
    far = host("TDC001")
    far.say(m.HwStopUpdateMsgs())
    assert len(far.ask(m.MotReqDcStatusUpdate(1))) == 1


def test_error_responses_are_also_suspended(host):
    far = host("TDC001", answer_unsupported=True)
    assert far.ask(m.PzReqMaxTravel(1)) == [m.HwResponse()]
    far.say(m.MotSuspendEndOfMoveMsgs())
    assert far.ask(m.PzReqMaxTravel(1)) == []
    far.instrument.receive(bytes.fromhex("ff 0f 00 00 50 01"))
    assert far.heard() == []


def test_each_bay_is_suspended_separately(host):
    far = host("BBD102")
    far.say(m.MotSuspendEndOfMoveMsgs(), BAY)
    assert far.ask(STOP, BAY) == []
    assert len(far.ask(STOP, BAY + 1)) == 1


def test_a_power_cycle_resumes(host):
    far = host("TDC001")
    far.say(m.MotSuspendEndOfMoveMsgs())
    far.instrument.power_cycle()
    assert len(far.ask(STOP)) == 1


@pytest.mark.parametrize("unit", ["TPZ001", "BPC201"])
def test_a_unit_without_suspend_is_not_muted(unit, host):
    far = host(unit, answer_unsupported=True)
    assert far.ask(m.MotSuspendEndOfMoveMsgs()) == [m.HwResponse()]
    assert far.ask(m.MotSuspendEndOfMoveMsgs()) == [m.HwResponse()]
