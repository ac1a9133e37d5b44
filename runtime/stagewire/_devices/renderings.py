"""Values as short text, as HTML for notebooks, and as quantities of pint."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from enum import Enum
from html import escape
from importlib import import_module
from typing import TYPE_CHECKING, Any, Final, Protocol

from stagewire._codec.flags import Flags
from stagewire.errors import UnsupportedError

if TYPE_CHECKING:
    from datetime import datetime

_WIDTH: Final = 100
"""Maximum length of the short text of values."""
_MOVING: Final = ("moving_", "jogging_", "homing")
"""How the names of bits begin that show motion."""


class Reported(Protocol):
    """The part of :class:`~stagewire.devices.Values` that is shown."""

    @property
    def received_at(self) -> datetime:
        """When they arrived."""

    def in_units(self) -> Iterator[tuple[str, Any]]:
        """Yield the values by name."""


def short(values: Reported) -> str:
    """Return one line: the position, whether it is homed and moves, then as much of the rest as fits."""
    text = f"<{type(values).__name__} "
    parts = _parts(values)
    for n, part in enumerate(parts):
        more = f"{', ' if n else ''}{part}"
        room = _WIDTH - len(", …>" if n + 1 < len(parts) else ">")
        if n and len(text) + len(more) > room:
            return f"{text}, …>"
        text += more
    return f"{text.rstrip()}>"


def _parts(values: Reported) -> list[str]:
    """Return the parts of the short text, the most important first."""
    first: list[str] = []
    last: list[str] = []
    states: list[str] = []
    numbers: list[str] = []
    bits: list[str] = []
    for name, value in values.in_units():
        if isinstance(value, Flags):
            told, rest = _states(value)
            states += told
            bits += rest
        else:
            described = vars(type(values))[name]
            kind = {"position": first, "chan_ident": last}.get(described.field, numbers)
            kind.append(_entry(described, name, value))
    return [*first, *states, *numbers, *bits, *last]


def _entry(described: Any, name: str, value: object) -> str:
    if unit := _unit(described):
        return f"{described.field} {value:.7g} {unit}"
    return f"{name} {_text(value)}"


def _states(value: Flags) -> tuple[list[str], list[str]]:
    """Return whether the stage is homed and moves, and the names of the other bits that are set."""
    named = list(value.names)
    moving = [name for name in named if name.startswith(_MOVING)]
    states = []
    if "homed" in value.bits:
        states.append("homed" if "homed" in named else "not homed")
    if moving:
        states.append(" and ".join(name.replace("_", " ") for name in moving))
    elif any(name.startswith(_MOVING) for name in value.bits):
        states.append("at rest")
    rest = [name for name in named if name != "homed" and name not in moving]
    return states, [*rest, *([hex(value.unnamed)] if value.unnamed else [])]


def _unit(described: object) -> str:
    """Return the unit of a value; empty for counts and names."""
    unit: str = getattr(described, "unit", "")
    return unit


def _text(value: object) -> str:
    if isinstance(value, Flags):
        return ", ".join([*value.names, *([hex(value.unnamed)] if value.unnamed else [])]) or "none"
    if isinstance(value, Enum):
        return value.name
    if isinstance(value, float):
        return f"{value:.7g}"
    if isinstance(value, bytes):
        return value.hex(" ")
    text = str(value)
    return text if text.isprintable() else repr(text)


def quantities(values: Reported) -> dict[str, Any]:
    """Return the values with known units as quantities of pint, by the name of their field.

    They belong to the application registry of pint. A unit that it does not know, such as the NT of
    NanoTraks, is defined there and has a dimension of its own.

    Raise :class:`~stagewire.errors.UnsupportedError` if pint is not installed.
    """
    try:
        pint = import_module("pint")
    except ImportError:
        raise UnsupportedError("pint is not installed: run pip install 'stagewire[pint]'") from None
    registry = pint.get_application_registry()
    described = vars(type(values))
    found = {}
    for name, value in values.in_units():
        if unit := _unit(described[name]):
            if unit.isidentifier() and unit not in registry:
                registry.define(f"{unit} = [{unit}]")
            found[described[name].field] = registry.Quantity(value, unit)
    return found


def html_of_values(values: Reported) -> str:
    """Return values as a table of HTML."""
    when = values.received_at.isoformat(sep=" ", timespec="milliseconds")
    return table(f"{type(values).__name__}, received {when}", _rows(values))


def _rows(values: Reported) -> Iterator[tuple[str, str]]:
    described = vars(type(values))
    for name, value in values.in_units():
        if unit := _unit(described[name]):
            yield described[name].field, f"{value:.7g} {unit}"
        else:
            yield name, _text(value)


def table(caption: str, rows: Iterable[tuple[str, str]]) -> str:
    cells = "".join(
        f'<tr><th style="text-align: left">{escape(name)}</th>'
        f'<td style="text-align: left">{escape(text)}</td></tr>'
        for name, text in rows
    )
    return f"<table><caption>{escape(caption)}</caption><tbody>{cells}</tbody></table>"
