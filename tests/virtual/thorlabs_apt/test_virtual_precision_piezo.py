"""Precision piezo controllers: their loops, filters, sensors, inputs, monitor and status bits."""

import math

import pytest
from actuator_host import ActuatorHost

from stagewire_apt import messages as m
from stagewire_apt.flags import PpcStatusBits, TpzStatusBits

FULL = 32767
CLOSED = 2
UNITS = [("PPC001", 0x50), ("PPC102", 0x22), ("CT1P", 0x50)]
STRAIN_GAUGE, CAPACITIVE = 1, 2


def bay(unit, address, **options):
    host = ActuatorHost(unit, address=address, **options)
    if address == 0x22:
        host.behaviour = host.instrument.channel(1, bay=2).behaviour
    return host


def constants(p, i):
    return m.PzSetPpcPidConsts(1, p, i, 90, 1000, 1)


@pytest.mark.parametrize(("unit", "address"), UNITS)
def test_the_constants_of_the_loop_determine_its_time_constant(unit, address):
    host = bay(unit, address)
    host.tell(constants(10, 10), m.PzSetPosControlMode(1, CLOSED), m.PzSetOutputPos(1, 20000))
    host.to(50)  # one time constant, of 1 s / 20
    assert host.status().position == pytest.approx(20000 * (1 - math.exp(-1)), rel=0.01)
    host.tell(constants(0, 0))
    before = host.status().position
    host.to(500)
    assert host.status().position == before
    host.tell(constants(900, 800))
    host.to(600)
    assert host.status().position == 20000


def test_a_ct1p_uses_other_constants_near_its_target():
    host = ActuatorHost("CT1P")
    host.tell(constants(100, 0), m.PzSetPidCriteria(1, 0x40, 1, 1000), constants(10, 0))
    assert host.ask(m.PzReqPpcPidConsts(1)).pid_consts_p == 10
    host.tell(m.PzSetPidCriteria(1, 0x40, 0, 1000))
    assert host.ask(m.PzReqPpcPidConsts(1)).pid_consts_p == 100
    host.tell(m.PzSetPosControlMode(1, CLOSED), m.PzSetOutputPos(1, 20000))
    near = 10 * math.log(20)  # milliseconds from 20000 to 1000 counts before the target
    host.to(near)
    assert host.status().position == pytest.approx(19000, abs=2)
    host.to(near + 100)  # a time constant of the other group
    assert host.status().position == pytest.approx(20000 - 1000 / math.e, abs=2)
    host.tell(m.PzSetOutputPos(1, 19900))  # a move within the window
    start = host.status().position
    host.to(near + 200)
    left = (19900 - start) / math.e
    assert host.status().position == pytest.approx(19900 - left, abs=2)


def test_a_notch_filter_that_is_not_addressed_keeps_its_settings():
    host = ActuatorHost("PPC001")
    host.tell(m.PzSetPpcNotchParams(1, 3, 150, 50, 1, 200, 60, 1))
    host.tell(m.PzSetPpcNotchParams(1, 1, 160, 51, 2, 0, 0, 0))
    now = host.ask(m.PzReqPpcNotchParams(1))
    assert (now.filter_no, now.filter1_fc, now.filter1_q, now.notch_filter1_on) == (1, 160, 51, 2)
    assert (now.filter2_fc, now.filter2_q, now.notch_filter2_on) == (200, 60, 1)


@pytest.mark.parametrize(("source", "wanted"), [(0, 0.2), (1, 0.3), (2, 0.25), (3, 0.35)])
def test_the_selected_inputs_are_added(source, wanted):
    host = ActuatorHost("PPC001")
    host.behaviour.external_signal = 0.1
    host.behaviour.potentiometer = 0.05
    host.tell(m.PzSetPpcIoSettings(1, source, 1, 1, 1, 1), m.PzSetOutputVolts(1, round(FULL / 5)))
    host.to(100)
    assert host.status().op_voltage == pytest.approx(FULL * wanted, abs=1)


