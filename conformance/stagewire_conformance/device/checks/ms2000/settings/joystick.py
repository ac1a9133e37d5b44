"""The joystick or knob: disabled and enabled, and its status bit (sections 14, 26 and 27)."""

from __future__ import annotations

from functools import partial
from typing import Final

from stagewire.protocols import Command
from stagewire_conformance.device.causes import EFFECT, Cause
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
    _judge(axis, m.JoystickDisable(), _forms_that_work(axis, m.JoystickDisable(), may_enable))
    if may_enable:
        _judge(axis, m.JoystickEnable(), _forms_that_work(axis, m.JoystickEnable(), may_enable))
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
    if not told and axis.status.joystick_enabled is enabled:
        return
    command = m.JoystickEnable() if enabled else m.JoystickDisable()
    if not any(_has_effect(axis, command, sized) for sized in (None, True, False)):
        _judge(axis, command, ())


def _others(axis: Axis) -> list[Axis]:
    """Return the other axes that report the bit."""
    return [
        Axis(axis.trial, place)
        for place in axis.trial.declared.places
        if place != axis.place and "READ_STATUS_BYTE" in place.messages
    ]


def _forms_that_work(axis: Axis, command: Command, may_enable: bool) -> tuple[bool, ...]:
    """Return which forms of a command have their effect: with the size 0 (True), and without (False).

    Before each, the other command is sent in both forms, so that an effect can be seen.
    """
    works = []
    for sized in (True, False):
        if may_enable:
            other = m.JoystickDisable() if command == m.JoystickEnable() else m.JoystickEnable()
            any(_has_effect(axis, other, form) for form in (True, False))
        if _has_effect(axis, command, sized):
            works.append(sized)
    return tuple(works)


def _has_effect(axis: Axis, command: Command, sized: bool | None) -> bool:
    """Send a command, and return whether bit 3 then shows its effect."""
    axis.line.settle()
    axis.tell(command, sized=sized)
    return axis.status.joystick_enabled is (command == m.JoystickEnable())


def _judge(axis: Axis, command: Command, works: tuple[bool, ...]) -> None:
    """Report a command without effect, and one that needs its size, or must not have it."""
    name, wanted = command.layout.message, command == m.JoystickEnable()
    status = axis.status
    if not works:
        axis.trial.must(
            False,
            f"after {name}, the status byte of axis {axis.name} is {int(status):#04x}; bit 3 should be "
            f"{int(wanted)}",
            came=bytes((int(status),)),
            rule="joystick-enabled" if wanted else "joystick-disabled",
            cause=Cause(name, EFFECT),
            because=(_NO_EFFECT,) if wanted else (),
        )
        return
    forms = {True: "with the size 0", False: "without its size"}
    missing = [form for sized, form in forms.items() if sized not in works]
    axis.trial.must(
        not missing,
        f"{name} of axis {axis.name} has no effect {' or '.join(missing)}, but it has one "
        f"{forms[works[0]]}; its size is optional",
        rule="joystick-size-optional" if wanted else "joystick-disable-size-optional",
        cause=Cause("joystick", f"size {works[0]}"),
    )


_NO_EFFECT: Final = Cause("JOYSTICK_DISABLE", EFFECT)
"""With this defect, the bit does not change, so that enabling shows nothing."""
