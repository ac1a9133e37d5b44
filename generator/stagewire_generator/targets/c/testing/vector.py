"""Vectors in C: the check, its layout, and its values and bytes."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple

from stagewire_generator.model import Json, Protocol
from stagewire_generator.targets.c.framing import Tests, framing_of
from stagewire_generator.targets.c.source import names_of, string
from stagewire_generator.targets.c.testing.round_trip import index, subjects
from stagewire_generator.targets.c.testing.values import (
    CannotSayError,
    Conversions,
    Item,
    byte_rows,
    filled,
    from_bytes,
    literal_of,
    members,
    whole,
)
from stagewire_generator.targets.vectors.cases import framing_of as frames_of
from stagewire_generator.targets.vectors.subject import Subject

_UNDECIDED = ":undecided"  # suffix of a form with several possible layouts
_INDENT = 8
_LONGEST = 480  # length of a message: less than STAGEWIRE_LARGEST, to detect writes past its end
_LARGEST = {"dest": 0xFF, "source": 0xFF, "axis": 0xFF, "address": 0xFFFFFFFF}
_VERDICTS = frozenset({
    "truncated", "trailing", "bad_length", "unknown_message", "out_of_range", "unsupported",
})  # fmt: skip


class VectorView(NamedTuple):
    """A vector: its members, each on one or several lines."""

    members: tuple[str, ...]


class Content(NamedTuple):
    """The values of a message, and its envelope as members of a struct."""

    of: Subject
    values: Mapping[str, object]
    envelope: Sequence[Item] = ()


class Vectors:
    """Makes the vectors of a protocol."""

    def __init__(self, protocol: Protocol) -> None:
        self.protocol = protocol
        self.names = names_of(protocol)
        self._conversions = Conversions(protocol, self.names)
        self.framing: Tests = framing_of(protocol).tests
        self.subjects = subjects(protocol)
        self._every = tuple(self.subjects.values())
        self._frames = frames_of(protocol)
        self._types = {
            key: self.names.layout(of.message, of.layout) for key, of in self.subjects.items()
        }
        self._places = {key: place for place, key in enumerate(self.subjects)}

    def content(self, said: Json) -> Content:
        """Return the content of an object of the testee protocol.

        :raises CannotSayError: if it has no layout in C, or a value does not fit its type.
        """
        name = said.get("message", "")
        of = self.subjects.get((name, self.framing.form(said) or self._only_form(name)))
        if of is None:
            raise CannotSayError("a message or a form without a layout")
        return Content(of, whole(of.fields, said.get("fields", {})), self._envelope(of, said))

    def _only_form(self, name: str) -> str:
        forms = [form for message, form in self.subjects if message == name]
        return forms[0] if len(forms) == 1 else ""

    def contents(self, said: Json) -> list[Content]:
        """Return the content; for an undecided form, the content of the packet in each possible layout."""
        data = bytes.fromhex(said.get("data") or "")
        if not data or not said.get("form", "").endswith(_UNDECIDED):
            return [self.content(said)]
        found = [
            of
            for of in self.subjects.values()
            if of.message.name == said["message"] and of.layout.when
        ]
        return [
            self.content({
                **said,
                "form": of.layout.form,
                "fields": from_bytes(of.fields, data),
                "extra": data[of.layout.length :].hex(),
            })
            for of in found
        ]  # fmt: skip

    def _envelope(self, of: Subject, said: Json) -> list[Item]:
        envelope: list[Item] = []
        for key, most in _LARGEST.items():
            if key not in said:
                continue
            value = said[key]
            if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value <= most:
                raise CannotSayError("an address that does not fit its type")
            if value:
                envelope.append(f".{key} = 0x{value:02X}")
        envelope += self.framing.envelope(of, said)
        extra = bytes.fromhex(said.get("extra") or "")
        if extra:
            envelope.append(literal_of(".extra = ", extra))
            envelope.append(f".extra_size = {len(extra)}")
        return envelope

    def bytes_of(self, of: Subject, values: Json) -> bytes:
        """Return the bytes of a layout with these values.

        :raises CannotSayError: if a value does not fit its field.
        """
        try:
            return self._frames.frame(of, values)
        except (OverflowError, ValueError):
            raise CannotSayError("a value that does not fit its field") from None

    def both(self, id: str, content: Content, raw: bytes) -> VectorView:
        """Return the check that a content encodes to bytes, and that these decode to the content."""
        return self._vector(id, "REPRODUCES", content, raw)

    def carried(self, id: str, content: Content, raw: bytes) -> VectorView:
        """Return the same check without range checks when encoding."""
        return self._vector(id, "CARRIES", content, raw)

    def encoded(self, id: str, content: Content, raw: bytes) -> VectorView:
        """Return the check that a content encodes to bytes."""
        return self._vector(id, "ENCODES", content, raw)

    def not_encoded(self, id: str, content: Content, code: str) -> VectorView:
        """Return the check that encoding a content fails."""
        return self._vector(id, "ENCODES", content, None, verdict=code)

    def decoded(self, id: str, content: Content, raw: bytes) -> VectorView:
        """Return the check that bytes decode to a content."""
        return self._vector(id, "DECODES", content, raw)

    def differs(self, id: str, content: Content, raw: bytes) -> VectorView:
        """Return the check that a content encodes to other bytes."""
        return self._vector(id, "DIFFERS", content, raw)

    def refused(self, id: str, raw: bytes, code: str, said: Json) -> VectorView:
        """Return the check that decoding bytes fails for every possible layout.

        :param said: the keys of the request besides the bytes.
        """
        meant = self.framing.meant(self.protocol, self._every, raw, said)
        if not meant:
            raise CannotSayError("bytes without a possible layout")
        first, last = (self._places[_key(of)] for of in (meant[0], meant[-1]))
        head = [*self._head(id, "REFUSES", code), f".layout = {self._index(meant[0])}"]
        head.append(f".layout_count = {last - first + 1}")
        return VectorView((*head, *_bytes(raw)))

    def cut(self, id: str, raw: bytes, events: Iterable[str]) -> VectorView:
        """Return the check that a stream is parsed into events."""
        named = [f"STAGEWIRE_EVENT_{event.upper()}" for event in events]
        events_line = filled("STAGEWIRE_EVENTS(", named, ")", _INDENT)
        return VectorView((*self._head(id, "CUTS"), *_bytes(raw), events_line))

    def converted(self, id: str, quantity: str, item: Json) -> VectorView:
        """Return the check that a stated value converts to its exact counts."""
        conversion = ["struct conversion", *self._conversions.members(quantity, item)]
        line = filled("STAGEWIRE_VALUES(", conversion, ")", _INDENT)
        return VectorView((*self._head(id, "CONVERTS"), line))

    def lacking(self, id: str, message: str, form: str = "") -> VectorView:
        """Return the check that a message has no layout, or none in this form."""
        head = [*self._head(id, "LACKS"), f".message = {string(message)}"]
        return VectorView((*head, *([f".text = {string(form)}"] if form else [])))

    def holds(self, id: str, condition: str) -> VectorView:
        """Return the check that a condition of constants is true."""
        return VectorView((*self._head(id, "HOLDS"), f".holds = {condition}"))

    def _vector(
        self, id: str, check: str, content: Content, raw: bytes | None, verdict: str = ""
    ) -> VectorView:
        of = content.of
        lines = [*self._head(id, check, verdict), f".layout = {self._index(of)}"]
        if content.envelope:
            lines.append(filled("STAGEWIRE_ENVELOPE(", content.envelope, ")", _INDENT))
        if of.fields:
            values = [self._types[_key(of)], *members(of.fields, content.values)]
            lines.append(filled("STAGEWIRE_VALUES(", values, ")", _INDENT))
        if raw is not None:
            lines += _bytes(raw)
        return VectorView(tuple(lines))

    def _head(self, id: str, check: str, verdict: str = "") -> Iterator[str]:
        yield f".id = {string(id)}"
        yield f".check = STAGEWIRE_{check}"
        if verdict:
            if verdict not in _VERDICTS | {self.framing.damaged}:
                raise CannotSayError(f"the error {verdict}")
            yield f".verdict = STAGEWIRE_{verdict.upper()}"

    def _index(self, of: Subject) -> str:
        return index(self.names, self._types[_key(of)])


def _key(of: Subject) -> tuple[str, str]:
    return of.message.name, of.layout.form


def noted(id: str, why: str) -> VectorView:
    """Return a vector without a check, with the reason."""
    return VectorView((f".id = {string(id)}", ".check = STAGEWIRE_NOTES", f".text = {string(why)}"))


def _bytes(raw: bytes) -> list[str]:
    """Return bytes and their number.

    :raises CannotSayError: if there are more bytes than the runner supports.
    """
    if len(raw) > _LONGEST:
        raise CannotSayError("more bytes than the runner supports")
    if not raw:
        return [".bytes = (const uint8_t[]){0x00}", ".size = 0"]
    return [byte_rows("STAGEWIRE_BYTES(", raw, ")", _INDENT)]
