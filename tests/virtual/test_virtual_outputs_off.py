"""Virtual lasers and heaters: off after `open`, `close()` and `stop()`, and left alone by commands."""

from __future__ import annotations

from typing import Any

import pytest

import stagewire_virtual as virtual
from stagewire_apt import devices
from stagewire_apt import messages as m
from stagewire_apt.devices.facts import UNITS
from stagewire_cli.devices import opened
from stagewire_virtual.controller import VirtualController
from stagewire_virtual.linking import SteppedLink

UNITS_THAT_HEAT = sorted(name for name, unit in UNITS.items() if unit.safe_state)


def switched_on(unit: str) -> VirtualController:
    """Return a controller whose output a program has switched on."""
    controller: VirtualController = getattr(virtual, unit)()
    order: Any = m.LaEnableOutput()
    if unit == "TTC001":
        order = m.TecSetIoSettings(sensor=0, i_lim=800)
    controller.write(order.pack(0x50, 0x01))
    assert is_on(unit, controller)
    return controller


def is_on(unit: str, controller: VirtualController) -> bool:
    """Return whether the output can drive anything, as a program reads it that leaves it alone."""
    with getattr(devices, unit).open(SteppedLink(controller), on_close="leave") as device:
        if unit == "TTC001":
            return bool(device.get_io_settings().i_lim > 0)
        return "output_enabled" in device.get_status_bits().status_bits.names


@pytest.mark.parametrize("unit", UNITS_THAT_HEAT)
def test_an_output_is_off_after_open_and_after_an_exception(unit: str) -> None:
    controller = switched_on(unit)
    with getattr(devices, unit).open(SteppedLink(controller)):
        pass
    assert not is_on(unit, controller)
    controller = switched_on(unit)
    with pytest.raises(KeyError), getattr(devices, unit).open(SteppedLink(controller)):
        raise KeyError(unit)
    assert not is_on(unit, controller)
    controller = switched_on(unit)
    with getattr(devices, unit).open(SteppedLink(controller), on_close="leave") as device:
        device.stop()
    assert not is_on(unit, controller)


@pytest.mark.parametrize("unit", UNITS_THAT_HEAT)
def test_commands_other_than_stop_leave_an_output_alone(
    unit: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    controller = switched_on(unit)
    cls = getattr(devices, unit)
    real = cls.open
    for keeps in (True, False):
        monkeypatch.setattr(cls, "open", lambda _, **given: real(SteppedLink(controller), **given))
        with opened("virtual://", unit, keeps_outputs=keeps):
            pass
        monkeypatch.undo()
        assert is_on(unit, controller) == keeps
