"""How texts and numbers are spelled: quotes and hex digits."""

from __future__ import annotations

import re

from stagewire_generator.formatting.tree import Scalar
from stagewire_generator.strict_yaml import is_plain_text

__all__ = ["needs_quotes", "spell", "spell_key"]

_OBVIOUS = re.compile(  # a name, or prose: what nobody takes for a number, bytes or signs
    r"""[a-z][a-z0-9]*(_[a-z0-9]+)* | [A-Z][A-Z0-9]*(_[A-Z0-9]+)+
    | (?=.*[a-z])[^\W\d_](?:[^\W\d]|[\x20.;/()'-])*(?<!\x20)""",
    re.VERBOSE,
)
_KEY = re.compile(r"[^\W\d]\w*")
_HEX = re.compile(r"0x([0-9A-Fa-f]+)\Z")
_NUMBER = re.compile(r"(?:0|[1-9][0-9]*)\Z")


def needs_quotes(scalar: Scalar) -> bool:
    """Whether a quoted text keeps its quotes."""
    if scalar.style not in ('"', "'"):
        return False
    return not (_OBVIOUS.fullmatch(scalar.value) and is_plain_text(scalar.value))


def spell_key(key: Scalar) -> None:
    """Give a key its spelling; it is a name, so that less is mistaken for something else."""
    if _KEY.fullmatch(key.value) and is_plain_text(key.value):
        key.source, key.style = key.value, ""
    else:
        spell(key)


def spell(scalar: Scalar, *, in_hex: bool = False, keep_quotes: bool = False) -> None:
    """Give a scalar its spelling on one line; the lines of a block are left as they are.

    :param in_hex: write a decimal number in hex.
    :param keep_quotes: leave the quotes where they are not needed.
    """
    if scalar.block:
        return
    if not scalar.style:
        scalar.source = _plain(scalar.value, in_hex)
    elif not keep_quotes and not needs_quotes(scalar):
        scalar.source, scalar.style = scalar.value, ""
    elif scalar.style == "'" and not {'"', "\\"} & set(scalar.value):
        scalar.source, scalar.style = f'"{scalar.value}"', '"'
    if "\n" in scalar.source or "\n" in scalar.value:
        scalar.source, scalar.style = _escaped(scalar.value), '"'


def _plain(value: str, in_hex: bool) -> str:
    """Return a number with whole bytes of upper-case hex digits, null as a word, a text as it is."""
    if found := _HEX.match(value):
        digits = found[1].upper()
        return f"0x{digits.rjust(len(digits) + len(digits) % 2, '0')}"
    if in_hex and _NUMBER.match(value):
        return _plain(f"0x{int(value):X}", in_hex)
    return value or "null"


def _escaped(value: str) -> str:
    """Return a text in quotes on one line."""
    escapes = {'"': '\\"', "\\": "\\\\", "\n": "\\n", "\t": "\\t"}
    return f'"{"".join(escapes.get(c) or _visible(c) for c in value)}"'


def _visible(char: str) -> str:
    if char.isprintable():
        return char
    return f"\\x{ord(char):02X}" if char <= "\xff" else f"\\U{ord(char):08X}"
