"""Cases of the codec tests: a request to a testee, its answer, and the layout that both are about."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final, TypeAlias

from stagewire_generator.model import Field, Json, Layout, Message
from stagewire_generator.targets.vectors.values import Content, plain_content


@dataclass(frozen=True, slots=True)
class Case:
    """A request of the testee protocol and its answer, made without any encoder of ours.

    :param id: unique in its protocol; it stays what it is as long as what it names does.
    :param about: what it looks at, in a few words; empty where the id says it.
    :param request: without ``id`` and ``protocol``, which the asker adds.
    :param answer: without ``id``; a refusal has no ``detail``, which is for people.
    :param message: the message that it is about, if it is about one.
    :param layout: the layout that is encoded or decoded, or would be if it was not refused; None where
        the request leads to none.
    """

    id: str
    about: str
    request: Json
    answer: Json
    message: Message | None = None
    layout: Layout | None = None

    @property
    def operation(self) -> str:
        """What is asked for: ``encode``, ``decode`` or ``stream``; what else where that is the case."""
        return str(self.request.get("op", ""))

    @property
    def refusal(self) -> str:
        """The code with which it is refused; empty where it is not."""
        return str(self.answer.get("error", ""))

    @property
    def raw(self) -> bytes | None:
        """The bytes that are decoded, or that an encoder makes; None for other cases."""
        holder = self.request if self.operation == "decode" else self.answer
        text = holder.get("hex")
        try:
            return None if text is None else bytes.fromhex(text)
        except ValueError:
            return None  # it is what the case is about

    @property
    def fields(self) -> Json:
        """The values by field that are encoded, or that a decoder finds; empty for other cases."""
        holder = self.request if self.operation == "encode" else self.answer
        fields: Json = holder.get("fields", {})
        return fields


Expected: TypeAlias = bytes | Json | str
"""The bytes that an encoder makes; what else is answered; the code of a refusal."""

LEFT_OUT: Final = object()
"""In the place of a value: the key is left out of the request."""


def answered(expected: Expected) -> Json:
    """Return the answer that is expected."""
    if isinstance(expected, bytes):
        return {"ok": True, "hex": expected.hex()}
    if isinstance(expected, str):
        return {"ok": False, "error": expected}
    return {"ok": True, **expected}


def make_case(
    id: str, about: str, request: Json, expected: Expected, of: Subject | None = None
) -> Case:
    """Make a case; ``of`` is the layout that it leads to, if it leads to one."""
    if of is None:
        return Case(id, about, request, answered(expected))
    return Case(id, about, request, answered(expected), of.message, of.layout)


class Subject:
    """One layout of a message.

    :param message: the message.
    :param layout: its layout.
    :param fields: what can be given to an encoder, header parameters without a name included.
    :param asked: what an encoder is told beside the fields.
    :param reading: what a decoder is told beside the bytes.
    :param says: what a decoder answers beside the fields.
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
        """Return a case that encodes ``fields``, or the plain ones; ``changes`` are keys of the request."""
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
        """Return a case that cuts a stream."""
        request = {"op": "stream", "chunks": [chunk.hex() for chunk in chunks]}
        return self._case(f"stream/{name}", about, request, changes, expected)

    def answer(self, content: Content, **more: Any) -> Json:
        """Return what a decoder answers where the bytes hold ``content``."""
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
    """Return the case of a message that the document gives no id, so that nothing can encode it."""
    request = {"op": "encode", "message": message.name, "fields": {}}
    about = "a message without an id"
    return make_case(f"{message.name}/encode/no_id", about, request, "unsupported")
