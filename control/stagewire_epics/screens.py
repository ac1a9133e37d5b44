"""Screens for Phoebus: one for each motor of a bench, by phoebusgen."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Final

import phoebusgen.screen
from phoebusgen import widget

from stagewire.errors import StagewireError
from stagewire_epics.motor import Motor
from stagewire_epics.records import Kind

_ROW: Final = 28
_LABEL, _VALUE = 90, 130
_WIDTH: Final = _LABEL + _VALUE + 40
_COLUMNS: Final = (
    (
        ("State", ("RBV", "EGU", "DMOV", "MOVN", "HLS", "LLS", "MISS", "LVIO")),
        ("Velocity", ("VELO", "ACCL")),
    ),
    (
        ("Motion", ("VAL", "RLV", "TWV", "SPMG")),
        ("Coordinates", ("OFF", "DIR", "SET", "FOFF", "HLM", "LLM")),
    ),
)
"""The groups of each column: a title, and the fields."""
_BUTTONS: Final = ("STOP", "TWR", "TWF", "HOMF")
_LIGHTS: Final = ("DMOV", "MOVN", "HLS", "LLS", "MISS", "LVIO")


class ScreenError(StagewireError):
    """Screens cannot be written."""


def write_screens(motors: Mapping[str, Motor], directory: Path) -> list[Path]:
    """Write a screen ``NAME.bob`` for each motor, and return the files. Existing files are replaced.

    Raise :class:`ScreenError`.
    """
    written = []
    try:
        directory.mkdir(parents=True, exist_ok=True)
        for name, motor in motors.items():
            path = directory / f"{name.replace(':', '_')}.bob"
            _screen(name, motor).write_screen(str(path))
            written.append(path)
    except OSError as error:
        raise ScreenError(f"{directory}: cannot write screens: {error.strerror}") from None
    return written


def _screen(name: str, motor: Motor) -> phoebusgen.screen.Screen:
    screen = phoebusgen.screen.Screen(name)
    x, y, width = 10, 10, _LABEL + _VALUE
    title = widget.Label("title", f"{name}  {motor.records['DESC'].value}", x, y, 2 * width, _ROW)
    title.font_size(20)
    screen.add_widget(title)
    bottom = 0
    for column, groups in enumerate(_COLUMNS):
        left, top = x + column * _WIDTH, y + _ROW
        for group, fields in groups:
            top += _ROW
            screen.add_widget(widget.Label(group, group, left, top, width, _ROW))
            for field in fields:
                top += _ROW
                for one in _widgets(motor, field, left, top):
                    screen.add_widget(one)
        bottom = max(bottom, top + 2 * _ROW)
    for number, field in enumerate(_BUTTONS):
        screen.add_widget(_button(motor, field, x + number * 100, bottom))
    screen.width(2 * _WIDTH)
    screen.height(bottom + 2 * _ROW)
    return screen


def _widgets(motor: Motor, field: str, x: int, y: int) -> list[object]:
    record = motor.records[field]
    label = widget.Label(f"{field} label", field, x, y, _LABEL, _ROW - 6)
    label.tool_tip(record.description)
    at = (record.name, x + _LABEL, y, _VALUE, _ROW - 6)
    if field in _LIGHTS:
        return [label, widget.LED(field, record.name, x + _LABEL, y, _ROW - 6, _ROW - 6)]
    if not record.writable:
        return [label, widget.TextUpdate(field, *at)]
    kind = widget.ComboBox if record.kind is Kind.CHOICE else widget.TextEntry
    return [label, kind(field, *at)]


def _button(motor: Motor, field: str, x: int, y: int) -> object:
    record = motor.records[field]
    button = widget.ActionButton(field, field, record.name, x, y, 90, _ROW)
    button.action_write_pv(record.name, 1, record.description)
    button.tool_tip(record.description)
    return button
