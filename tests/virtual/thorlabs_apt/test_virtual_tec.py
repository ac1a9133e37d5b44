"""The temperature controller: a load that follows the current, sensors, limit and status."""

import math

import pytest
from light_host import LightHost

from stagewire_apt import enumerations as e
from stagewire_apt import messages as m
from stagewire_virtual.errors import BadOptionError
from stagewire_virtual.thorlabs_apt.tec.load import Loop

AD59X, SMALL, LARGE = e.TecSensor


@pytest.fixture
def host():
    return LightHost("TTC001")


def set_point(host, counts):
    host.tell(m.TecSetTempSetPoint(t_set=counts))


def test_a_new_controller_is_off_at_room_temperature(host):
    reading = host.ask(m.TecReqReadings())
    assert (reading.i_tec, reading.t_act, reading.t_set) == (0, 2500, 2500)
    assert host.bits() == {"display_actual"}
    set_point(host, 5000)
    host.after(600_000)
    assert host.ask(m.TecReqReadings()).t_act == 2500  # off by default


@pytest.mark.parametrize("target", [1500, 2500, 4000])
def test_the_load_reaches_the_set_point(host, target):
    host.behaviour.press_enable()
    set_point(host, target)
    host.after(300_000)
    status = host.status()
    assert status.t_act == pytest.approx(target, abs=1)
    assert status.t_set == target
    assert status.i_tec == pytest.approx(abs(target - 2500) / 3000 * 1000, abs=2)  # 30 K/A
    assert "output_enabled" in host.bits()


def test_full_current_heats_with_the_time_constant_of_the_load(host):
    host.behaviour.press_enable()
    set_point(host, 14500)  # unreachable
    host.after(60_000)
    # 1 A is 30 degrees at rest; one time constant
    assert host.behaviour.temperature == pytest.approx(25 + 30 * (1 - math.exp(-1)))
    assert host.ask(m.TecReqReadings()).i_tec == 1000
    host.behaviour.press_enable()
    hot = host.behaviour.temperature
    host.after(60_000)
    assert host.behaviour.temperature == pytest.approx(25 + (hot - 25) * math.exp(-1))
    assert host.ask(m.TecReqReadings()).i_tec == 0


def test_the_limit_takes_effect_at_once(host):
    host.behaviour.press_enable()
    set_point(host, 10000)
    host.tell(m.TecSetIoSettings(sensor=AD59X, i_lim=300))
    assert host.ask(m.TecReqReadings()).i_tec == 300
    host.after(600_000)
    assert host.ask(m.TecReqReadings()).t_act == pytest.approx(2500 + 900, abs=1)


def test_cooling_is_limited_as_well(host):
    host.behaviour.press_enable()
    set_point(host, -4500)
    assert host.behaviour.current == -1.0
    assert host.ask(m.TecReqReadings()).i_tec == 1000  # the document has no sign
    host.after(600_000)
    assert host.ask(m.TecReqReadings()).t_act == pytest.approx(-500, abs=1)


def test_without_an_integral_gain_an_error_remains(host):
    host.tell(m.TecSetLoopParams(p_gain=10, i_gain=0, d_gain=0))
    host.behaviour.press_enable()
    set_point(host, 3500)
    host.after(600_000)
    # 0.2 A/K · 30 K/A = 6: six sevenths of the way
    assert host.ask(m.TecReqReadings()).t_act == pytest.approx(2500 + 1000 * 6 / 7, abs=1)


def test_a_larger_gain_is_faster(host):
    other = LightHost("TTC001")
    other.tell(m.TecSetLoopParams(p_gain=50, i_gain=10, d_gain=0))
    for each in (host, other):
        each.behaviour.press_enable()
        set_point(each, 3000)
        each.after(15_000)
    assert host.behaviour.temperature < other.behaviour.temperature < 30.01


def test_a_load_follows_its_surroundings(host):
    host.behaviour.surroundings = 5
    host.after(600_000)
    assert host.ask(m.TecReqReadings()).t_act == pytest.approx(500, abs=1)


