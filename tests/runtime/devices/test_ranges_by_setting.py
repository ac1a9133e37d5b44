"""Ranges that depend on a setting: the set point of a temperature controller has the range of its sensor."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from recording_link import RecordingLink

import stagewire_virtual as virtual
from stagewire.devices import parameter_sets
from stagewire.errors import OutOfRangeError
from stagewire_apt import PROTOCOL, TTC001
from stagewire_apt import messages as m

RANGES = {
    "SENSOR_IC_AD59X": ("degc", -4500, 14500),
    "SENSOR_THERM20KOHM": ("kohm", 0, 2000),
    "SENSOR_THERM200KOHM": ("kohm", 0, 20000),
}


@pytest.fixture
def line() -> RecordingLink:
    return RecordingLink(virtual.TTC001())


@pytest.fixture
def tec(line: RecordingLink) -> Iterator[TTC001]:
    with TTC001.open(line) as opened:
        yield opened


def sent(line: RecordingLink) -> list[str]:
    """Return the names of the written messages, without keep-alive messages."""
    return [name for name in line.names(PROTOCOL) if name != "TEC_ACK_STATUSUPDATE"]


@pytest.mark.parametrize("sensor", RANGES)
def test_a_set_point_outside_the_range_of_the_sensor_is_not_sent(
    line: RecordingLink, tec: TTC001, sensor: str
) -> None:
    keyword, low, high = RANGES[sensor]
    tec.change_io_settings(sensor=sensor)
    for counts in (low, high):
        for given in ({"t_set": counts}, {keyword: counts / 100}):
            tec.set_temp_set_point(**given)
            assert tec.get_temp_set_point().t_set == counts
    line.forget()
    for counts in (low - 1, high + 1):
        for given in ({"t_set": counts}, {keyword: counts / 100}):
            for call in (tec.set_temp_set_point, tec.change_temp_set_point):
                with pytest.raises(OutOfRangeError, match=f"while tec_sensor is {sensor}, not"):
                    call(**given)
    assert not sent(line)


def test_the_error_names_the_range_the_sensor_and_the_remedy(tec: TTC001) -> None:
    with pytest.raises(OutOfRangeError) as refused:
        tec.set_temp_set_point(degc=200)
    assert str(refused.value) == (
        "TTC001: set_temp_set_point: degc must be -45 to 145 degC while tec_sensor is SENSOR_IC_AD59X, "
        "not 200 (20000 counts; the range is -4500 to 14500); to change tec_sensor, send "
        "TEC_SET_IOSETTINGS first; see TEC_SET_TEMPSETPOINT.t_set, page 355 of Issue 37"
    )


def test_parameter_sets_have_the_limits_of_the_sensor(tec: TTC001) -> None:
    point = parameter_sets(TTC001)["temp_set_point"].parameters["t_set"]
    assert point.limits(tec.scales) == (-45, 145)
    tec.change_io_settings(sensor="SENSOR_THERM20KOHM")
    assert point.limits(tec.scales) == (0, 20)


def test_a_sensor_without_a_range_has_that_of_the_field(line: RecordingLink) -> None:
    known = m.TecGetIoSettings(sensor=0, i_lim=0).pack(0x01, 0x50)[:9]
    line.twist = lambda data: data.replace(known, known[:8] + b"\x07")
    with TTC001.open(line) as tec, pytest.raises(OutOfRangeError, match="be -4500 to 20000"):
        tec.set_temp_set_point(t_set=20001)
