"""The maximum voltage: its valid values, the reported value, and its effects."""

import pytest
from actuator_host import ActuatorHost

from stagewire_apt import messages as m
from stagewire_apt.flags import BpcStatusBits, OutputMaxVoltsFlags

ASKED = [(0, 750), (749, 750), (750, 750), (999, 750), (1000, 1000), (1499, 1000), (1500, 1500)]
FLAGS = {
    750: OutputMaxVoltsFlags.voltagelimit_75v,
    1000: OutputMaxVoltsFlags.voltagelimit_100v,
    1500: OutputMaxVoltsFlags.voltagelimit_150v,
}
HARDWARE = {
    750: BpcStatusBits.hardware_75v,
    1000: BpcStatusBits.hardware_100v,
    1500: BpcStatusBits.hardware_150v,
}


@pytest.mark.parametrize(("asked", "in_force"), ASKED)
@pytest.mark.parametrize("unit", ["BPC001", "BPC301"])
def test_setting_the_maximum_voltage_announces_the_effective_one(unit, asked, in_force):
    host = ActuatorHost(unit, travel=300)
    told = m.PzGetOutputMaxVolts(1, voltage=in_force, flags=FLAGS[in_force])
    assert host.tell(m.PzSetOutputMaxVolts(1, voltage=asked, flags=0xFFFF)) == [
        told,
        m.PzGetMaxTravel(1, travel=300),
    ]
    assert host.ask(m.PzReqOutputMaxVolts(1)) == told


@pytest.mark.parametrize("maximum", FLAGS)
def test_only_the_bpc30x_reports_the_hardware_voltage_bits(maximum):
    for unit, expected in (("BPC301", HARDWARE[maximum]), ("BPC201", 0)):
        host = ActuatorHost(unit)
        host.tell(m.PzSetOutputMaxVolts(1, voltage=maximum, flags=0))
        assert host.status().status_bits & sum(HARDWARE.values()) == expected


def test_more_than_150_volts_is_refused():
    host = ActuatorHost("BPC201")
    host.refuses(m.PzSetOutputMaxVolts.keep({"chan_ident": 1, "voltage": 1501, "flags": 0}))
    assert host.ask(m.PzReqOutputMaxVolts(1)).voltage == 750


def test_voltages_are_fractions_of_the_maximum():
    host = ActuatorHost("BPC201")
    host.tell(m.PzSetOutputVolts(1, voltage=0x7777))
    host.to(20)
    assert host.behaviour.volts == pytest.approx(70, abs=0.01)  # the example of page 96
    host.tell(m.PzSetOutputMaxVolts(1, voltage=1500, flags=0))
    assert host.status().op_voltage == 0x7777
    assert host.behaviour.volts == pytest.approx(140, abs=0.01)


@pytest.mark.parametrize(("limit", "volts"), [(1, 75), (2, 100), (3, 150)])
def test_the_voltage_limit_of_a_cube_is_an_io_setting(limit, volts):
    host = ActuatorHost("TPZ001")
    host.tell(m.PzSetTpzIoSettings(1, limit, 1))
    host.tell(m.PzSetOutputVolts(1, voltage=32767))
    host.to(20)
    assert host.behaviour.volts == volts
    assert host.refuses(m.PzSetTpzIoSettings(1, 4, 1))
    assert host.ask(m.PzReqTpzIoSettings(1)).voltage_limit == limit
