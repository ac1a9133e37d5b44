"""Keep-alive messages: a controller falls silent without them (pages 80 and 105)."""

from __future__ import annotations

import pytest
from apt_host import BAY, USB

from stagewire_apt import messages as m
from stagewire_virtual.options import LinkKind

LIMIT = 50  # page 80


def updates(far, seconds):
    far.clock.advance(seconds)
    return len(far.heard())


@pytest.mark.parametrize(
    ("unit", "alive"),
    [
        ("TDC001", m.MotAckDcStatusUpdate()),
        ("BSC001", m.MotAckDcStatusUpdate()),
        ("TSG001", m.PzAckPzStatusUpdate()),
        ("BPC301", m.PzAckPzStatusUpdate()),
    ],
)
def test_updates_stop_after_50_messages_until_a_keep_alive(unit, alive, host):
    far = host(unit)
    far.say(m.HwStartUpdateMsgs(10))
    assert updates(far, 60) == LIMIT
    far.say(alive)
    assert updates(far, 1) == 10
    far.say(alive)
    assert updates(far, 60) == LIMIT


def test_a_keep_alive_every_second_is_enough(host):
    far = host("TDC001")
    far.say(m.HwStartUpdateMsgs(10))
    for _ in range(60):
        assert updates(far, 1) == 10
        far.say(m.MotAckDcStatusUpdate())


@pytest.mark.parametrize("unit", ["TPZ001", "TSC001", "BPC201"])
def test_a_unit_without_keep_alive_messages_never_falls_silent(unit, host):
    far = host(unit)
    far.say(m.HwStartUpdateMsgs(10))
    assert updates(far, 60) == 600


def test_rs_232_requires_no_keep_alive(host):
    far = host("TDC001", line=LinkKind.RS232)
    far.say(m.HwStartUpdateMsgs(10))
    assert updates(far, 60) == 600


def test_the_keep_alive_of_another_kind_of_unit_has_no_effect(host):
    far = host("TDC001")
    far.say(m.HwStartUpdateMsgs(10))
    assert updates(far, 60) == LIMIT
    far.say(m.PzAckPzStatusUpdate())
    assert updates(far, 1) == 0


def test_completions_count_and_are_withheld(host):
    far = host("TDC001")
    for _ in range(LIMIT - 2):
        assert len(far.ask(m.MotMoveStop(1, 1))) == 1
    far.say(m.HwStartUpdateMsgs(10))
    assert updates(far, 1) == 2
    assert far.ask(m.MotMoveStop(1, 1)) == []
    far.say(m.MotAckDcStatusUpdate())
    assert len(far.ask(m.MotMoveStop(1, 1))) == 1


def test_requested_statuses_are_sent_and_not_counted(host):
    far = host("TDC001")
    for _ in range(2 * LIMIT):
        assert len(far.ask(m.MotReqDcStatusUpdate(1))) == 1
    far.say(m.HwStartUpdateMsgs(10))
    assert updates(far, 60) == LIMIT
    assert len(far.ask(m.MotReqDcStatusUpdate(1))) == 1
    assert len(far.ask(m.HwReqInfo())) == 1


def test_each_bay_counts_separately(host):
    far = host("BBD102")
    for bay in (BAY, BAY + 1):
        far.say(m.HwStartUpdateMsgs(10), bay)
    for _ in range(10):
        far.clock.advance(1)
        far.say(m.MotAckDcStatusUpdate(), BAY + 1)
    sources = [frame.source for frame in far.heard()]
    assert (sources.count(BAY), sources.count(BAY + 1)) == (LIMIT, 100)


def test_a_unit_with_two_channels_counts_the_messages_of_both(host):
    far = host("BSC002")
    far.say(m.HwStartUpdateMsgs(10), USB)
    assert updates(far, 60) == LIMIT


def test_a_power_cycle_resets_the_count(host):
    far = host("TDC001")
    far.say(m.HwStartUpdateMsgs(10))
    assert updates(far, 60) == LIMIT
    far.instrument.power_cycle()
    far.say(m.HwStartUpdateMsgs(10))
    assert updates(far, 60) == LIMIT
