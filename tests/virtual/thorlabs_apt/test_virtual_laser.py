"""The output of every laser: off at first, key switch, interlock, set point and its source."""

import math

import pytest
from light_host import DRIVERS, LASERS, SETTLED, SOURCES, LightHost

from stagewire_apt import enumerations as e
from stagewire_apt import messages as m
from stagewire_virtual.errors import BadOptionError, VirtualError
from stagewire_virtual.thorlabs_apt.laser.laser import FULL_SCALE, TIME_CONSTANT

READY = {"keyswitch_enabled", "interlock_enabled"}
EVERY = pytest.mark.parametrize("unit", LASERS)


def source(unit, name):
    table = {"TLS001": e.LaserSource, "TLD001": e.TldLaserSource}.get(unit, e.KcubeLaserSource)
    return m.LaSetPowerControlSource(laser_source=table[name])


@EVERY
def test_a_new_laser_is_dark_and_ready(unit):
    host = LightHost(unit)
    assert "output_enabled" not in host.bits()
    assert host.bits() >= READY
    assert host.status().laser_current == 0
    assert host.behaviour.power == 0
    assert host.ask(m.LaReqPowerSetpoint()).set_point == 0


@EVERY
def test_light_follows_the_set_point_and_ends_with_the_output(unit):
    host = LightHost(unit)
    host.demand(0.5)
    host.after(SETTLED)
    assert host.behaviour.power == 0  # not enabled
    host.switch_on()
    half = host.behaviour.power
    assert half > 0
    assert "output_enabled" in host.bits()
    host.demand(0.4)
    host.after(SETTLED)
    assert 0 < host.behaviour.power < half
    host.tell(m.LaDisableOutput())
    assert host.behaviour.power == host.behaviour.current == host.status().laser_current == 0
    assert "output_enabled" not in host.bits()
    assert host.ask(m.LaReqPowerSetpoint()).set_point == round(0.4 * FULL_SCALE)


@EVERY
def test_the_current_has_the_stated_time_constant(unit):
    host = LightHost(unit)
    host.switch_on(0.4)
    settled = host.behaviour.current
    host.tell(m.LaDisableOutput(), m.LaEnableOutput())
    host.after(TIME_CONSTANT * 1000)
    assert host.behaviour.current == pytest.approx(settled * (1 - math.exp(-1)), rel=1e-3)


@EVERY
@pytest.mark.parametrize(
    ("guard", "bit", "reason"),
    [
        ("keyswitch_on", "keyswitch_enabled", "the key switch is off"),
        ("interlock_closed", "interlock_enabled", "the interlock is open"),
    ],
)
def test_key_switch_and_interlock_switch_off_permanently(unit, guard, bit, reason):
    host = LightHost(unit)
    host.switch_on(0.4)
    setattr(host.behaviour, guard, False)
    assert host.behaviour.power == 0
    assert host.bits().isdisjoint({bit, "output_enabled"})
    assert host.refuses(m.LaEnableOutput()).endswith(reason)
    host.behaviour.press_enable()
    assert not host.behaviour.on
    assert reason in host.instrument.rows()[0].state
    setattr(host.behaviour, guard, True)
    host.after(SETTLED)
    assert host.behaviour.power == 0
    assert bit in host.bits()
    host.switch_on()
    assert host.behaviour.power > 0


@EVERY
def test_a_power_cycle_switches_off(unit):
    host = LightHost(unit)
    host.switch_on(0.4)
    host.tell(m.LaSetEepromParams(msg_id=0x0800))
    host.instrument.power_cycle()
    assert "output_enabled" not in host.bits()
    assert host.ask(m.LaReqPowerSetpoint()).set_point == round(0.4 * FULL_SCALE)  # saved
    host.after(SETTLED)
    assert host.behaviour.power == 0
    host.switch_on()
    assert host.behaviour.power > 0


@EVERY
def test_an_unsaved_set_point_is_lost(unit):
    host = LightHost(unit)
    host.demand(0.4)
    host.instrument.power_cycle()
    assert host.ask(m.LaReqPowerSetpoint()).set_point == 0
    assert "0x0821 is not the id of a SET" in host.refuses(m.LaSetEepromParams(msg_id=0x0821))


@EVERY
def test_the_enable_button_switches_like_the_messages(unit):
    host = LightHost(unit)
    host.behaviour.press_enable()
    assert "output_enabled" in host.bits()
    host.behaviour.press_enable()
    assert "output_enabled" not in host.bits()


