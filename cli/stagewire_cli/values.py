"""Parsing of values on the command line: integers, names, flags, text and bytes.

Hex text may have spaces, commas, colons, ``0x`` and comments after ``#``, and is read block by block.
"""

from __future__ import annotations

import contextlib
import operator
import re
from collections.abc import Iterable, Mapping
from functools import reduce
from typing import Any

from stagewire_cli.errors import CalledWronglyError
from stagewire_cli.real_numbers import parse_real

_SEPARATOR = re.compile(r"[\s,;:|_\-\[\](){}'\"]+|(?=\\x)")
_DIGITS = re.compile(r"[0-9A-Fa-f]+\Z")
_PREFIX = re.compile(r"0[xX]|\\x")
_LONG = 4096


def parse_hex(text: str) -> bytes:
    """Return the bytes of a whole text.

    Raises :class:`ValueError` with a message for users.
    """
    reader = HexText()
    return reader.feed(text) + reader.finish()


class HexText:
    """Converts blocks of hex text to bytes; keeps a word that a block cuts until the next block."""

    def __init__(self) -> None:
        self._tail = ""
        self._comment = False
        self._line = 1
        self._inside = False  # whether the beginning of the word in the tail was already returned

    def feed(self, block: str) -> bytes:
        """Convert the next block; raise :class:`ValueError` if it is not hex."""
        made = bytearray()
        for number, line in enumerate(block.split("\n")):
            if number:
                made += self._end_of_line()
            made += self._part(line)
        return bytes(made)

    def finish(self) -> bytes:
        """Convert the rest at the end of the text."""
        return self._end_of_line()

    def _end_of_line(self) -> bytes:
        made = self._word(self._tail)
        self._tail, self._comment, self._inside = "", False, False
        self._line += 1
        return made

    def _part(self, text: str) -> bytes:
        if self._comment:
            return b""
        text, hash_, _ = text.partition("#")
        self._comment = bool(hash_)
        text = self._tail + text
        made = bytearray()
        cut = text.rfind(" ") + 1
        if cut and not self._inside:
            # Fast path for pairs and spaces, as in nearly all hex text; fromhex accepts nothing that
            # the code below would not.
            with contextlib.suppress(ValueError):
                made += bytes.fromhex(text[:cut])
                text = text[cut:]
        *words, self._tail = _SEPARATOR.split(text)
        for word in words:
            made += self._word(word)
            self._inside = False
        if len(self._tail) > _LONG:
            whole = len(self._tail) - 2 - len(self._tail) % 2
            made += self._word(self._tail[:whole])
            self._tail, self._inside = self._tail[whole:], True
        return bytes(made)

    def _word(self, word: str) -> bytes:
        if not word:
            return b""
        prefix = None if self._inside else _PREFIX.match(word)
        digits = word[prefix.end() :] if prefix else word
        if prefix and len(digits) == 1:
            digits = f"0{digits}"
        if len(digits) % 2 or not _DIGITS.match(digits):
            shown = word if len(word) <= 40 else f"{word[:40]}…"
            raise ValueError(
                f"line {self._line}: {shown!r} is not a sequence of two-digit hex bytes"
            )
        return bytes.fromhex(digits)


Json = dict[str, Any]

_INTEGER = re.compile(r"[+-]?(?:0[xX][0-9A-Fa-f]{1,16}|[0-9]{1,20})\Z")


def parse_assignments(words: Iterable[str]) -> dict[str, str]:
    """Return ``field=value`` words as a mapping."""
    made: dict[str, str] = {}
    for word in words:
        name, equals, value = word.partition("=")
        if not equals or not name:
            raise CalledWronglyError(f"{word!r} is not FIELD=VALUE")
        if name in made:
            raise CalledWronglyError(f"{name} is given more than once")
        made[name] = value
    return made


def _integers(name: str, text: str) -> list[int]:
    """Return the integers of an array, which blanks or commas separate."""
    numbers = [_integer(part) for part in re.split(r"[\s,;]+", text.strip()) if part]
    known = [number for number in numbers if number is not None]
    if len(known) < len(numbers):
        raise CalledWronglyError(f"{name} must be integers such as '0 -5 0x05', not {text!r}")
    return known


def parse_value(name: str, text: str, field: Json) -> int | str | list[int]:
    """Return the value of a field: an integer, text, a byte string in hex, or the integers of an array.

    A real number is returned as its bit pattern.
    """
    kind = field.get("kind")
    if field.get("real"):
        return parse_real(name, text, field)
    if kind == "array":
        return _integers(name, text)
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
        raise CalledWronglyError(f"{name} must be an integer such as 5 or 0x05, not {text!r}")
    known = ", ".join([*values, *bits])
    several = ", or several joined by |" if added else ""
    raise CalledWronglyError(
        f"{name} {text!r} is not one of {known}{several}, nor an integer such as 5 or 0x05"
    )


def parse_address(option: str, text: str) -> int:
    """Return an address in decimal or hex."""
    value = _integer(text)
    if value is None:
        raise CalledWronglyError(f"{option} must be an address such as 0x50, not {text!r}")
    return value


def parse_axis(option: str, text: str, axes: Mapping[str, int]) -> int:
    """Return the identifier of an axis, which may be given by its name in any case."""
    named = {name.lower(): id for name, id in axes.items()}.get(text.lower())
    value = _integer(text) if named is None else named
    if value is None:
        known = ", ".join(f"{name} ({id:#04x})" for name, id in axes.items())
        raise CalledWronglyError(
            f"{option} must be {known}, or the number of another axis, not {text!r}"
        )
    return value


def _integer(text: str) -> int | None:
    if not _INTEGER.match(text):
        return None
    return int(text, 16) if "x" in text.lower() else int(text)


def context_option(name: str, value: str) -> str:
    """Return the option of ``stagewire decode`` that states a context."""
    return f"--status {value}" if name == "status" else f"--context {name}={value}"
