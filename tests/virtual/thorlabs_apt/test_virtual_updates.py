"""Status messages: periodic updates, answers to requests, and silence after HW_DISCONNECT."""

from __future__ import annotations

import copy

import pytest
from apt_host import BAY, MOTHERBOARD, Host
from parameter_sets import address_of, idents_of

from stagewire_apt import PROTOCOL
from stagewire_apt import messages as m
from stagewire_virtual.clock import SteppedClock
from stagewire_virtual.factory import why_not
from stagewire_virtual.instrument import units_of
from stagewire_virtual.thorlabs_apt.facts import class_of
from stagewire_virtual.thorlabs_apt.instrument import AptInstrument

UNITS = {name: unit for name, unit in units_of(PROTOCOL).items() if not why_not(unit)}
COMMON = ("KIM101", "TIM101")
"""The units with one status message for all channels."""
STATUS = {
    "stepper": m.MotGetStatusUpdate,
    "dc": m.MotGetDcStatusUpdate,
    "piezo": m.PzGetPzStatusUpdate,
}


def _status(unit):
    """Return the class of the updates; some units of Issue 37 have another one, or send it longer."""
    if "PZMOT_GET_STATUSUPDATE" in UNITS[unit].messages:
        return class_of(UNITS[unit], "PZMOT_GET_STATUSUPDATE")
    status = STATUS[UNITS[unit].facts["status"]]
    return class_of(UNITS[unit], status.layout.message)


def _channels_in(frames, unit):
    """Return the channels of status messages, or of the only one."""
    if unit in COMMON:
        [frame] = frames
        return [getattr(frame.message, f"chan_ident_{number}") for number in (1, 2, 3, 4)]
    return [frame.message.chan_ident for frame in frames]


@pytest.mark.parametrize("unit", [name for name in UNITS if "status" in UNITS[name].facts])
def test_updates_are_sent_ten_times_a_second_for_each_channel(unit, host):
    far = host(unit)
    address = address_of(unit)
    far.say(m.HwStartUpdateMsgs(10), address)
    for _ in range(5):
        far.clock.advance(0.0999)
        assert far.heard() == []
        far.clock.advance(0.0001)
        frames = far.heard()
        assert {type(frame.message) for frame in frames} == {_status(unit)}
        assert _channels_in(frames, unit) == idents_of(unit)
        assert {frame.source for frame in frames} == {address}
    far.say(m.HwStopUpdateMsgs(), address)
    far.clock.advance(1.0)
    assert far.heard() == []


def test_a_unit_without_a_rate_uses_that_of_the_message():
    registry = copy.deepcopy(PROTOCOL.registry())
    [facts] = [unit for unit in registry["units"] if unit["name"] == "TDC001"]
    [start] = [entry for entry in registry["messages"] if entry["name"] == "HW_START_UPDATEMSGS"]
    del facts["update_rate_hz"]
    start["exchange"]["periodic_ms"] = 250
    far = Host(AptInstrument(units_of(PROTOCOL, registry)["TDC001"], SteppedClock()))
    far.say(m.HwStartUpdateMsgs(10))
    far.clock.advance(1)
    assert len(far.heard()) == 4


def test_a_second_start_keeps_the_timing_and_changes_the_address(host):
    far = host("TDC001")
    far.say(m.HwStartUpdateMsgs(10))
    far.clock.advance(0.06)
    far.say(m.HwStartUpdateMsgs(1), BAY)
    far.clock.advance(0.04)
    assert [frame.source for frame in far.heard()] == [BAY]
    far.clock.advance(0.2)
    assert len(far.heard()) == 2


def test_after_a_restart_the_first_update_comes_after_a_whole_period(host):
    far = host("TDC001")
    far.say(m.HwStartUpdateMsgs(10))
    far.clock.advance(0.06)
    far.say(m.HwStopUpdateMsgs())
    far.say(m.HwStartUpdateMsgs(10))
    far.clock.advance(0.0999)
    assert far.heard() == []
    far.clock.advance(0.0001)
    assert len(far.heard()) == 1


def test_updates_do_not_depend_on_the_steps_of_time(host):
    early, late = host("BSC002"), host("BSC002")
    for far in (early, late):
        far.say(m.HwStartUpdateMsgs(10))
        far.say(m.MotMoveVelocity(2, 1))
    for _ in range(100):
        early.clock.advance(0.01)
    late.clock.advance(1.0)
    assert late.heard_raw() == early.heard_raw() != []


@pytest.mark.parametrize(
    ("unit", "request_", "idents"),
    [
        ("TDC001", m.MotReqDcStatusUpdate(1), [1]),
        ("BSC002", m.MotReqStatusUpdate(2), [2]),
        ("BSC002", m.MotReqStatusUpdate(3), [1, 2]),
        ("TDC001", m.MotReqDcStatusUpdate(2), []),
        ("TDC001", m.MotReqStatusUpdate(1), []),  # not in its list
    ],
)
def test_a_status_is_sent_on_request(unit, request_, idents, host):
    assert [message.chan_ident for message in host(unit).ask(request_)] == idents


def test_a_bay_sends_only_its_own_updates(host):
    far = host("BBD103")
    far.say(m.HwStartUpdateMsgs(10), BAY + 2)
    far.say(m.HwStartUpdateMsgs(10), MOTHERBOARD)
    far.clock.advance(0.1)
    assert [frame.source for frame in far.heard()] == [BAY + 2]


def test_after_disconnect_nothing_is_sent_until_the_next_message(host):
    far = host("BBD102")
    for bay in (BAY, BAY + 1):
        far.say(m.HwStartUpdateMsgs(10), bay)
    far.say(m.MotMoveRelative(1, 1000), BAY)
    far.say(m.HwDisconnect(), MOTHERBOARD)
    far.clock.advance(60)
    assert far.heard() == []
    assert len(far.ask(m.MotReqDcStatusUpdate(1), BAY)) == 1
    far.clock.advance(1)
    assert far.heard() == []  # updates must be started again
    far.say(m.HwStartUpdateMsgs(10), BAY)
    far.clock.advance(0.1)
    assert len(far.heard()) == 1


def test_a_power_cycle_ends_the_updates(host):
    far = host("TDC001")
    far.say(m.HwStartUpdateMsgs(10))
    far.instrument.power_cycle()
    far.clock.advance(1)
    assert far.heard() == []
