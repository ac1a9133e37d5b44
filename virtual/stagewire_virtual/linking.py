"""``virtual://`` URLs: links to controllers in this process, in memory and in real time.

:func:`stagewire.links.open_link` opens ``virtual://TDC001?stage=Z8&seed=1`` with this module, through the
entry point ``virtual`` of ``stagewire.links``. Each call makes a new controller, which ends with its link.
The controller runs only when its link is used; what was due in between then happens at its own instants.

============================================  ==========================================================
``virtual://TDC001``                          a unit by name
``virtual://TDC001?stage=Z8&travel=512000``   with options
``virtual://rack?bays=MST601,,MPZ601``        a rack of modules: one name per bay, empty for an empty bay
``virtual://bench.toml#focus``                a unit of a bench file by label (or by number, from 1)
============================================  ==========================================================

The options are the keys of a unit in a bench file, without the endpoints and the settings of single channels:
``stage``, ``travel`` and ``position`` apply to every channel. Separate the items of a list by commas
(``quirks=a,b``), but give each fault its own option:
``faults=to_host drop frame every=10&faults=to_host drop byte p=0.01``.
A strategy of the MS-2000 is ``strategies=name:value``.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from typing import Any, Final
from urllib.parse import parse_qsl, unquote, urlsplit

from stagewire.errors import LinkOpenError
from stagewire.links import LinkSettings
from stagewire_virtual.bench import BenchUnit, load_bench, make_bench
from stagewire_virtual.errors import BenchError, VirtualError
from stagewire_virtual.factory import Blueprint
from stagewire_virtual.links import AsyncVirtualLink, SteppedLink, VirtualLink

__all__ = ["AsyncVirtualLink", "SteppedLink", "VirtualLink", "open_async_link", "open_link"]

_Read = Callable[[list[str]], Any]


def _one(read: Callable[[str], Any]) -> _Read:
    """Return a reader for an option that may be given only once."""

    def read_one(values: list[str]) -> Any:
        if len(values) > 1:
            raise ValueError("given more than once")
        return read(values[0])

    return read_one


def _number(text: str) -> int:
    try:
        return int(text)
    except ValueError:
        raise ValueError(f"expected a whole number, not {text!r}") from None


def _flag(text: str) -> bool:
    if text not in ("true", "false"):
        raise ValueError(f"expected true or false, not {text!r}")
    return text == "true"


def _names(values: list[str]) -> list[str]:
    return [name.strip() for value in values for name in value.split(",")]


def _numbers(values: list[str]) -> list[int]:
    return [_number(text) for text in _names(values)]


def _pairs(values: list[str]) -> dict[str, str]:
    pairs = [text.partition(":") for text in _names(values)]
    return {name: value for name, _, value in pairs}


_OPTIONS: Final[Mapping[str, _Read]] = {
    "stage": _one(str),
    "travel": _one(_number),
    "position": _one(_number),
    "seed": _one(_number),
    "model": _one(str),
    "serial_number": _one(_number),
    "hardware_type": _one(_number),
    "stage_id": _one(_number),
    "line": _one(str),
    "quirks": _names,
    "answer_unsupported": _one(_flag),
    "empty_bays": _numbers,
    "strategies": _pairs,
    "faults": list,
    "bays": _names,
}
"""The reader of each option of a URL; the bench reader then interprets the values."""


_SOURCE: Final = "URL"
_WHERE: Final = re.compile(rf"{_SOURCE}: unit 1( \([^)]*\))?, ")
"""The position that a bench problem begins with, which is useless for a URL."""


def blueprint_of(url: str) -> Blueprint:
    """Return the controller that a URL describes.

    Raises :class:`~stagewire.errors.LinkOpenError` with all problems of the URL.
    """
    try:
        parts = urlsplit(url)
        name = unquote(parts.netloc + parts.path).rstrip("/")
        if name.lower().endswith(".toml"):
            return _of_bench(name, unquote(parts.fragment))
        if not name:
            raise ValueError("the URL names no unit; write for example virtual://TDC001")
        table = {**_table(parts.query), "name": name}
        return make_bench([table], source=_SOURCE, called=_option_name).units[0].blueprint
    except BenchError as error:
        problems = "; ".join(_WHERE.sub("", problem) for problem in error.problems)
        raise LinkOpenError(f"{url} cannot be opened: {problems}") from None
    except (ValueError, VirtualError) as error:
        raise LinkOpenError(f"{url} cannot be opened: {error}") from None


def _table(query: str) -> dict[str, Any]:
    """Return the options of a query as a table in the form of a bench file."""
    given: dict[str, list[str]] = {}
    for key, value in parse_qsl(query, keep_blank_values=True, separator="&"):
        given.setdefault(key, []).append(value)
    table: dict[str, Any] = {}
    for key, values in given.items():
        if key not in _OPTIONS:
            raise ValueError(f"unknown option {key!r} (options: {', '.join(_OPTIONS)})")
        try:
            table[key] = _OPTIONS[key](values)
        except ValueError as error:
            raise ValueError(f"option {key}: {error}") from None
    return table


def _of_bench(path: str, label: str) -> Blueprint:
    units = load_bench(path).units
    found = [unit for number, unit in enumerate(units, 1) if label in (unit.label, str(number))]
    if len(found) == 1:
        return found[0].blueprint
    if not label and len(units) == 1:
        return units[0].blueprint
    raise VirtualError(_unit_of_fragment(label, units, len(found)))


def _unit_of_fragment(label: str, units: tuple[BenchUnit, ...], found: int) -> str:
    labels = ", ".join(f"{number} {unit.label}" for number, unit in enumerate(units, 1))
    if not label:
        what = "it has several units; choose one with #LABEL or #NUMBER"
    else:
        what = f"{'no unit has' if not found else 'several units have'} the label {label!r}"
    return f"{what} (units: {labels})"


def _option_name(key: str) -> str:
    return "the name" if key == "name" else f"option {key}"


def open_link(url: str, settings: LinkSettings) -> VirtualLink:
    """Make the controller of a URL and return a link to it; the serial ``settings`` are ignored.

    Raises :class:`~stagewire.errors.LinkOpenError` with all problems of the URL.
    """
    return VirtualLink(url, blueprint_of(url).make)


async def open_async_link(url: str, settings: LinkSettings) -> AsyncVirtualLink:
    """Make the controller of a URL and return a link for the running event loop; see :func:`open_link`."""
    return await AsyncVirtualLink.open(url, blueprint_of(url).make)
