"""K-Cubes for piezos and strain gauges: limits, wheels, trigger ports and status bits."""

import pytest
from actuator_host import ActuatorHost

from stagewire_apt import messages as m
from stagewire_apt.enumerations import KsgTriggerMode as Ksg
from stagewire_apt.flags import KpcStatusBits, StrainGaugeStatusBits, TpzStatusBits
from stagewire_virtual.errors import UnknownPartError

FULL = 32767
HIGH, LOW = 1, 2
STEP_UP, STEP_DOWN, INPUT, OUTPUT = 2, 3, 1, 10


def volts(host, after=0.1):
    host.clock.advance(after)
    return host.behaviour.volts


@pytest.mark.parametrize(("limit", "maximum"), [(1, 75), (2, 100), (3, 150)])
def test_the_limit_of_a_kpz101_is_the_full_scale(limit, maximum):
    host = ActuatorHost("KPZ101")
    host.tell(m.PzSetTpzIoSettings(1, limit, 1), m.PzSetOutputVolts(1, FULL // 2))
    assert volts(host) == pytest.approx(maximum / 2, abs=0.01)
    assert host.ask(m.PzReqTpzIoSettings(1)).voltage_limit == limit


def io(limit, span):
    return m.KpcSetIoSettings(
        1, voltage_limit=limit, analog_input=3, filter=0, voltage_range=span, force_sense=0,
        strain_gauge_option=0,
    )  # fmt: skip


def test_the_limit_of_a_kpc101_does_not_change_the_scale():
    host = ActuatorHost("KPC101")
    host.tell(io(100, 150), m.PzSetOutputVolts(1, FULL // 2))
    assert volts(host) == pytest.approx(75, abs=0.01)
    host.tell(m.PzSetOutputVolts(1, FULL))
    assert volts(host) == pytest.approx(100, abs=0.01)
    assert host.ask(m.PzReqOutputVolts(1)).voltage == FULL
    host.tell(io(150, 150))
    assert volts(host) == pytest.approx(150)


def wheel(unit, mode, *, gear=1, sense=1, step=500):
    if unit == "KPZ101":
        return m.KpzSetKcubeMmiParams(1, mode, gear, step, sense, 3000, 6000, 50, 0, 0)
    return m.KpcSetKcubeMmiParams(
        1, mode, gear, step, 700, sense, 3000, 6000, 4000, 8000, 50, 0, 0
    )  # fmt: skip


TURNS = [
    # mode, gear, sense, clicks -> set voltage from 10000
    (1, 1, 1, 2, 10000 + 2 * 10 * 32),
    (1, 2, 1, -2, 10000 - 2 * 5 * 32),
    (1, 3, 2, 3, 10000 - 3 * 32),
    (2, 1, 1, 3, 11500),
    (2, 1, 2, 3, 8500),
    (3, 1, 1, 1, 3000),
    (3, 1, 1, -1, 6000),
    (1, 1, 0, 5, 10000),
]


@pytest.mark.parametrize("unit", ["KPZ101", "KPC101"])
@pytest.mark.parametrize(("mode", "gear", "sense", "clicks", "wanted"), TURNS)
def test_the_wheel_changes_the_voltage(unit, mode, gear, sense, clicks, wanted):
    host = ActuatorHost(unit)
    host.tell(wheel(unit, mode, gear=gear, sense=sense), m.PzSetOutputVolts(1, 10000))
    host.behaviour.turn(clicks)
    assert host.ask(m.PzReqOutputVolts(1)).voltage == wanted
    host.to(100)
    assert host.status().op_voltage == wanted


def test_the_wheel_of_a_kpc101_changes_the_position_in_closed_loop():
    host = ActuatorHost("KPC101")
    host.tell(wheel("KPC101", 2), m.PzSetPosControlMode(1, 2), m.PzSetOutputPos(1, 5000))
    host.behaviour.turn(1)
    assert host.ask(m.PzReqOutputPos(1)).position_sw == 5700
    host.tell(wheel("KPC101", 3))
    host.behaviour.turn(-1)
    assert host.ask(m.PzReqOutputPos(1)).position_sw == 8000
    host.to(1000)
    assert host.status().position == 8000


def test_the_wheel_stays_within_the_range():
    host = ActuatorHost("KPZ101")
    host.tell(wheel("KPZ101", 2, step=FULL))
    host.behaviour.turn(3)
    assert host.ask(m.PzReqOutputVolts(1)).voltage == FULL
    host.behaviour.turn(-3)
    assert host.ask(m.PzReqOutputVolts(1)).voltage == 0


def test_a_locked_panel_ignores_the_wheel():
    host = ActuatorHost("KPC101")
    host.tell(m.HwSetKcubeMmiLock(mmi_lock=1))
    host.behaviour.turn(1)
    assert host.ask(m.PzReqOutputVolts(1)).voltage == 0
    host.tell(m.HwSetKcubeMmiLock(mmi_lock=2))
    host.behaviour.turn(1)
    assert host.ask(m.PzReqOutputVolts(1)).voltage > 0


def test_a_unit_without_a_wheel_or_ports_says_so():
    behaviour = ActuatorHost("BPC301").behaviour
    with pytest.raises(UnknownPartError, match="wheel"):
        behaviour.turn(1)
    with pytest.raises(UnknownPartError, match="trigger port 1"):
        behaviour.ports.drive(1, True)
    with pytest.raises(UnknownPartError, match=r"trigger port 3.*trigger port 1, trigger port 2"):
        ActuatorHost("KPZ101").behaviour.ports.output(3)


def ports(unit, mode1, polarity1, mode2=0, polarity2=1, lower=0, upper=50):
    if unit == "KPZ101":
        return m.KpzSetKcubeTrigIoConfig(1, mode1, polarity1, mode2, polarity2)
    if unit == "KSG101":
        return m.KsgSetKcubeTrigIoConfig(1, mode1, polarity1, mode2, polarity2, lower, upper, 16)
    return m.KpcSetKcubeTrigIoConfig(
        1, mode1, polarity1, mode2, polarity2, lower * 327, upper * 327, 1, 0, 0, 0
    )


@pytest.mark.parametrize("unit", ["KPZ101", "KPC101"])
def test_an_active_edge_steps_the_voltage(unit):
    host = ActuatorHost(unit)
    host.tell(wheel(unit, 1, step=500), ports(unit, STEP_UP, HIGH, STEP_DOWN, LOW))
    trigger = host.behaviour.ports
    for level in (True, True, False, True):
        trigger.drive(1, level)
    assert host.ask(m.PzReqOutputVolts(1)).voltage == 1000
    for level in (True, False, False):
        trigger.drive(2, level)
    assert host.ask(m.PzReqOutputVolts(1)).voltage == 500
    assert not trigger.output(1)


@pytest.mark.parametrize(
    ("unit", "bits"),
    [("KPZ101", None), ("KSG101", StrainGaugeStatusBits), ("KPC101", KpcStatusBits)],
)
def test_a_logic_input_is_in_the_status_bits(unit, bits):
    host = ActuatorHost(unit)
    host.tell(ports(unit, INPUT, HIGH))
    host.behaviour.ports.drive(1, True)
    host.behaviour.ports.drive(2, True)  # its port is not an input
    if bits is not None:  # the table of the KPZ101 has no digital inputs
        status = bits(host.status().status_bits)
        assert status.digital_input_1
        assert not status.digital_input_2


@pytest.mark.parametrize("unit", ["KPZ101", "KSG101", "KPC101"])
def test_a_logic_output_follows_the_digital_outputs(unit):
    host = ActuatorHost(unit)
    host.tell(ports(unit, OUTPUT, HIGH, OUTPUT, LOW), m.ModSetDigOutputs(bit=0b01))
    trigger = host.behaviour.ports
    assert (trigger.output(1), trigger.output(2)) == (True, True)  # TRIG2 is off, and active low
    host.tell(m.ModSetDigOutputs(bit=0b10))
    assert (trigger.output(1), trigger.output(2)) == (False, False)


CONDITIONS = [
    # mode -> active with a signal of -20 %, 20 %, 80 %, for limits of 0 and 50 %
    (Ksg.OUTPUT_BELOW_LOWER_LIMIT, (True, False, False)),
    (Ksg.OUTPUT_ABOVE_LOWER_LIMIT, (False, True, True)),
    (Ksg.OUTPUT_BELOW_UPPER_LIMIT, (True, True, False)),
    (Ksg.OUTPUT_ABOVE_UPPER_LIMIT, (False, False, True)),
    (Ksg.OUTPUT_BETWEEN_LIMITS, (False, True, False)),
    (Ksg.OUTPUT_OUTSIDE_LIMITS, (True, False, True)),
]


@pytest.mark.parametrize(("mode", "active"), CONDITIONS)
@pytest.mark.parametrize("polarity", [HIGH, LOW])
def test_the_limits_of_a_reader_switch_its_outputs(mode, active, polarity):
    host = ActuatorHost("KSG101")
    host.tell(ports("KSG101", mode, polarity))
    found = []
    for signal in (-0.2, 0.2, 0.8):
        host.behaviour.signal = signal
        host.clock.advance(0.01)
        found.append(host.behaviour.ports.output(1) == (polarity == HIGH))
    assert tuple(found) == active


def test_the_limits_of_a_kpc101_apply_to_its_strain_gauge():
    host = ActuatorHost("KPC101")
    host.tell(ports("KPC101", 0x0E, HIGH), m.PzSetOutputVolts(1, FULL))
    assert not host.behaviour.ports.output(1)
    host.to(100)
    assert host.behaviour.ports.output(1)


def test_a_ksg101_averages_its_samples():
    host = ActuatorHost("KSG101")
    host.to(1000)
    host.behaviour.signal = 0.5
    host.tell(m.KsgSetKcubeTrigIoConfig(1, 0, 1, 0, 1, 0, 100, 100))
    host.to(1098)  # 50 of the last 100 samples
    answer = host.ask(m.PzReqTsgReading(1))
    assert answer.reading == round(FULL / 2)
    assert answer.smoothed == pytest.approx(FULL / 4, abs=1)
    host.tell(m.KsgSetKcubeTrigIoConfig(1, 0, 1, 0, 1, 0, 100, 0))
    assert host.ask(m.PzReqTsgReading(1)).smoothed == answer.reading


@pytest.mark.parametrize(("signal", "value", "wanted"), [(0, FULL // 2, 5), (1, 0, 2.5), (2, 0, 5)])
def test_the_monitor_output_of_a_kpc101(signal, value, wanted):
    host = ActuatorHost("KPC101")
    host.tell(m.KpcSetKcubeTrigIoConfig(1, 0, 1, 0, 1, 0, 0, 1, signal, 0, value))
    host.tell(m.PzSetOutputVolts(1, FULL // 2))
    host.to(100)
    assert host.behaviour.monitor == pytest.approx(wanted, abs=0.001)


def test_the_status_bits_are_those_of_the_unit():
    kpz = ActuatorHost("KPZ101")
    assert kpz.status().status_bits == TpzStatusBits.actuator_connected | (
        TpzStatusBits.strain_gauge_connected
    )
    reader = StrainGaugeStatusBits(ActuatorHost("KSG101").status().status_bits)
    assert reader.strain_gauge_connected
    assert reader.channel_enabled
    kpc = ActuatorHost("KPC101")
    kpc.tell(m.PzSetPosControlMode(1, 2), m.PzSetZero(1))
    status = KpcStatusBits(kpc.ask(m.PzReqPzStatusBits(1)).status_bits)
    assert status.closed_loop
    assert status.zeroing
    assert not status.error


@pytest.mark.parametrize("unit", ["KPZ101", "KPC101"])
def test_the_table_of_a_cube_ends_at_512(unit):
    host = ActuatorHost(unit)
    assert "512" in host.refuses(m.PzSetOutputLut(1, 513, 5))
    host.tell(m.PzSetOutputLut(1, 512, 5))
    assert not host.refusals[1:]
