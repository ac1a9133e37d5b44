"""Laser diode drivers: current, limit and its adjustment, loops, photodiode and ramp."""

import pytest
from light_host import DRIVERS, SETTLED, LightHost

from stagewire_apt import enumerations as e
from stagewire_apt import messages as m
from stagewire_virtual.errors import BadOptionError
from stagewire_virtual.thorlabs_apt.laser.laser import FULL_SCALE

EVERY = pytest.mark.parametrize("unit", DRIVERS)
FULL_CURRENT = {"TLD001": 220, "KLD101": 230}
LIMIT_RANGE = {"TLD001": 200, "KLD101": 230}
LOWEST = {"TLD001": 17, "KLD101": 15}
ADJUST, END = e.MaxCurrentAdjustment.ENABLED, e.MaxCurrentAdjustment.DISABLED
OFF, ON = e.DiodeDuringAdjustment.OFF, e.DiodeDuringAdjustment.ON


def milliamperes(host, unit):
    return host.ask(m.LdReqCurrentAndPower()).laser_current * FULL_CURRENT[unit] / FULL_SCALE


def set_limit(host, counts, diode=OFF):
    host.tell(m.LdMaxCurrentAdjust(ADJUST, diode), m.LdSetMaxCurrentDigPot(counts))
    host.tell(m.LdMaxCurrentAdjust(END, diode))


def ramped(host):
    misc = host.ask(m.LdReqMiscParams())
    host.tell(m.LdSetMiscParams(wa_calib_factor=misc.wa_calib_factor,
                                laser_polarity=misc.laser_polarity,
                                rampup=e.LaserRampup.RAMPED))  # fmt: skip


@EVERY
def test_the_set_point_is_a_share_of_the_full_current(unit):
    host = LightHost(unit)
    host.switch_on(0.25)
    assert milliamperes(host, unit) == pytest.approx(0.25 * FULL_CURRENT[unit], rel=0.001)
    reading, status = host.ask(m.LdReqCurrentAndPower()), host.status()
    assert status.laser_current == reading.laser_current
    assert status.photo_current == reading.laser_power > 0
    # 1.8 V and 3 Ohm
    current = host.behaviour.current
    assert status.laser_voltage == reading.laser_voltage == round(1800 + 3 * current)


@EVERY
def test_light_and_photocurrent_begin_at_the_threshold(unit):
    host = LightHost(unit)
    host.switch_on(19.9 / FULL_CURRENT[unit])
    assert host.behaviour.power == host.status().photo_current == 0
    assert host.status().laser_current > 0
    host.demand(40 / FULL_CURRENT[unit])
    host.after(SETTLED)
    assert host.behaviour.power == pytest.approx(20 * 0.8, rel=0.01)
    assert host.behaviour.photo_current == pytest.approx(20 * 0.8 * 0.05, rel=0.01)


@EVERY
def test_the_current_stays_at_its_limit(unit):
    host = LightHost(unit)
    limit = 128 * LIMIT_RANGE[unit] / 255
    maximum = host.ask(m.LdReqMaxCurrent()).max_current * FULL_CURRENT[unit] / FULL_SCALE
    assert maximum == pytest.approx(limit, rel=0.001)
    host.switch_on(0.2)
    assert "current_limit" not in host.bits()
    host.demand(1.0)
    host.after(SETTLED)
    assert milliamperes(host, unit) == pytest.approx(limit, rel=0.001)
    assert "current_limit" in host.bits()


@EVERY
def test_the_limit_can_be_set_only_during_an_adjustment(unit):
    host = LightHost(unit)
    assert "adjustment of the maximum current" in host.refuses(m.LdSetMaxCurrentDigPot(200))
    assert host.ask(m.LdReqMaxCurrentDigPot()).max_current == 128
    host.tell(m.LdMaxCurrentAdjust(ADJUST, OFF))
    host.tell(m.LdSetMaxCurrentDigPot(200))
    assert host.ask(m.LdReqMaxCurrentDigPot()).max_current == 200
    host.tell(m.LdMaxCurrentAdjust(END, OFF))
    assert host.ask(m.LdReqMaxCurrentDigPot()).max_current == 200
    assert host.refuses(m.LdSetMaxCurrentDigPot(100))


@EVERY
def test_an_adjustment_begins_at_the_lowest_limit(unit):
    host = LightHost(unit)
    host.switch_on(1.0)
    host.tell(m.LdMaxCurrentAdjust(ADJUST, ON))
    host.after(SETTLED)
    assert host.behaviour.on
    assert milliamperes(host, unit) == pytest.approx(LOWEST[unit], abs=1)
    host.tell(m.LdSetMaxCurrentDigPot(0))
    host.after(SETTLED)
    assert milliamperes(host, unit) == pytest.approx(LOWEST[unit], abs=0.1)
    host.tell(m.LdSetMaxCurrentDigPot(100))
    host.after(SETTLED)
    assert milliamperes(host, unit) == pytest.approx(100 * LIMIT_RANGE[unit] / 255, rel=0.001)


