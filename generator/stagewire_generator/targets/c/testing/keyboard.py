"""Examples at a terminal: the bytes that keys send, and those that it shows."""

from __future__ import annotations

import re
from collections.abc import Iterator

from stagewire_generator.model import Json
from stagewire_generator.targets.c.testing.values import CannotSayError
from stagewire_generator.targets.c.testing.vector import Vectors, VectorView

__all__ = ["bytes_of", "keyboard_vectors"]

_KEY = re.compile(
    r"\s+|Ctrl<(?P<ctrl>[@-_])>|Alt\[(?P<alt>\d{1,4})\]|(?P<esc>ESC)|'(?P<quoted>.)'|(?P<char>.)"
)
_UNREADABLE = "_"  # what stands for bytes that no terminal shows
_ESCAPE = 0x1B


def keyboard_vectors(vectors: Vectors, id: str, entry: Json) -> Iterator[VectorView]:
    """Yield that what is typed, or shown, are the bytes that a message is encoded to, and back.

    What a terminal makes of bytes that nobody can read is its own business, and not checked.
    """
    if "message" not in entry:
        yield vectors.holds(id, _axis(vectors, entry))
        return
    content = vectors.content(entry)
    text = entry.get("corrected") or entry.get("typed") or entry["shown"]
    if "typed" in entry:
        yield vectors.both(id, content, bytes_of(text))
        if "corrected" in entry:
            yield vectors.differs(id, content, bytes_of(entry["typed"]))
    elif _UNREADABLE in text:
        yield vectors.both(id, content, vectors.bytes_of(content.of, dict(content.values)))
    else:
        raw = text.encode(entry.get("code_page", "ascii"), errors="replace")
        yield vectors.both(id, content, raw)


def _axis(vectors: Vectors, entry: Json) -> str:
    """Return the condition that the key of an axis sends its identifier."""
    name = vectors.protocol.framing.get("axes")
    tables = [table for table in vectors.protocol.enumerations if table.name == name]
    typed = bytes_of(entry["typed"])
    named = [axis.name for table in tables for axis in table.values if axis.value == entry["axis"]]
    if len(typed) != 1 or not named:
        raise CannotSayError("an axis without a key")
    return f"{vectors.names.table(tables[0]).upper()}_{named[0]} == {typed[0]}"


def bytes_of(text: str) -> bytes:
    """Return the bytes that keys send: ``Ctrl<X>``, ``Alt[255]``, ``ESC``, ``'A'`` or the character alone.

    Raises :class:`CannotSayError` for a key that sends none.
    """
    numbers = []
    for key in _KEY.finditer(text):
        if key["esc"]:
            numbers.append(_ESCAPE)
        elif key["ctrl"]:
            numbers.append(ord(key["ctrl"]) & 0x1F)
        elif key["alt"]:
            numbers.append(int(key["alt"]))
        elif key["quoted"] or key["char"]:
            numbers.append(ord(key["quoted"] or key["char"]))
    if any(number > 0xFF for number in numbers):
        raise CannotSayError("a key that sends no byte")
    return bytes(numbers)
