"""End-of-move messages and faults are suspended and resumed (pages 82 and 83)."""

from __future__ import annotations

import pytest
from apt_host import BAY

from stagewire_apt import messages as m

STOP = m.MotMoveStop(1, 1)


def test_what_is_suspended_does_not_come_until_it_is_resumed(host):
    far = host("TDC001")
    far.say(m.MotSuspendEndOfMoveMsgs())
    assert far.ask(STOP) == []
    far.say(m.MotResumeEndOfMoveMsgs())
    assert [type(message) for message in far.ask(STOP)] == [m.MotMoveStoppedDc]


def test_it_is_lost_not_kept_for_later(host):
    far = host("TDC001")
    far.say(m.MotSuspendEndOfMoveMsgs())
    far.say(STOP)
    assert far.ask(m.MotResumeEndOfMoveMsgs()) == []


def test_answers_and_updates_go_on(host):
    far = host("TDC001")
    far.say(m.MotSuspendEndOfMoveMsgs())
    far.say(m.HwStartUpdateMsgs(10))
    assert len(far.ask(m.MotReqDcStatusUpdate(1))) == 1
    far.clock.advance(0.1)
    assert [type(message) for message in far.messages()] == [m.MotGetDcStatusUpdate]


def test_the_end_of_updates_mutes_no_request(host):
    far = host("TDC001")
    far.say(m.HwStopUpdateMsgs())
    assert len(far.ask(m.MotReqDcStatusUpdate(1))) == 1


def test_responses_to_faults_are_suspended_too(host):
    far = host("TDC001", answer_unsupported=True)
    assert far.ask(m.PzReqMaxTravel(1)) == [m.HwResponse()]
    far.say(m.MotSuspendEndOfMoveMsgs())
    assert far.ask(m.PzReqMaxTravel(1)) == []
    far.instrument.receive(bytes.fromhex("ff 0f 00 00 50 01"))
    assert far.heard() == []


def test_it_is_a_matter_of_each_bay(host):
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
def test_a_unit_without_the_message_is_not_muted_by_it(unit, host):
    far = host(unit, answer_unsupported=True)
    assert far.ask(m.MotSuspendEndOfMoveMsgs()) == [m.HwResponse()]
    assert far.ask(m.MotSuspendEndOfMoveMsgs()) == [m.HwResponse()]
