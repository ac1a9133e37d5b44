"""Enumerations whose names and numbers depend on the unit, such as the source of the set point of a laser."""

from __future__ import annotations

import pytest
from recording_link import RecordingLink

import stagewire_virtual as virtual
from stagewire.errors import BadValueError, OutOfRangeError
from stagewire_apt import KLS635, PROTOCOL, TLD001, TLS001
from stagewire_apt import enumerations as e
from stagewire_apt import messages as m
from stagewire_apt.devices.tables import POWER_CONTROL_SOURCE

UNITS = (TLS001, TLD001, KLS635)
NUMBERS = {
    "TLS001": {"SOFTWARE": 0, "EXTERNAL": 1, "POTENTIOMETER": 4},
    "TLD001": {"SOFTWARE": 1, "EXTERNAL": 2, "POTENTIOMETER": 4},
    "KLS635": {"SOFTWARE": 0, "EXTERNAL": 1, "WHEEL_AND_SOFTWARE": 4},
}


@pytest.mark.parametrize("unit", UNITS, ids=lambda unit: unit.unit.name)
def test_a_name_is_sent_as_the_number_of_the_unit(unit: type[TLD001]) -> None:
    for name, number in NUMBERS[unit.unit.name].items():
        line = RecordingLink(virtual.TPZ001())
        with unit.open(line, identify=False) as laser:
            line.forget()
            laser.set_power_control_source(laser_source=name)
            assert line.raw.endswith(
                m.LaSetPowerControlSource(laser_source=number).pack(0x50, 0x01)
            )


def test_a_member_of_another_unit_is_refused() -> None:
    line = RecordingLink(virtual.TPZ001())
    with TLD001.open(line, identify=False) as laser:
        line.forget()
        laser.set_power_control_source(laser_source=e.TldLaserSource.EXTERNAL)
        assert line.raw.endswith(m.LaSetPowerControlSource(laser_source=2).pack(0x50, 0x01))
        line.forget()
        with pytest.raises(BadValueError, match=r"SOFTWARE \(1\), EXTERNAL \(2\)"):
            laser.set_power_control_source(laser_source=e.LaserSource.EXTERNAL)
        with pytest.raises(BadValueError):
            laser.set_power_control_source(laser_source="WHEEL_AND_SOFTWARE")
        with pytest.raises(OutOfRangeError):
            laser.set_power_control_source(laser_source=0)
        assert set(line.names(PROTOCOL)) <= {"LD_ACK_STATUSUPDATE"}


def test_units_without_common_names_accept_numbers_only() -> None:
    [source] = POWER_CONTROL_SOURCE.given
    assert source.on(("TLD001",)).choices is e.TldLaserSource
    assert source.on(("KLS635", "KLD101")).choices is e.KcubeLaserSource
    assert source.on(("TLS001",)).choices is e.LaserSource
    assert source.on(("TLS001", "TLD001")).choices is None
