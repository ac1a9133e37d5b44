"""``virtual://``: links to controllers in this process, in memory and in real time.

:func:`stagewire.links.open_link` opens ``virtual://TDC001?stage=Z8&seed=1`` here, by the entry point
``virtual`` of ``stagewire.links``. Each opening makes a new controller, which ends with its link. A
controller here lives when somebody looks: what it did meanwhile, it has done at the right times.

============================================  ==========================================================
``virtual://TDC001``                          a unit by its name
``virtual://TDC001?stage=Z8&travel=512000``   with options
``virtual://rack?bays=MST601,,MPZ601``        a rack of modules, a name for each bay, none for an empty one
``virtual://bench.toml#focus``                a unit of a bench file by its label (or its number from 1)
============================================  ==========================================================

Options are the keys of a unit in a bench file, but for the endpoints, and channels one by one: ``stage``,
``travel`` and ``position`` hold for every channel. A list is written with commas (``quirks=a,b``), except
that each fault is an option of its own:
``faults=to_host drop frame every=10&faults=to_host lose byte p=0.01``.
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
    """Return what reads an option that may be given once."""

    def read_one(values: list[str]) -> Any:
        if len(values) > 1:
            raise ValueError("it is there twice")
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
"""How the options of a URL are read; what they mean is said by who reads bench files."""


_SOURCE: Final = "URL"
_WHERE: Final = re.compile(rf"{_SOURCE}: unit 1( \([^)]*\))?, ")
"""Where a bench file would have a problem; of a URL that is no news."""


def blueprint_of(url: str) -> Blueprint:
    """Return the controller that a URL describes.

    Raises :class:`~stagewire.errors.LinkOpenError` with everything that is wrong with it.
    """
    try:
        parts = urlsplit(url)
        name = unquote(parts.netloc + parts.path).rstrip("/")
        if name.lower().endswith(".toml"):
            return _of_bench(name, unquote(parts.fragment))
        if not name:
            raise ValueError("it names no unit; write virtual://TDC001")
        table = {**_table(parts.query), "name": name}
        return make_bench([table], source=_SOURCE, called=_option_name).units[0].blueprint
    except BenchError as error:
        problems = "; ".join(_WHERE.sub("", problem) for problem in error.problems)
        raise LinkOpenError(f"{url} cannot be opened: {problems}") from None
    except (ValueError, VirtualError) as error:
        raise LinkOpenError(f"{url} cannot be opened: {error}") from None


def _table(query: str) -> dict[str, Any]:
    """Return the options as a table of a bench file has them."""
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
        what = "it has several units; say which one by #LABEL or #NUMBER"
    else:
        what = f"{'no unit' if not found else 'more than one unit'} is called {label!r}"
    return f"{what} (there are: {labels})"


def _option_name(key: str) -> str:
    return "the name" if key == "name" else f"option {key}"


def open_link(url: str, settings: LinkSettings) -> VirtualLink:
    """Make the controller of a URL, and a line to it; ``settings`` are those of wires, and not looked at.

    Raises :class:`~stagewire.errors.LinkOpenError` with all that is wrong with the URL.
    """
    return VirtualLink(url, blueprint_of(url).make)


async def open_async_link(url: str, settings: LinkSettings) -> AsyncVirtualLink:
    """Do as :func:`open_link` does, for the event loop that is running."""
    return await AsyncVirtualLink.open(url, blueprint_of(url).make)
