"""Settings that no controller reports, which a user passes to ``open``."""

from __future__ import annotations

import pytest
from recording_link import RecordingLink

import stagewire_virtual as virtual
from stagewire.errors import BadValueError, UnknownScaleError
from stagewire_apt import TLD001, TLS001, TTC001
from stagewire_apt import messages as m

REQUEST = m.LdReqStatusUpdate().pack(0x50, 0x01)
REPLY = m.LdGetStatusUpdate(
    laser_current=-32767, photo_current=32767, laser_voltage=1500, status_bits=3
).pack(0x01, 0x50)


class StatusLink(RecordingLink):
    """A line to a controller that only answers requests for the status."""

    def __init__(self) -> None:
        super().__init__(virtual.TPZ001())
        self._waiting = b""

    def read(self, timeout: float) -> bytes:
        said, self._waiting = self._waiting, b""
        return said or super().read(timeout)

    def write(self, data: bytes) -> None:
        self._waiting += REPLY * data.count(REQUEST)
        super().write(data)


def test_a_given_setting_determines_the_scale() -> None:
    settings = {"diode_full_scale": 220, "photodiode_range": "0.1"}
    with TLD001.open(StatusLink(), identify=False, settings=settings) as laser:
        assert "diode_full_scale 220 mA, set by settings" in str(laser)
        status = laser.get_status_update()
        assert status.laser_current_ma == -220
        assert status.photo_current_ma == pytest.approx(0.1)
        assert status.laser_voltage_volts == 1.5
        assert status.status_bits.names == ("output_enabled", "keyswitch_enabled")


def test_without_it_the_scale_is_unknown() -> None:
    with TLD001.open(StatusLink(), identify=False) as laser:
        status = laser.get_status_update()
        assert status.laser_current == -32767
        with pytest.raises(UnknownScaleError, match=r"pass settings=\{'diode_full_scale': …\} to"):
            _ = status.laser_current_ma


@pytest.mark.parametrize(
    ("unit", "settings", "problem"),
    [
        (TLD001, {"full_scale": 220}, "choose diode_full_scale, photodiode_range"),
        (TLD001, {"diode_full_scale": 0}, "above 0"),
        (TLS001, {"diode_full_scale": 220}, "unknown setting 'diode_full_scale' of a TLS001"),
    ],
    ids=["unknown", "zero", "another unit"],
)
def test_a_wrong_setting_is_refused(
    unit: type[TLD001], settings: dict[str, float], problem: str
) -> None:
    with pytest.raises(BadValueError, match=problem):
        unit.open(StatusLink(), identify=False, settings=settings)


def test_cases_with_the_same_unit_have_one_keyword() -> None:
    line = StatusLink()
    with TTC001.open(line, identify=False, on_close="leave") as tec:
        tec.set_io_settings(sensor="SENSOR_THERM200KOHM", ma=500)
        tec.set_temp_set_point(kohm=10)
        assert line.raw.endswith(m.TecSetTempSetPoint(t_set=1000).pack(0x50, 0x01))
        with pytest.raises(UnknownScaleError, match="is in kohm, not in degC"):
            tec.set_temp_set_point(degc=25)
        tec.set_io_settings(sensor="SENSOR_IC_AD59X", ma=500)
        tec.set_temp_set_point(degc=-25)
        assert line.raw.endswith(m.TecSetTempSetPoint(t_set=-2500).pack(0x50, 0x01))