@EVERY
def test_an_adjustment_without_the_diode_switches_off(unit):
    host = LightHost(unit)
    host.switch_on(0.3)
    host.tell(m.LdMaxCurrentAdjust(ADJUST, OFF))
    assert not host.behaviour.on


@EVERY
def test_constant_power_holds_the_photocurrent(unit):
    host = LightHost(unit)
    host.behaviour.photodiode_range = 3
    host.tell(m.LdClosedLoop())
    host.switch_on(0.5)
    assert "closed_loop" in host.bits()
    assert host.status().photo_current == pytest.approx(0.5 * FULL_SCALE, rel=0.001)
    range_ = {"TLD001": 1.0, "KLD101": 0.9}[unit]
    assert host.behaviour.photo_current == pytest.approx(0.5 * range_, rel=0.001)
    host.tell(m.LdOpenLoop())
    assert "closed_loop" not in host.bits()
    host.instrument.power_cycle()
    assert "closed_loop" not in host.bits()


@EVERY
def test_a_dark_photodiode_drives_the_current_to_its_limit(unit):
    host = LightHost(unit)
    host.tell(m.LdClosedLoop())
    host.switch_on(0.01)
    host.behaviour.photodiode_connected = False
    host.after(SETTLED)
    assert milliamperes(host, unit) == pytest.approx(128 * LIMIT_RANGE[unit] / 255, rel=0.001)
    assert {"current_limit", "tia_under_limit"} <= host.bits()
    assert host.status().photo_current == 0


@EVERY
def test_the_ranges_of_the_photodiode_are_status_bits(unit):
    host = LightHost(unit)
    host.switch_on(0.4)
    for number in (1, 2, 3, 4):
        host.behaviour.photodiode_range = number
        assert {bit for bit in host.bits() if bit.startswith("tia_range")} == {
            f"tia_range_{number}"
        }
        assert ("tia_over_limit" in host.bits()) == (number < 4)
        assert (host.status().photo_current == FULL_SCALE) == (number < 4)
    with pytest.raises(BadOptionError, match="must be 1 to 4, not 5"):
        host.behaviour.photodiode_range = 5


@EVERY
def test_a_ramp_rises_in_steps_of_a_tenth_of_the_limit(unit):
    host = LightHost(unit)
    ramped(host)
    host.demand(1.0)
    host.tell(m.LaEnableOutput())
    limit = 128 * LIMIT_RANGE[unit] / 255
    seen = []
    for _ in range(11):
        host.after(99)
        seen.append(milliamperes(host, unit) / limit)
        host.after(1)
    assert seen == pytest.approx([0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.0], rel=0.01)


@EVERY
def test_without_a_ramp_the_current_rises_at_once(unit):
    host = LightHost(unit)
    host.switch_on(1.0)
    assert milliamperes(host, unit) == pytest.approx(128 * LIMIT_RANGE[unit] / 255, rel=0.001)


@EVERY
def test_the_diode_is_in_the_status(unit):
    host = LightHost(unit)
    assert {"psu_ok", "cathode_grounded"} <= host.bits()
    assert host.bits().isdisjoint({"open_circuit", "high_stability", "external_input_enabled"})
    host.switch_on(0.4)
    host.after(SETTLED)
    assert "high_stability" in host.bits()
    host.demand(0.3)
    assert "high_stability" not in host.bits()
    host.behaviour.diode_connected = False
    host.after(2 * SETTLED)
    assert "open_circuit" in host.bits()
    assert milliamperes(host, unit) == pytest.approx(0, abs=0.1)
    misc = host.ask(m.LdReqMiscParams())
    host.tell(m.LdSetMiscParams(misc.wa_calib_factor, e.LaserPolarity.ANODE_GROUNDED, misc.rampup))
    assert "cathode_grounded" not in host.bits()


@pytest.mark.parametrize(("unit", "external"), [("TLD001", 2), ("KLD101", 1)])
def test_the_external_input_is_in_the_status(unit, external):
    host = LightHost(unit)
    host.tell(m.LaSetPowerControlSource(external))
    assert "external_input_enabled" in host.bits()


@EVERY
def test_messages_about_the_gain_are_accepted(unit):
    host = LightHost(unit)
    assert host.tell(m.LdTiaGainAdjust(2), m.LdFindTiaGain(), m.LdTiaGainAdjust(1)) == []
    assert host.refusals == []


@EVERY
def test_a_saved_limit_survives_a_power_cycle(unit):
    host = LightHost(unit)
    set_limit(host, 60)
    host.tell(m.LaSetEepromParams(msg_id=0x0817))
    set_limit(host, 90)
    host.instrument.power_cycle()
    assert host.ask(m.LdReqMaxCurrentDigPot()).max_current == 60
