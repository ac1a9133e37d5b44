"""Methods that send fixed values: shutters, which are read back, and NanoTraks."""

from __future__ import annotations

from contextlib import suppress
from typing import Any

import pytest
from recording_link import RecordingLink

import stagewire_virtual as virtual
from stagewire.errors import NotReadyError, ReplyTimeoutError
from stagewire_apt import KSC101, PROTOCOL, TNA001, TSC001

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


def test_opening_a_nanotrak_starts_nothing() -> None:
    line = RecordingLink(virtual.TNA001())
    with TNA001.open(line) as device:
        assert device.get_nt_mode().state.name == "LATCH"
    assert not [name for name in line.names(PROTOCOL) if "_SET_" in name or "MOVE" in name]
