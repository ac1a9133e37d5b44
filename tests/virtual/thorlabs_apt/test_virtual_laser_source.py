"""Laser sources: power of the set point, threshold, limits, trigger ports and display."""

import pytest
from light_host import SETTLED, SOURCES, LightHost

from stagewire_apt import enumerations as e
from stagewire_apt import messages as m
from stagewire_virtual.thorlabs_apt.laser.laser import FULL_SCALE

EVERY = pytest.mark.parametrize("unit", SOURCES)


@EVERY
@pytest.mark.parametrize("share", [0.1, 0.5, 1.0])
def test_the_power_is_that_of_the_set_point(unit, share):
    host = LightHost(unit)
    host.switch_on(share)
    host.after(SETTLED)
    reading = host.ask(m.LaReqCurrentAndPower())
    assert reading.laser_power == pytest.approx(share * FULL_SCALE, rel=0.001)
    assert host.status().laser_power == min(reading.laser_power, 32760)
    limits = host.ask(m.LaReqMaxLimits())
    assert host.behaviour.power == pytest.approx(share * limits.max_power / 10_000, rel=0.001)
    # 20 mA of threshold, and 60 mA more for the maximum power, of 100 mA
    assert limits.max_current == 10_000
    assert reading.laser_current == pytest.approx((0.2 + 0.6 * share) * FULL_SCALE, rel=0.001)


@EVERY
def test_light_begins_at_the_threshold(unit):
    host = LightHost(unit)
    host.demand(1.0)
    host.tell(m.LaEnableOutput())
    host.after(2.8)  # 80 mA · (1 - exp(-0.28)) = 19.5 mA
    assert host.behaviour.current == pytest.approx(19.5, abs=0.1)
    assert host.behaviour.power == 0
    host.after(1)
    assert host.behaviour.power > 0


@EVERY
def test_an_old_laser_stays_at_its_maximum_current_below_the_set_point(unit):
    host = LightHost(unit)
    host.behaviour.efficiency = 0.5
    host.switch_on(0.5)
    assert host.ask(m.LaReqCurrentAndPower()).laser_power == pytest.approx(16384, abs=20)
    host.demand(1.0)
    host.after(SETTLED)
    reading = host.ask(m.LaReqCurrentAndPower())
    assert reading.laser_current == pytest.approx(FULL_SCALE, abs=5)
    assert reading.laser_power == pytest.approx(0.5 * 80 / 60 * FULL_SCALE, rel=0.001)
    assert host.status().laser_current == 32760  # the end of the range on page 318


@EVERY
def test_the_wavelength_is_that_of_the_unit(unit):
    wavelength = LightHost(unit).ask(m.LaReqMaxLimits()).wave_length
    assert wavelength == (1550 if unit == "KLS1550" else 635)


@EVERY
def test_a_source_controls_the_power_and_reports_a_hot_pigtail(unit):
    host = LightHost(unit)
    assert "closed_loop" in host.bits()
    assert "error" not in host.bits()
    host.behaviour.pigtail_temperature = 50.5
    assert "error" in host.bits()


@pytest.mark.parametrize("display", list(e.LaserDisplayUnits))
def test_the_status_has_the_display_of_a_tls001(display):
    host = LightHost("TLS001")
    host.tell(m.LaSetDispSettings(disp_intensity=255, disp_units=display))
    shown = {bit for bit in host.bits() if bit.startswith("display_")}
    assert shown == {f"display_{display.name.lower()}"}


@pytest.mark.parametrize("unit", ["KLS635", "KLS1550"])
def test_a_port_is_in_the_status_if_it_is_an_input(unit):
    host = LightHost(unit)
    inputs = {"digital_input_1", "digital_input_2"}
    assert host.bits().isdisjoint(inputs)
    mode = e.LaserTriggerMode.INPUT_LOGIC
    host.tell(m.LaSetKcubeTrigIoConfig(1, mode, 1, 0, 0, 1, 0))
    assert host.bits() & inputs == {"digital_input_1"}  # high with nothing connected (page 324)
    host.behaviour.digital_inputs = 2
    assert host.bits().isdisjoint(inputs)


def test_ports_of_a_tls001_are_inputs():
    host = LightHost("TLS001")
    host.behaviour.digital_inputs = 3
    assert {"digital_input_1", "digital_input_2"} <= host.bits()
