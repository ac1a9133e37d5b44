"""The EEPROM: saved parameter sets survive a power cycle, others do not (pages 60 and 113)."""

from __future__ import annotations

import pytest
from parameter_sets import UNITS, address_of, channel_of, plain_sets, wanted_values

from stagewire_apt import PROTOCOL
from stagewire_apt import messages as m
from stagewire_virtual.options import Settings

COUNTERS = {"MOT_SET_POSCOUNTER", "MOT_SET_ENCCOUNTER", "PZMOT_SET_POSCOUNTERS"}
VELOCITY, JOG = 0x0413, 0x0416  # ids of MOT_SET_VELPARAMS and MOT_SET_JOGPARAMS


def test_only_saved_sets_survive_a_power_cycle(host):
    far = host("BSC001")
    new_jog = far.ask(m.MotReqJogParams(1))
    far.say(m.MotSetVelParams(1, 0, 11, 22))
    far.say(m.MotSetJogParams(1, 1, 2, 3, 4, 5, 1))
    assert far.ask(m.MotSetEepromParams(1, VELOCITY)) == []
    far.say(m.MotSetVelParams(1, 0, 33, 44))  # after saving: not in the EEPROM
    far.instrument.power_cycle()
    assert far.ask(m.MotReqVelParams(1)) == [m.MotGetVelParams(1, 0, 11, 22)]
    assert far.ask(m.MotReqJogParams(1)) == new_jog


SAVING = {"MOT_SET_EEPROMPARAMS", "PZ_SET_EEPROMPARAMS"}
WITH_EEPROM = [name for name, unit in UNITS.items() if SAVING & unit.messages]


@pytest.mark.parametrize("unit", WITH_EEPROM)
def test_every_set_of_every_unit_can_be_saved(unit, host):
    far = host(unit)
    [save] = SAVING & UNITS[unit].messages
    address = address_of(unit)
    told = {}
    for set_, req, _ in plain_sets(unit):
        far.say(set_(**channel_of(set_), **wanted_values(unit, set_, 1)), address)
        told[set_.layout.message] = far.ask(req(**channel_of(req)), address)
        far.refusals.clear()
        far.say(PROTOCOL.message_class(save)(1, set_.layout.id), address)
        assert far.refusals == []
    far.instrument.power_cycle()
    for set_, req, _ in plain_sets(unit):
        saved = told[set_.layout.message]
        if set_.layout.message in COUNTERS:
            [counter] = saved
            zero = {name: 0 for name in ("position", "encoder_count") if hasattr(counter, name)}
            saved = [counter.replace(**zero)]  # counters restart at the present position
        assert far.ask(req(**channel_of(req)), address) == saved, set_.layout.message


@pytest.mark.parametrize("unit", UNITS)
def test_every_unit_forgets_unsaved_sets(unit, host):
    far, new = host(unit), host(unit)
    address = address_of(unit)
    for set_, _, _ in plain_sets(unit):
        far.say(set_(**channel_of(set_), **wanted_values(unit, set_, 1)), address)
    far.clock.advance(5)
    far.instrument.power_cycle()
    for _, req, _ in plain_sets(unit):
        assert far.ask(req(**channel_of(req)), address) == new.ask(req(**channel_of(req)), address)


def test_each_channel_saves_its_own_values(host):
    far = host("BSC002")
    new = far.ask(m.MotReqVelParams(2))
    far.say(m.MotSetVelParams(3, 0, 11, 22))
    far.say(m.MotSetEepromParams(1, VELOCITY))
    far.instrument.power_cycle()
    assert far.ask(m.MotReqVelParams(1)) == [m.MotGetVelParams(1, 0, 11, 22)]
    assert far.ask(m.MotReqVelParams(2)) == new


def test_both_channels_can_be_saved_with_one_message(host):
    far = host("BSC002")
    far.say(m.MotSetVelParams(3, 0, 11, 22))
    far.say(m.MotSetEepromParams(3, VELOCITY))
    far.instrument.power_cycle()
    assert [a.max_velocity for a in far.ask(m.MotReqVelParams(3))] == [22, 22]


def test_a_piezo_unit_has_its_own_save_message(host):
    far = host("TPZ001")
    far.say(m.PzSetTpzDispSettings(17))
    far.say(m.PzSetEepromParams(1, m.PzSetTpzDispSettings.layout.id))
    far.instrument.power_cycle()
    assert far.ask(m.PzReqTpzDispSettings()) == [m.PzGetTpzDispSettings(17)]


@pytest.mark.parametrize(
    "id", [0x0000, 0x0414, 0x0443, 0x04B9, 0x0643, 0xFFFF],
    ids=["no id", "a REQ", "no set", "the save message itself", "a SET of piezo controllers", "no message"],
)  # fmt: skip
def test_saving_an_id_that_is_not_a_set_is_refused(id, host):
    far = host("BSC001", answer_unsupported=True)
    assert far.ask(m.MotSetEepromParams(1, id)) == [m.HwResponse()]


def test_saving_an_unknown_channel_is_refused(host):
    far = host("BSC001", answer_unsupported=True)
    assert far.ask(m.MotSetEepromParams(2, VELOCITY)) == [m.HwResponse()]


def test_a_channel_is_enabled_at_power_on_unless_saved_as_disabled(host):
    far = host("BSC001")
    far.say(m.ModSetChanEnableState(1, 2))
    far.instrument.power_cycle()
    assert far.instrument.channel(1).enabled
    assert far.ask(m.ModReqChanEnableState(1)) == [m.ModGetChanEnableState(1, 1)]
    far.say(m.ModSetChanEnableState(1, 2))
    far.say(m.MotSetEepromParams(1, m.ModSetChanEnableState.layout.id))
    far.instrument.power_cycle()
    assert not far.instrument.channel(1).enabled
    assert far.ask(m.ModReqChanEnableState(1)) == [m.ModGetChanEnableState(1, 2)]


def test_a_power_cycle_discards_an_incomplete_frame(host):
    far = host("TDC001")
    far.instrument.receive(bytes.fromhex("13 04 0e 00 d0 01 01 00"))
    far.instrument.power_cycle()
    assert len(far.ask(m.HwReqInfo())) == 1


def test_a_power_cycle_does_not_move_the_stage(host):
    stage = Settings(travel=10_000, position=2_000)
    far = host("BSC001", channels=(stage,))
    for expected in (5_000, 3_000):  # the second ends at the limit, 3,000 counts further
        far.say(m.MotMoveRelative(1, 5_000))
        far.clock.advance(60)
        assert far.ask(m.MotReqPosCounter(1)) == [m.MotGetPosCounter(1, expected)]
        far.instrument.power_cycle()
        assert far.ask(m.MotReqPosCounter(1)) == [m.MotGetPosCounter(1, 0)]
