"""Tables of TOML that are read key by key, with everything that is wrong with them."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final, TypeVar

from stagewire.errors import StagewireError

_T = TypeVar("_T")
_D = TypeVar("_D")

Convert = Callable[[Any], _T]
"""Makes something of a value of TOML; a :class:`~stagewire.errors.StagewireError` says what is wrong."""

_KINDS: Final[dict[type, str]] = {
    bool: "true or false",
    int: "an integer",
    float: "a number",
    str: "a text",
}


class _WrongKindError(StagewireError):
    """A value of another type than expected."""

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
    """Values in a list that are wrong."""


def key_label(key: str) -> str:
    """Return what a problem calls the key that it is about."""
    return f"key {key}"


class Table:
    """A table that is read key by key.

    :param values: by key.
    :param where: where it stands, such as ``bench.toml: unit 2``; begins each problem.
    :param problems: where problems are added.
    :param called: gives a key the name that it has for who wrote it.
    """

    def __init__(
        self,
        values: Mapping[str, Any],
        where: str,
        problems: list[str],
        called: Callable[[str], str] = key_label,
    ) -> None:
        self._values = values
        self._known: dict[str, None] = {}  # in the order in which they were asked for
        self._problems = problems
        self._called = called
        self.where = where

    def __contains__(self, key: str) -> bool:
        return key in self._values

    def take(self, key: str, convert: Convert[_T], otherwise: _D) -> _T | _D:
        """Return the value of a key as ``convert`` makes it, ``otherwise`` without one that is right."""
        self._known[key] = None
        if key not in self._values:
            return otherwise
        try:
            return convert(self._values[key])
        except StagewireError as error:
            self.wrong(key, str(error))
            return otherwise

    def inner(self, values: Mapping[str, Any], what: str) -> Table:
        """Return a table inside of this one; its problems are added to the same ones."""
        return Table(values, f"{self.where}, {what}", self._problems, self._called)

    def wrong(self, keys: str | Sequence[str], what: str) -> None:
        """Note that something is wrong with a key, or with several together."""
        names = [keys] if isinstance(keys, str) else keys
        called = ", ".join(map(self._called, names))
        self._problems.append(f"{self.where}, {called}: {what}")

    def refuse_others(self) -> None:
        """Note each key that nobody has asked for."""
        for key in self._values:
            if key not in self._known:
                close = difflib.get_close_matches(key[:40], self._known, n=1)
                hint = (
                    f"did you mean {close[0]}?" if close else f"there are: {', '.join(self._known)}"
                )
                self.wrong(key, f"there is no such key; {hint}")


def _of_type(kind: type[_T]) -> Convert[_T]:
    def convert(value: Any) -> _T:
        if type(value) is not kind:  # True is no integer here
            raise _WrongKindError(_KINDS[kind], value)
        return value

    return convert


text: Final = _of_type(str)
integer: Final = _of_type(int)
flag: Final = _of_type(bool)


def list_of(convert: Convert[_T]) -> Convert[tuple[_T, ...]]:
    """Return what makes a tuple of a list, value by value, and says of each that is wrong what is."""

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
    """Return what makes a mapping of a table, value by value."""

    def convert_all(value: Any) -> dict[str, _T]:
        if not isinstance(value, Mapping):
            raise _WrongKindError("a table", value)
        return {key: convert(each) for key, each in value.items()}

    return convert_all


def tables_of(header: str) -> Convert[tuple[Mapping[str, Any], ...]]:
    """Return what takes a list of tables as they are; each begins with a line ``[[header]]``."""
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
