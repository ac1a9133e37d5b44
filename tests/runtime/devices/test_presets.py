"""Methods that send fixed values: shutters, which are read back, and NanoTraks."""

from __future__ import annotations

from contextlib import suppress
from typing import Any

import pytest
from recording_link import RecordingLink

import stagewire_virtual as virtual
from stagewire.errors import NotReadyError, ReplyTimeoutError
from stagewire_apt import BNT001, KNA101, KSC101, MNA601, PROTOCOL, TNA001, TSC001
from stagewire_virtual.thorlabs_apt.nanotrak.signal import Spot

each_driver = pytest.mark.parametrize("cls", [KSC101, TSC001])
SET_STATE = bytes.fromhex("cb 04")
ON, OFF = 1, 2


def opened(cls: Any, **options: Any) -> tuple[Any, RecordingLink, Any]:
    """Return a device, its line, and the behaviour of its virtual controller."""
    controller = getattr(virtual, cls.__name__)()
    line = RecordingLink(controller)
    device = cls.open(line, **options)
    line.forget()
    return device, line, controller.instrument.channel(1).behaviour


def states(line: RecordingLink) -> list[int]:
    """Return the states that were set."""
    return [raw[3] for raw in line.sent if raw[:2] == SET_STATE]


@each_driver
def test_a_shutter_opens_and_closes(cls: Any) -> None:
    device, line, output = opened(cls)
    with device:
        device.open_shutter()
        assert output.on
        device.close_shutter()
        assert not output.on
    assert states(line) == [ON, OFF]


@each_driver
@pytest.mark.parametrize("mode", ["SOLENOID_MANUAL", "SOLENOID_SINGLE", "SOLENOID_AUTO"])
def test_a_stop_closes_the_shutter(cls: Any, mode: str) -> None:
    device, line, output = opened(cls)
    with device:
        device.set_sol_operating_mode(operating_mode=mode)
        device.open_shutter()
        assert output.on
        device.stop()
        assert device.get_sol_state().state.name == "SOLENOID_OFF"
        assert not output.on
    assert states(line) == [ON, OFF]


@each_driver
@pytest.mark.parametrize("mode", ["SOLENOID_MANUAL", "SOLENOID_SINGLE", "SOLENOID_AUTO"])
def test_an_open_interlock_raises_an_error(cls: Any, mode: str) -> None:
    device, line, output = opened(cls)
    with device:
        device.set_sol_operating_mode(operating_mode=mode)
        output.interlock_closed = False
        line.forget()
        with pytest.raises(
            NotReadyError, match=r"reports state SOLENOID_OFF\. The interlock is open"
        ):
            device.open_shutter()
        assert states(line) == [ON, OFF]
        output.interlock_closed = True
        assert not output.on
        device.open_shutter()
        assert output.on


@each_driver
def test_a_driver_that_waits_for_a_trigger_does_not_open_later(cls: Any) -> None:
    device, _, output = opened(cls)
    with device:
        device.set_sol_operating_mode(operating_mode="SOLENOID_TRIGGER")
        with pytest.raises(NotReadyError, match="waits for its trigger"):
            device.open_shutter()
        output.trigger()
        assert not output.on


@each_driver
def test_a_driver_that_does_not_require_its_interlock_opens_without_it(cls: Any) -> None:
    device, _, output = opened(cls)
    with device:
        device.set_sol_interlock_mode(interlock_mode="SOLENOID_DISABLED")
        output.interlock_closed = False
        device.open_shutter()
        assert output.on


@each_driver
def test_a_shutter_whose_state_is_unknown_is_closed(cls: Any) -> None:
    device, line, output = opened(cls, timeout=0.2)
    with device:
        line.twist = lambda _: b""
        with pytest.raises(ReplyTimeoutError):
            device.open_shutter()
        assert not output.on
    assert states(line) == [ON, OFF]


@each_driver
def test_an_open_shutter_stays_open(cls: Any) -> None:
    device, _, output = opened(cls)
    with suppress(ZeroDivisionError), device:
        device.open_shutter()
        raise ZeroDivisionError
    assert output.on


def test_a_nanotrak_tracks_only_when_asked() -> None:
    device, line, _ = opened(TNA001)
    with device:
        device.track()
        assert device.get_nt_mode().state.name.startswith("TRACKING")
        line.controller.advance(2)
        device.latch()
        assert device.get_nt_mode().state.name == "LATCH"
        found = device.reading().circ_pos_a_nt
        assert abs(found - 5) > 0.5
        line.forget()
        device.home_circle()
        assert line.names(PROTOCOL) == ["PZ_MOVE_NTCIRCTOHOMEPOS"]
        line.controller.advance(0.5)
        assert device.reading().circ_pos_a_nt == pytest.approx(5, abs=0.01)


@pytest.mark.parametrize(
    ("cls", "microamperes"), [(TNA001, 100), (KNA101, 166), (BNT001, 100), (MNA601, 100)]
)
def test_a_reading_has_the_values_of_the_spot_that_a_nanotrak_has_found(
    cls: Any, microamperes: int
) -> None:
    device, line, behaviour = opened(cls)
    behaviour.spot = Spot(6.5, 4, width=3, peak=80e-6)
    with device:
        part = device if hasattr(device, "reading") else device.channel(1)
        before = part.reading()
        assert (before.circ_pos_a_nt, before.circ_pos_b_nt) == pytest.approx((5, 5), abs=0.001)
        assert before.abs_reading < 50e-6
        device.track()
        line.controller.advance(5)
        found = part.reading()
    assert (found.circ_pos_a_nt, found.circ_pos_b_nt) == pytest.approx((6.5, 4), abs=0.01)
    assert found.abs_reading == pytest.approx(80e-6, rel=0.01)
    assert found.rel_reading_percent == pytest.approx(80 / microamperes * 100, abs=0.5)
    assert found.range.name.endswith(f"RANGE_{microamperes}UA")
    assert found.under_over_read.name == "IN_RANGE"
    assert {"tracking", "tracking_with_signal"} < set(found.status_bits.names)


def test_opening_a_nanotrak_starts_nothing() -> None:
    line = RecordingLink(virtual.TNA001())
    with TNA001.open(line) as device:
        assert device.get_nt_mode().state.name == "LATCH"
    assert not [name for name in line.names(PROTOCOL) if "_SET_" in name or "MOVE" in name]
