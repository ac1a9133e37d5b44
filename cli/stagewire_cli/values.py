"""Values as people write them on the command line: integers, names, flags, text, bytes."""

from __future__ import annotations

import operator
import re
from collections.abc import Iterable, Mapping
from functools import reduce
from typing import Any

from stagewire_cli.errors import CalledWronglyError
from stagewire_cli.hextext import parse_hex

__all__ = ["parse_address", "parse_assignments", "parse_axis", "parse_value"]

Json = dict[str, Any]

_INTEGER = re.compile(r"[+-]?(?:0[xX][0-9A-Fa-f]{1,16}|[0-9]{1,20})\Z")


def parse_assignments(words: Iterable[str]) -> dict[str, str]:
    """Return ``field=value`` words as a mapping."""
    made: dict[str, str] = {}
    for word in words:
        name, equals, value = word.partition("=")
        if not equals or not name:
            raise CalledWronglyError(f"{word!r} is not field=value")
        if name in made:
            raise CalledWronglyError(f"{name} is given twice")
        made[name] = value
    return made


def parse_value(name: str, text: str, field: Json) -> int | str:
    """Return what ``text`` says for a field: an integer, text, or hex of a byte string."""
    kind = field.get("kind")
    if kind == "text":
        return text
    if kind == "bytes":
        try:
            return parse_hex(text).hex()
        except ValueError as error:
            raise CalledWronglyError(f"{name}: {str(error).removeprefix('line 1: ')}") from None
    integer = _integer(text)
    if integer is not None:
        return integer
    values: dict[str, int] = field.get("enum") or {}
    bits: dict[str, int] = field.get("flags") or {}
    added = {*field.get("modifiers", ()), *bits}
    numbers = {known.lower(): number for known, number in (values | bits).items()}
    alone = {known.lower() for known in values if known not in added}
    parts = [part.strip().lower() for part in re.split(r"[|,+]", text)]
    if all(part in numbers for part in parts) and sum(part in alone for part in parts) <= 1:
        return reduce(operator.or_, (numbers[part] for part in parts))
    if not numbers:
        raise CalledWronglyError(f"{name} takes an integer such as 5 or 0x05, not {text!r}")
    known = ", ".join([*values, *bits])
    several = ", or several joined by |" if added else ""
    raise CalledWronglyError(
        f"{name} {text!r} is not one of {known}{several}, nor an integer such as 5 or 0x05"
    )


def parse_address(option: str, text: str) -> int:
    """Return an address in decimal or hex."""
    value = _integer(text)
    if value is None:
        raise CalledWronglyError(f"{option} takes an address such as 0x50, not {text!r}")
    return value


def parse_axis(option: str, text: str, axes: Mapping[str, int]) -> int:
    """Return the identifier of an axis, which may be given by its name in any case."""
    named = {name.lower(): id for name, id in axes.items()}.get(text.lower())
    value = _integer(text) if named is None else named
    if value is None:
        known = ", ".join(f"{name} ({id:#04x})" for name, id in axes.items())
        raise CalledWronglyError(
            f"{option} takes an axis: {known}, or the number of another; not {text!r}"
        )
    return value


def _integer(text: str) -> int | None:
    if not _INTEGER.match(text):
        return None
    return int(text, 16) if "x" in text.lower() else int(text)
