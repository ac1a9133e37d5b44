"""Attributes and readings of device classes: their values, their errors, and their names."""

from __future__ import annotations

import asyncio
import inspect

import pytest
from recording_link import RecordingLink

import stagewire_virtual as virtual
from stagewire.errors import BadValueError, LimitError, OutOfRangeError
from stagewire_apt import BPC201, KLS635, KPA101, KPZ101, PROTOCOL, aio, devices
from stagewire_apt import enumerations as e
from stagewire_apt import flags as f
from stagewire_apt import messages as m

UNITS = sorted(name for name in devices.__all__ if hasattr(getattr(devices, name), "unit"))


def test_a_voltage_is_read_and_assigned() -> None:
    line = RecordingLink(virtual.KPZ101())
    with KPZ101.open(line) as kpz:
        line.forget()
        kpz.volts = 12.5
        counts = round(32767 * 12.5 / float(kpz.scales.settings["maximum_volts"].value))
        assert m.PzSetOutputVolts(chan_ident=1, voltage=counts).pack(0x50, 0x01) in line.sent
        assert kpz.volts == pytest.approx(12.5, abs=0.01)
        kpz.set_volts(3)
        assert kpz.volts == pytest.approx(3, abs=0.01)


def test_a_voltage_out_of_range_is_not_sent() -> None:
    line = RecordingLink(virtual.BPC201())
    with BPC201.open(line, max_volts=60) as bpc:
        line.forget()
        with pytest.raises(
            OutOfRangeError, match=r"to 75 V, not 80 .*maximum_volts 75 V, from PZ_GET"
        ):
            bpc.volts = 80
        with pytest.raises(LimitError, match="rating of the actuator, 60 V"):
            bpc.volts = -70
        with pytest.raises(BadValueError):
            bpc.volts = "much"  # type: ignore[assignment]  # a wrong type
        assert line.raw == b""


def test_the_same_attribute_for_asyncio() -> None:
    async def run() -> float:
        async with aio.KPZ101.open("virtual://KPZ101") as kpz:
            await kpz.set_volts(12.5)
            return await kpz.volts

    assert asyncio.run(run()) == pytest.approx(12.5, abs=0.01)


def test_a_mode_is_read_and_assigned_by_name() -> None:
    line = RecordingLink(virtual.KPA101())
    with KPA101.open(line) as quad:
        line.forget()
        quad.mode = "CLOSED_LOOP"
        assert line.raw == m.QuadSetOperMode(mode=3).pack(0x50, 0x01)
        assert quad.mode is e.QuadOperatingMode.CLOSED_LOOP
        quad.set_mode(e.QuadOperatingMode.OPEN_LOOP)
        assert quad.mode is e.QuadOperatingMode.OPEN_LOOP
        line.forget()
        with pytest.raises(BadValueError, match="CLOSED_LOOP"):
            quad.mode = "LOOP"
        assert line.raw == b""


def test_status_and_current_of_lasers_are_only_read() -> None:
    line = RecordingLink(virtual.KLS635())
    with KLS635.open(line) as laser:
        line.forget()
        assert laser.status == f.KlsStatusBits(laser.get_status_bits().status_bits)
        assert not laser.status & f.KlsStatusBits.output_enabled
        assert laser.current_ma == 0
        assert not [name for name in line.names(PROTOCOL) if "_SET_" in name]
        for name in ("status", "current_ma"):
            with pytest.raises(AttributeError):
                setattr(laser, name, 1)


@pytest.mark.parametrize("unit", UNITS)
def test_names_of_members_are_unique(unit: str) -> None:
    """No attribute or further method of a part hides one of another part or of the runtime."""
    for package in (devices, aio):
        cls = getattr(package, unit)
        for part in (cls, getattr(cls, "channel_class", None), getattr(cls, "bay_class", None)):
            if part is None:
                continue
            parts = [
                base for base in part.__mro__ if ".parts." in base.__module__ and base.__bases__
            ]
            own = [base for base in parts if base.__module__.startswith("stagewire_apt")]
            names = [name for base in own for name in vars(base) if not name.startswith("_")]
            assert len(names) == len({*names})


@pytest.mark.parametrize(
    ("unit", "values"),
    [("KNA101", "NtStatusUpdate"), ("KPA101", "QuadReadings"), ("TTC001", "TecReadings")],
)
def test_a_reading_is_one_object(unit: str, values: str) -> None:
    cls = getattr(devices, unit)
    reading = getattr(cls, "channel_class", cls).reading
    assert inspect.signature(reading).return_annotation == f"v.{values}"
