"""What the values of a PICS mean; an error says what is wrong with one, and what was expected."""

from __future__ import annotations

import difflib
import math
import re
from collections.abc import Collection, Mapping, Sequence
from fractions import Fraction
from typing import Any, Final

from stagewire.errors import BadValueError, StagewireError
from stagewire.quantities import exact
from stagewire_conformance.device.permissions import Range
from stagewire_virtual.toml_tables import integer, table_of, text

_FIRMWARE: Final = re.compile(r"[0-9]{1,9}(\.[0-9]{1,9})*[A-Za-z]?")
_FACTOR: Final = re.compile(r"[0-9]{1,15}(\.[0-9]{1,15}|/[0-9]{1,15})?")
_LINES: Final = ("usb", "rs232")


class _WrongError(StagewireError):
    """A value that is wrong; the text says why."""


def as_it_is(value: Any) -> Mapping[str, Any]:
    """Return a table, whatever is in it."""
    found: dict[str, Any] = table_of(lambda each: each)(value)
    return found


def one_of(what: str, known: Collection[str], value: Any) -> str:
    """Return a name as it is known, in any case."""
    name = text(value)
    spelled = {each.upper(): each for each in known}
    if name.upper() not in spelled:
        close = difflib.get_close_matches(name.upper()[:40], spelled, n=1)
        there = f"there are: {', '.join(known)}"
        hint = f"did you mean {spelled[close[0]]}?" if close else there
        raise _WrongError(f"there is no {what} {name!r}; {hint}")
    return spelled[name.upper()]


def line(value: Any) -> str:
    """Return what a controller is connected by."""
    name = text(value)
    if name.lower() not in _LINES:
        raise _WrongError(f"{name!r} is not one of {', '.join(_LINES)}")
    return name.lower()


def occupied(bays: Sequence[int], value: Any) -> int:
    """Return a bay that is occupied."""
    bay = integer(value)
    if bay not in bays:
        there = f"occupied: {', '.join(map(str, bays))}" if bays else "this unit has no bays"
        raise _WrongError(f"there is nothing in bay {bay} ({there})")
    return bay


def within(first: int, last: int, value: Any) -> int:
    """Return a number from ``first`` to ``last``."""
    number = integer(value)
    if not first <= number <= last:
        there = f"{first} to {last}" if last > first else f"{first} alone"
        raise _WrongError(f"{number} is not there; there is {there}")
    return number


def refuse(why: str, value: Any) -> None:
    """Take no value at all."""
    raise _WrongError(why)


def version(value: Any) -> str:
    """Return a version of a firmware."""
    found = text(value)
    if not _FIRMWARE.fullmatch(found):
        raise _WrongError(f'expected a version such as "3.3", not {found!r}')
    return found


def milliseconds(value: Any) -> float:
    """Return a time above 0."""
    if type(value) not in (int, float) or not 0 < value < math.inf:
        raise _WrongError(f"expected a number of milliseconds above 0, not {value!r}")
    return float(value)


def factor(value: Any) -> Fraction:
    """Return how many counts make a unit, exactly: a float of TOML is not what was written."""
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
    """Return messages of a unit, each with the reason why it is not supported."""
    found: dict[str, str] = table_of(text)(value)
    wrong = []
    for name, reason in found.items():
        if name not in listed:
            close = difflib.get_close_matches(name.upper()[:80], listed, n=1)
            hint = f"; did you mean {close[0]}?" if close else ""
            wrong.append(f"{name} is no message of {unit}{hint}")
        elif not reason.strip():
            wrong.append(f'say why {name} is not supported, such as "not fitted"')
    if wrong:
        raise _WrongError("; ".join(wrong))
    return found