def test_a_loop_needs_the_sensor_of_its_actuator():
    host = ActuatorHost("PPC001")
    host.tell(m.PzSetPpcIoSettings(1, 0, 1, 1, CAPACITIVE, 1))
    assert "strain gauge" in host.refuses(m.PzSetPosControlMode(1, CLOSED))
    assert not PpcStatusBits(host.status().status_bits).strain_gauge_connected
    host.behaviour.sensor = CAPACITIVE
    host.tell(m.PzSetPosControlMode(1, CLOSED), m.PzSetOutputPos(1, 10000))
    host.to(1000)
    assert host.status().position == 10000
    host.tell(m.PzSetPpcIoSettings(1, 0, 1, 1, STRAIN_GAUGE, 1))  # the loop loses its feedback
    host.to(2000)
    assert host.status().op_voltage == FULL
    assert host.status().position == 0


@pytest.mark.parametrize(("signal", "wanted"), [(1, 2.5), (2, 6), (3, 6)])
def test_the_monitor_shows_the_selected_signal(signal, wanted):
    host = ActuatorHost("PPC001", position=20)  # a tenth of the travel
    host.tell(m.PzSetPpcIoSettings(1, 0, signal, 1, 1, 1), m.PzSetOutputVolts(1, round(FULL / 2)))
    host.to(100)
    assert host.behaviour.monitor == pytest.approx(wanted, abs=0.001)


def test_the_bits_report_a_reading_outside_of_its_range():
    host = ActuatorHost("PPC001", position=20)
    expected = {-FULL // 2: (True, False), 0: (False, False), FULL: (False, True)}
    for volts, (below, above) in expected.items():
        host.tell(m.PzSetOutputVolts(1, volts))
        host.clock.advance(0.1)
        bits = PpcStatusBits(host.status().status_bits)
        assert (bits.position_below_range, bits.position_above_range) == (below, above)
        assert bits.channel_enabled
        assert not bits.error


def test_a_ct1p_outputs_from_minus_10_to_140_volts():
    host = ActuatorHost("CT1P")
    for counts, volts in ((-FULL, -10), (FULL, 140), (FULL // 2, 75)):
        host.tell(m.PzSetOutputVolts(1, counts))
        host.clock.advance(0.1)
        assert host.behaviour.volts == pytest.approx(volts, abs=0.01)


def test_a_ct1p_is_zeroed():
    host = ActuatorHost("CT1P", position=20)
    host.tell(m.PzSetOutputVolts(1, 5000), m.PzSetZero(1))
    host.to(500)
    assert TpzStatusBits(host.status().status_bits).zeroing
    assert host.status().op_voltage == 0
    host.to(2000)
    assert TpzStatusBits(host.status().status_bits).zeroed
    assert host.status().position == 0
    assert host.ask(m.PzReqOutputVolts(1)).voltage == 0


def test_the_channels_of_a_ppc102_are_independent():
    host = ActuatorHost("PPC102", address=0x21)
    other = host.instrument.channel(1, bay=2).behaviour
    host.tell(m.PzSetOutputVolts(1, 9000))
    host.to(100)
    assert host.status().op_voltage == 9000
    assert other.volts == 0


@pytest.mark.parametrize("unit", ["PPC001", "CT1P"])
def test_the_constants_survive_a_power_cycle_if_they_were_saved(unit):
    host = ActuatorHost(unit)
    host.tell(constants(20, 30), m.PzSetEepromParams(1, 0x0690))
    host.instrument.power_cycle()
    now = host.ask(m.PzReqPpcPidConsts(1))
    assert (now.pid_consts_p, now.pid_consts_i) == (20, 30)
    host.tell(m.PzSetPosControlMode(1, CLOSED), m.PzSetOutputPos(1, 20000))
    host.to(20)  # one time constant
    assert host.status().position == pytest.approx(20000 * (1 - math.exp(-1)), rel=0.01)
