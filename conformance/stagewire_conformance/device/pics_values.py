"""Converters for the values of a PICS. Their errors state what is wrong and what was expected."""

from __future__ import annotations

import difflib
import math
import re
from collections.abc import Collection, Mapping, Sequence
from fractions import Fraction
from typing import Any, Final

from stagewire.devices import Unit
from stagewire.errors import BadValueError, StagewireError
from stagewire.quantities import exact
from stagewire_conformance.device.permissions import Range
from stagewire_virtual.toml_tables import integer, table_of, text

_FIRMWARE: Final = re.compile(r"[0-9]{1,9}(\.[0-9]{1,9})*[A-Za-z]?")
_FACTOR: Final = re.compile(r"[0-9]{1,15}(\.[0-9]{1,15}|/[0-9]{1,15})?")
_LINE: Final = 100
_LINES: Final = ("usb", "rs232")


class _WrongError(StagewireError):
    """An invalid value."""


def as_it_is(value: Any) -> Mapping[str, Any]:
    """Return a table without converting its values."""
    found: dict[str, Any] = table_of(lambda each: each)(value)
    return found


def one_of(what: str, known: Collection[str], value: Any) -> str:
    """Return the spelling of a name in ``known``, ignoring case."""
    name = text(value)
    spelled = {each.upper(): each for each in known}
    if name.upper() not in spelled:
        close = difflib.get_close_matches(name.upper()[:40], spelled, n=1)
        there = f"choose one of {', '.join(known)}"
        hint = f"did you mean {spelled[close[0]]}?" if close else there
        raise _WrongError(f"unknown {what} {name!r}; {hint}")
    return spelled[name.upper()]


def line(value: Any) -> str:
    """Return the type of a line: ``usb`` or ``rs232``."""
    name = text(value)
    if name.lower() not in _LINES:
        raise _WrongError(f"unknown line {name!r} (choose one of {', '.join(_LINES)})")
    return name.lower()


def one_line(value: Any) -> str:
    """Return a printable text that fits on one line of a report."""
    found = text(value).strip()
    if not found or not found.isprintable() or len(found) > _LINE:
        raise _WrongError(f"expected one line of at most {_LINE} characters, not {found[:200]!r}")
    return found


def occupied(bays: Sequence[int], value: Any) -> int:
    """Return the number of an occupied bay."""
    bay = integer(value)
    if bay not in bays:
        there = f"occupied: {', '.join(map(str, bays))}" if bays else "this unit has no bays"
        raise _WrongError(f"bay {bay} is not occupied ({there})")
    return bay


def within(first: int, last: int, value: Any) -> int:
    """Return a number from ``first`` to ``last``."""
    number = integer(value)
    if not first <= number <= last:
        there = f"{first} to {last}" if last > first else f"{first}"
        raise _WrongError(f"{number} does not exist; expected {there}")
    return number


def channel_in(unit: Unit | None, value: Any) -> int:
    """Return the number of a channel of a unit; messages of some units have another number for it."""
    number = integer(value)
    if unit is None:
        return within(1, 1, number)
    if 1 <= number <= unit.channels:
        return number
    idents = unit.channel_idents
    there = "only channel 1" if unit.channels == 1 else f"channels 1 to {unit.channels}"
    what = f"{number} does not exist; {unit.name} has {there}"
    if number in idents:
        what += f"; in messages, channel {idents.index(number) + 1} has the number {number}"
    raise _WrongError(what)


def refuse(why: str, value: Any) -> None:
    """Refuse any value."""
    raise _WrongError(why)


def version(value: Any) -> str:
    """Return a firmware version."""
    found = text(value)
    if not _FIRMWARE.fullmatch(found):
        raise _WrongError(f'expected a version such as "3.3", not {found!r}')
    return found


def milliseconds(value: Any) -> float:
    """Return a time in milliseconds above 0."""
    if type(value) not in (int, float) or not 0 < value < math.inf:
        raise _WrongError(f"expected a number of milliseconds above 0, not {value!r}")
    return float(value)


def factor(value: Any) -> Fraction:
    """Return the exact number of counts per unit. A TOML float is refused: it is not exact."""
    if type(value) is not int and not (isinstance(value, str) and _FACTOR.fullmatch(value)):
        raise _WrongError(
            f'expected a number in quotes, such as "34304" or "1000/3", not {value!r}'
        )
    try:
        found = exact(value)
    except BadValueError as error:
        raise _WrongError(str(error)) from None
    if found <= 0:
        raise _WrongError(f"expected a number above 0, not {value}")
    return found


def span(value: Any) -> Range:
    """Return a range with its unit."""
    return Range.parse(text(value))


def reasons(listed: frozenset[str], unit: str, value: Any) -> dict[str, str]:
    """Return unsupported messages with the reasons."""
    found: dict[str, str] = table_of(text)(value)
    wrong = []
    for name, reason in found.items():
        if name not in listed:
            close = difflib.get_close_matches(name.upper()[:80], listed, n=1)
            hint = f"; did you mean {close[0]}?" if close else ""
            wrong.append(f"{name} is not a message of {unit}{hint}")
        elif not reason.strip():
            wrong.append(f'give a reason why {name} is not supported, such as "not fitted"')
    if wrong:
        raise _WrongError("; ".join(wrong))
    return found