@pytest.mark.parametrize(("sensor", "nominal"), [(SMALL, 2000), (LARGE, 20000)])
def test_a_thermistor_reports_kilohms(host, sensor, nominal):
    host.tell(m.TecSetIoSettings(sensor=sensor, i_lim=2000))
    assert host.ask(m.TecReqReadings()).t_act == nominal
    host.behaviour.press_enable()
    set_point(host, nominal // 2)
    host.after(600_000)
    assert host.ask(m.TecReqReadings()).t_act == pytest.approx(nominal // 2, abs=nominal / 1000)
    assert host.behaviour.temperature == pytest.approx(41.7, abs=0.5)  # B = 3900 K


@pytest.mark.parametrize(
    ("sensor", "low", "high"), [(AD59X, -4500, 14500), (SMALL, 0, 2000), (LARGE, 0, 20000)]
)
def test_a_set_point_outside_the_range_of_the_sensor_is_refused(host, sensor, low, high):
    host.tell(m.TecSetIoSettings(sensor=sensor, i_lim=1000))
    for counts in (low, high):
        set_point(host, counts)
        assert host.ask(m.TecReqTempSetPoint()).t_set == counts
    for counts in {low - 1, high + 1} & {*range(-4500, 20001)}:
        assert f"t_set must be from {low} to {high}" in host.refuses(m.TecSetTempSetPoint(counts))
        assert host.ask(m.TecReqTempSetPoint()).t_set == high


def test_another_sensor_brings_the_set_point_into_its_range(host):
    host.tell(m.TecSetIoSettings(sensor=SMALL, i_lim=1000))
    assert host.ask(m.TecReqTempSetPoint()).t_set == 2000


def test_without_a_sensor_the_output_is_off_and_an_error(host):
    host.behaviour.press_enable()
    host.behaviour.sensor_connected = False
    assert not host.behaviour.on
    assert "error" in host.bits()
    host.behaviour.press_enable()
    assert not host.behaviour.on
    host.behaviour.sensor_connected = True
    assert host.bits() == {"display_actual"}


def test_a_power_cycle_switches_off(host):
    host.behaviour.press_enable()
    set_point(host, 4000)
    host.tell(m.TecSetEepromParams())
    set_point(host, 4100)
    host.after(20_000)
    warm = host.behaviour.temperature
    host.instrument.power_cycle()
    assert not host.behaviour.on
    assert host.behaviour.temperature == pytest.approx(warm)
    assert host.ask(m.TecReqTempSetPoint()).t_set == 4000  # saved


@pytest.mark.parametrize("mode", list(e.TecDisplayMode))
def test_the_status_has_the_display(host, mode):
    host.tell(m.TecSetDispSettings(disp_intensity=255, disp_mode=mode))
    (shown,) = host.bits()
    number = list(e.TecDisplayMode).index(mode)
    names = ["display_actual", "display_set_point", "display_difference", "display_current"]
    assert shown == names[number]
    assert host.ask(m.TecReqStatusBits()).status_bits == host.status().status_bits


def test_updates_need_the_keep_alive_of_a_tec(host):
    host.tell(m.HwStartUpdateMsgs(10))
    host.after(10_000)
    assert len(host.said) == 50
    host.tell(m.TecAckStatusUpdate())
    host.after(1000)
    assert len(host.said) == 60


def test_a_load_has_no_stage():
    with pytest.raises(BadOptionError, match="has a thermal load and accepts no stage"):
        LightHost("TTC001", travel=1)


@pytest.mark.parametrize("hold", [-1.0, -0.4, 0.0, 0.7, 1.0])
@pytest.mark.parametrize("start", [-40.0, 20.0, 24.9, 25.1, 30.0, 90.0])
@pytest.mark.parametrize("surroundings", [-20.0, 25.0, 60.0])
def test_the_formula_agrees_with_small_steps(hold, start, surroundings):
    loop = Loop(target=25.0, hold=hold, gain=0.2, limit=1.0)
    temperature, step = start, 0.02
    for number in range(1, 5001):
        heat = 5.0 * loop.current(temperature) - (temperature - surroundings) / 6
        temperature += heat / 10.0 * step
        if number % 1000 == 0:
            formula = loop.after(start, surroundings, number * step)
            assert formula == pytest.approx(temperature, abs=0.05)