@EVERY
def test_the_external_signal_counts_only_if_it_is_the_source(unit):
    host = LightHost(unit)
    host.behaviour.external_signal = 0.4
    host.switch_on(0)
    assert host.behaviour.power == 0
    host.tell(source(unit, "EXTERNAL"))
    host.after(SETTLED)
    bright = host.behaviour.power
    assert bright > 0
    host.demand(0.9)  # ignored: only one source is active
    host.after(SETTLED)
    assert host.behaviour.power == pytest.approx(bright, rel=0.001)
    host.behaviour.external_signal = 0.0
    host.after(SETTLED)
    assert host.behaviour.power == pytest.approx(0, abs=0.01)


@pytest.mark.parametrize("signal", [-0.1, 1.1, math.nan])
def test_a_signal_is_a_share(signal):
    host = LightHost("KLS635")
    with pytest.raises(BadOptionError, match="share of full scale from 0 to 1"):
        host.behaviour.external_signal = signal


@pytest.mark.parametrize("unit", ["TLS001", "TLD001"])
def test_the_potentiometer_of_a_t_cube_counts_only_if_it_is_the_source(unit):
    host = LightHost(unit)
    host.behaviour.turn(0.4)
    host.switch_on(0)
    assert host.behaviour.power == 0
    host.tell(source(unit, "POTENTIOMETER"))
    host.after(SETTLED)
    bright = host.behaviour.power
    assert bright > 0
    host.behaviour.turn(-0.1)
    host.after(SETTLED)
    assert 0 < host.behaviour.power < bright
    host.behaviour.turn(-5)
    host.after(SETTLED)
    assert host.behaviour.power == pytest.approx(0, abs=0.01)
    assert host.ask(m.LaReqPowerSetpoint()).set_point == 0


@pytest.mark.parametrize("unit", ["KLD101", "KLS101", "KLS635", "KLS1550"])
def test_the_wheel_of_a_k_cube_changes_the_set_point(unit):
    host = LightHost(unit)
    host.behaviour.turn(0.4)
    assert host.ask(m.LaReqPowerSetpoint()).set_point == 0
    host.tell(source(unit, "WHEEL_AND_SOFTWARE"))
    host.behaviour.turn(0.4)
    assert host.ask(m.LaReqPowerSetpoint()).set_point == round(0.4 * FULL_SCALE)
    host.switch_on()
    assert host.behaviour.power > 0
    host.behaviour.turn(2)
    assert host.ask(m.LaReqPowerSetpoint()).set_point == FULL_SCALE
    host.demand(0)  # software works as well
    host.after(SETTLED)
    assert host.behaviour.power == pytest.approx(0, abs=0.01)


@pytest.mark.parametrize(
    ("unit", "number"), [("TLD001", 0), ("TLD001", 3), ("TLS001", 2), ("KLS635", 2), ("KLD101", 3)]
)
def test_each_unit_has_its_own_numbers_of_sources(unit, number):
    host = LightHost(unit)
    assert "laser_source must be one of" in host.refuses(m.LaSetPowerControlSource(number))


@EVERY
def test_a_reserved_source_gives_no_light(unit):
    host = LightHost(unit)
    host.switch_on(0.4)
    if unit[0] == "K":
        host.tell(m.LaSetPowerControlSource(e.KcubeLaserSource.RESERVED))
        host.after(SETTLED)
        assert host.behaviour.power == pytest.approx(0, abs=0.01)
    else:
        assert host.refuses(m.LaSetPowerControlSource(8))


@pytest.mark.parametrize("unit", ["KLD101", "KLS635", "KLS1550"])
def test_restoring_the_defaults_switches_off(unit):
    host = LightHost(unit)
    host.switch_on(0.4)
    host.tell(m.MotSetPzStageParamDefaults(1))
    assert not host.behaviour.on
    assert host.ask(m.LaReqPowerSetpoint()).set_point == 0


@EVERY
def test_updates_carry_the_status_until_the_keep_alive_is_missed(unit):
    host = LightHost(unit)
    host.tell(m.HwStartUpdateMsgs(10))
    host.after(10_000)
    assert len(host.said) == 50
    keep_alive = m.LdAckStatusUpdate if unit in DRIVERS else m.LaAckStatusUpdate
    host.tell(keep_alive())
    host.after(1000)
    kinds = {message.layout.message for _, message in host.said}
    assert kinds == {"LD_GET_STATUSUPDATE" if unit in DRIVERS else "LA_GET_STATUSUPDATE"}
    assert len(host.said) == 60


@EVERY
def test_the_status_and_the_status_bits_agree(unit):
    host = LightHost(unit)
    host.switch_on(0.4)
    assert host.ask(m.LaReqStatusBits()).status_bits == host.status().status_bits


@EVERY
def test_a_laser_has_no_stage(unit):
    with pytest.raises(BadOptionError, match="is a laser and accepts no stage"):
        LightHost(unit, travel=100)
    with pytest.raises(VirtualError, match="that can stick"):
        LightHost(unit).instrument.stick("channel 1", True)


def test_there_are_six_lasers():
    assert len({*SOURCES, *DRIVERS}) == 6
