"""Readers for TOML tables that report all problems together."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final, TypeVar

from stagewire.errors import StagewireError

_T = TypeVar("_T")
_D = TypeVar("_D")

Convert = Callable[[Any], _T]
"""Converts a TOML value; raises :class:`~stagewire.errors.StagewireError` if the value is invalid."""

_KINDS: Final[dict[type, str]] = {
    bool: "true or false",
    int: "an integer",
    float: "a number",
    str: "a string",
}


class _WrongKindError(StagewireError):
    """A value has an unexpected type."""

    def __init__(self, expected: str, value: Any) -> None:
        came = (
            "a table"
            if isinstance(value, dict)
            else "a list"
            if isinstance(value, list)
            else repr(value)
        )
        super().__init__(f"expected {expected}, not {came}")


class _WrongValuesError(StagewireError):
    """Values in a list are invalid."""


def key_label(key: str) -> str:
    """Return the default name of a key in a problem."""
    return f"key {key}"


class Table:
    """A table that is read key by key.

    :param values: the values by key.
    :param where: the position of the table, such as ``bench.toml: unit 2``, with which each problem begins.
    :param problems: the list to which problems are added.
    :param called: returns the name of a key as the user wrote it.
    """

    def __init__(
        self,
        values: Mapping[str, Any],
        where: str,
        problems: list[str],
        called: Callable[[str], str] = key_label,
    ) -> None:
        self._values = values
        self._known: dict[str, None] = {}  # in the order in which they were read
        self._problems = problems
        self._called = called
        self.where = where

    def __contains__(self, key: str) -> bool:
        return key in self._values

    def take(self, key: str, convert: Convert[_T], otherwise: _D) -> _T | _D:
        """Return the converted value of a key, or ``otherwise`` if it is missing or invalid."""
        self._known[key] = None
        if key not in self._values:
            return otherwise
        try:
            return convert(self._values[key])
        except StagewireError as error:
            self.wrong(key, str(error))
            return otherwise

    def inner(self, values: Mapping[str, Any], what: str) -> Table:
        """Return a table inside this one, which adds its problems to the same list."""
        return Table(values, f"{self.where}, {what}", self._problems, self._called)

    def wrong(self, keys: str | Sequence[str], what: str) -> None:
        """Add a problem with a key, or with several keys together."""
        names = [keys] if isinstance(keys, str) else keys
        called = ", ".join(map(self._called, names))
        self._problems.append(f"{self.where}, {called}: {what}")

    def refuse_others(self) -> None:
        """Add a problem for each key that was not read."""
        for key in self._values:
            if key not in self._known:
                close = difflib.get_close_matches(key[:40], self._known, n=1)
                hint = (
                    f"did you mean {close[0]}?"
                    if close
                    else f"known keys: {', '.join(self._known)}"
                )
                self.wrong(key, f"unknown key; {hint}")


def _of_type(kind: type[_T]) -> Convert[_T]:
    def convert(value: Any) -> _T:
        if type(value) is not kind:  # True is not an integer in TOML
            raise _WrongKindError(_KINDS[kind], value)
        return value

    return convert


text: Final = _of_type(str)
integer: Final = _of_type(int)
flag: Final = _of_type(bool)


def list_of(convert: Convert[_T]) -> Convert[tuple[_T, ...]]:
    """Return a converter from a list to a tuple, which reports every invalid value."""

    def convert_all(value: Any) -> tuple[_T, ...]:
        if not isinstance(value, list | tuple):
            raise _WrongKindError("a list", value)
        made: list[_T] = []
        wrong: list[str] = []
        for each in value:
            try:
                made.append(convert(each))
            except StagewireError as error:
                wrong.append(str(error))
        if wrong:
            raise _WrongValuesError("; ".join(wrong))
        return tuple(made)

    return convert_all


def table_of(convert: Convert[_T]) -> Convert[dict[str, _T]]:
    """Return a converter from a table to a mapping."""

    def convert_all(value: Any) -> dict[str, _T]:
        if not isinstance(value, Mapping):
            raise _WrongKindError("a table", value)
        return {key: convert(each) for key, each in value.items()}

    return convert_all


def tables_of(header: str) -> Convert[tuple[Mapping[str, Any], ...]]:
    """Return a converter that accepts a list of tables; each begins with a line ``[[header]]``."""
    convert_all = list_of(_table)

    def convert(value: Any) -> tuple[Mapping[str, Any], ...]:
        if isinstance(value, Mapping):
            raise _WrongKindError(f"a list: each begins with a line [[{header}]]", value)
        return convert_all(value)

    return convert


def _table(value: Any) -> Mapping[str, Any]:
    if not isinstance(value, Mapping):
        raise _WrongKindError("a table", value)
    return value
