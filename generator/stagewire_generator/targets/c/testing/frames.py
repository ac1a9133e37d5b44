"""Frames for one number: every other field of its layout is as plain as can be."""

from __future__ import annotations

from collections.abc import Callable

from stagewire_generator.model import Field, Json
from stagewire_generator.targets.c.testing.values import CannotSayError
from stagewire_generator.targets.c.testing.vector import Content, Vectors
from stagewire_generator.targets.vectors.subject import Subject

__all__ = ["Number", "field_where", "octets_of"]


def octets_of(entry: Json, key: str) -> bytes:
    """Return bytes that an example writes in its notation: hex, ``24 97 03 58`` or ``#FF#41``."""
    text: str = entry[key]
    if entry.get("notation") == "decimal":
        return bytes(int(number) for number in text.split())
    return bytes.fromhex(text.replace("#", ""))


def field_where(vectors: Vectors, wanted: Callable[[Subject, Field], bool]) -> Number:
    """Return the first field of a payload that is wanted. Raises :class:`CannotSayError` without one."""
    for of in vectors.subjects.values():
        for field in of.layout.fields:
            if wanted(of, field):
                return Number(vectors, of, field)
    raise CannotSayError("a field that there is not")


class Number:
    """A field whose value is looked at, among plain ones."""

    def __init__(self, vectors: Vectors, of: Subject, field: Field) -> None:
        self._vectors = vectors
        self._of = of
        self.field = field

    def content(self, value: int) -> Content:
        """Return what a message says that has this value."""
        asked = {key: said for key, said in self._of.asked.items() if key != "op"}
        return self._vectors.content({**asked, "fields": self._held(value)})

    def raw(self, value: int) -> bytes:
        """Return the frame of a message that has this value."""
        return self._vectors.bytes_of(self._of, self._held(value))

    def around(self, printed: bytes) -> bytes:
        """Return a frame with these bytes in the place of the field."""
        raw = self._vectors.bytes_of(self._of, self._of.plain.held)
        start = self._vectors.framing.data_at(self._vectors.protocol, self._of) + self.field.offset
        return raw[:start] + printed + raw[start + self.field.format.size :]

    def _held(self, value: int) -> Json:
        return {**self._of.plain.held, self.field.name: value}
