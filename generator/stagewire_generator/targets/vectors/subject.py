"""Cases of the codec tests: a request to a testee, the expected answer, and the layout they concern."""

from __future__ import annotations

from typing import Any, Final, NamedTuple, TypeAlias

from stagewire_generator.model import Json, Layout, Message
from stagewire_generator.model_fields import Field
from stagewire_generator.targets.vectors.values import Content, plain_content


class Case(NamedTuple):
    """A request of the testee protocol and its answer, made without our encoders.

    :param id: unique in its protocol; stable as long as the things it names do not change.
    :param about: a description in a few words; empty if the id says enough.
    :param request: without ``id`` and ``protocol``, which the client adds.
    :param answer: without ``id``; an error has no ``detail``, which is for people.
    :param message: the message of the case, or None.
    :param layout: the layout that is encoded or decoded, or that the request is refused for; None if no
        layout matches the request.
    """

    id: str
    about: str
    request: Json
    answer: Json
    message: Message | None = None
    layout: Layout | None = None

    @property
    def operation(self) -> str:
        """The operation, such as ``encode``, ``decode`` or ``stream``; may be invalid."""
        return str(self.request.get("op", ""))

    @property
    def refusal(self) -> str:
        """The expected error code; empty if the request succeeds."""
        return str(self.answer.get("error", ""))

    @property
    def raw(self) -> bytes | None:
        """The bytes that are decoded or encoded; None for other cases."""
        holder = self.request if self.operation == "decode" else self.answer
        text = holder.get("hex")
        try:
            return None if text is None else bytes.fromhex(text)
        except ValueError:
            return None  # the case tests invalid hex

    @property
    def fields(self) -> Json:
        """The values of fields that are encoded or decoded; empty for other cases."""
        holder = self.request if self.operation == "encode" else self.answer
        fields: Json = holder.get("fields", {})
        return fields


Expected: TypeAlias = bytes | Json | str
"""Encoded bytes, another successful answer, or an error code."""

LEFT_OUT: Final = object()
"""Marks a key that is left out of the request."""


def answered(expected: Expected) -> Json:
    """Return the expected answer."""
    if isinstance(expected, bytes):
        return {"ok": True, "hex": expected.hex()}
    if isinstance(expected, str):
        return {"ok": False, "error": expected}
    return {"ok": True, **expected}


def make_case(
    id: str, about: str, request: Json, expected: Expected, of: Subject | None = None
) -> Case:
    """Make a case; ``of`` is the layout that the request selects, if any."""
    if of is None:
        return Case(id, about, request, answered(expected))
    return Case(id, about, request, answered(expected), of.message, of.layout)


class Subject:
    """A layout of a message.

    :param message: the message.
    :param layout: its layout.
    :param fields: the fields that an encoder accepts, including unused header parameters.
    :param asked: keys of an encode request besides the fields.
    :param reading: keys of a decode request besides the bytes.
    :param says: keys of the answer of a decoder besides the fields.
    """

    def __init__(
        self,
        message: Message,
        layout: Layout,
        fields: tuple[Field, ...],
        asked: Json,
        reading: Json,
        says: Json,
    ) -> None:
        self.message = message
        self.layout = layout
        self.fields = fields
        self.asked = {"op": "encode", "message": message.name, "form": layout.form, **asked}
        self.reading = {"op": "decode", **reading}
        self.says = {"message": message.name, "form": layout.form, **says}
        self.plain = plain_content(fields)
        self._prefix = f"{message.name}/{layout.form}"

    def encode(
        self,
        name: str,
        about: str,
        expected: bytes | str,
        fields: Json | None = None,
        /,
        **changes: Any,
    ) -> Case:
        """Return a case that encodes ``fields`` or the plain content; ``changes`` are keys of the request."""
        request = {**self.asked, "fields": self.plain.given if fields is None else fields}
        return self._case(f"encode/{name}", about, request, changes, expected)

    def decode(
        self, name: str, about: str, raw: bytes, expected: Json | str, **changes: Any
    ) -> Case:
        """Return a case that decodes ``raw``."""
        request = {**self.reading, "hex": raw.hex()}
        return self._case(f"decode/{name}", about, request, changes, expected)

    def stream(
        self, name: str, about: str, chunks: list[bytes], expected: Json, **changes: Any
    ) -> Case:
        """Return a case that cuts a stream into events."""
        request = {"op": "stream", "chunks": [chunk.hex() for chunk in chunks]}
        return self._case(f"stream/{name}", about, request, changes, expected)

    def answer(self, content: Content, **more: Any) -> Json:
        """Return the answer of a decoder to bytes with this content."""
        return {**self.says, "fields": content.shown, **more}

    def _case(
        self, name: str, about: str, request: Json, changes: Json, expected: Expected
    ) -> Case:
        for key, value in changes.items():
            if value is LEFT_OUT:
                request.pop(key, None)
            else:
                request[key] = value
        return make_case(f"{self._prefix}/{name}", about, request, expected, self)


def no_id_case(message: Message) -> Case:
    """Return the case of a message that cannot be encoded because the document gives no id."""
    request = {"op": "encode", "message": message.name, "fields": {}}
    about = "a message without an id"
    return make_case(f"{message.name}/encode/no_id", about, request, "unsupported")
