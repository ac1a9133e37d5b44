"""The joystick or knob: disabled and enabled, and its status bit (sections 14, 26 and 27)."""

from __future__ import annotations

from functools import partial
from typing import Final

from stagewire.protocols import Command
from stagewire_conformance.device.causes import Cause
from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.ms2000.axis import Axis
from stagewire_conformance.device.checks.ms2000.axis_check import axis_check
from stagewire_conformance.device.permissions import Need
from stagewire_ms2000 import messages as m

KIND: Final = Kind(
    name="joystick",
    title="The joystick or knob can be disabled and enabled, and the status byte shows it",
    rules=(
        "joystick-enabled", "joystick-size-optional", "joystick-disabled",
        "joystick-disable-size-optional", "status-joystick-bit",
    ),
)  # fmt: skip


@axis_check(
    KIND,
    "Bit 3 of {axis} shows whether its joystick is enabled, with and without the size",
    messages=("JOYSTICK_ENABLE", "JOYSTICK_DISABLE", "READ_STATUS_BYTE"),
    needs={Need.SETTINGS},
    does="disables the joystick or knob of every axis for a moment, and enables it again if it "
    "was enabled",
    seconds=0.8,
)
def _look(axis: Axis) -> None:
    """Switch the joystick off and on, in both forms, and leave it as it was.

    If it was disabled, enable it only if motion is allowed: it may be deflected.
    """
    was = axis.status.joystick_enabled
    others = {each: each.status.joystick_enabled for each in _others(axis)}
    for each, enabled in ((axis, was), *others.items()):
        axis.trial.undo(
            f"joystick of axis {each.name}: {'enabled' if enabled else 'disabled'}",
            partial(_put_back, each, enabled, told=each is axis),
        )
    may_enable = was or axis.trial.allowed.motion is not None
    for sized in (True, False):
        _switch(axis, m.JoystickDisable(), sized)
        if may_enable:
            _switch(axis, m.JoystickEnable(), sized)
            _switch(axis, m.JoystickDisable(), sized)
    if not may_enable:
        axis.trial.info(
            "the joystick was disabled, and is not enabled without permission for motion "
            "(--allow-motion)"
        )
    for each, enabled in others.items():
        axis.trial.must(
            each.status.joystick_enabled is enabled,
            f"the joystick of axis {axis.name} was switched, and bit 3 of axis {each.name} changed; "
            "it should not change",
            rule="status-joystick-bit",
            cause=Cause("joystick", "another axis"),
        )


def _put_back(axis: Axis, enabled: bool, *, told: bool) -> None:
    """Restore the state; for another axis, only if the controller has changed it."""
    if told or axis.status.joystick_enabled is not enabled:
        _switch(axis, m.JoystickEnable() if enabled else m.JoystickDisable(), None)


def _others(axis: Axis) -> list[Axis]:
    """Return the other axes that report the bit."""
    return [
        Axis(axis.trial, place)
        for place in axis.trial.declared.places
        if place != axis.place and "READ_STATUS_BYTE" in place.messages
    ]


def _switch(axis: Axis, command: Command, sized: bool | None) -> None:
    axis.line.settle()
    axis.tell(command, sized=sized)
    wanted, name = command == m.JoystickEnable(), command.layout.message
    form = {None: "", True: " with the size 0", False: " without its size"}[sized]
    status = axis.status
    axis.trial.must(
        status.joystick_enabled is wanted,
        f"after {name}{form}, the status byte of axis {axis.name} is {int(status):#04x}; bit 3 "
        f"should be {int(wanted)}",
        came=bytes((int(status),)),
        rule="joystick-enabled" if wanted else "joystick-disabled",
        cause=Cause(name, f"effect{form}"),
    )
