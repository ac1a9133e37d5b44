"""The codec of protocols whose frames begin with a header."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cached_property
from typing import Any, ClassVar

from stagewire.errors import BadLengthError, BadValueError, MissingFieldError
from stagewire.framing import (
    BadLength,
    Event,
    Received,
    Undocumented,
    Unknown,
    UnknownSubMessage,
)
from stagewire.protocols import (
    HEADER_SIZE,
    Frame,
    FramedProtocol,
    Layout,
    UndecidedMessage,
    UndocumentedMessage,
)
from stagewire_conformance.framings.base import ENDS, Codec, Context, Json, Part, Reader, in_a_row
from stagewire_conformance.notation import from_hex
from stagewire_conformance.registry import registry_of


class FramedCodec(Codec):
    """Codec for frames with two addresses, and a context if the bytes do not determine the layout."""

    protocol: FramedProtocol
    keys: ClassVar[Mapping[str, Mapping[str, type]]] = {
        "decode": {"context": dict},
        # addresses are checked by the codec, like fields
        "encode": {
            "form": str, "fields": dict, "extra": str, "data": str, "dest": object,
            "source": object, "context": dict,
        },
        "stream": {"end": str, "context": dict},
    }  # fmt: skip
    events: ClassVar[Mapping[type[Event], str]] = {
        Received: "message",
        Undocumented: "undocumented",
        Unknown: "unknown",
        UnknownSubMessage: "unknown",
        BadLength: "bad_length",
    }

    def decoded(self, raw: bytes, request: Mapping[str, Any]) -> Frame:
        """Decode exactly one frame; ``context`` decides between layouts."""
        context = request.get("context")
        self.check_context(context)
        return self.protocol.decode(raw, context)

    def received(self, event: Event, request: Mapping[str, Any]) -> Frame | None:
        """Return the frame in an event; ``context`` decides between layouts."""
        if isinstance(event, (Received, Undocumented)):
            return self.protocol.decode(event.raw, request.get("context"))
        return None

    def reader(self, request: Mapping[str, Any]) -> Reader:
        """Return a framer for the ``end`` of the line that received the stream."""
        self.check_context(request.get("context"))
        return self.protocol.framer(ENDS[request.get("end", "none")])

    def encode(self, request: Mapping[str, Any]) -> bytes:
        """Encode a frame."""
        self.check_context(request.get("context"))
        return self._frame(request).encode()

    def reading(self, wanted: Mapping[str, Any]) -> Json:
        """Return the stated context, or otherwise the one that the form needs."""
        layout = self.protocol.message_class(wanted["message"], wanted.get("form")).layout
        context = wanted.get("context") or dict(layout.when)
        return {"context": context} if context else {}

    def field_place(self, layout: Layout, offset: int, size: int) -> range:
        """Return the position of a field, after the header."""
        return super().field_place(layout, HEADER_SIZE + offset, size)

    def begun(self, raw: bytes) -> str | None:
        """Return the message of a header, complete or not; the first of those that share its id."""
        return self._names.get(int.from_bytes(raw[:2], "little"), "")

    @cached_property
    def _names(self) -> dict[int, str]:
        messages = reversed(registry_of(self.protocol).messages.values())
        return {entry["id"]: entry["name"] for entry in messages if entry["id"] is not None}

    def frame_parts(self, layout: Layout, raw: bytes) -> Iterator[Part]:
        """Yield the parts of the header."""
        middle = [("param1", 1), ("param2", 1)] if layout.form == "header" else [("length", 2)]
        yield from in_a_row(("id", 2), *middle, ("dest", 1), ("source", 1))

    def _frame(self, request: Mapping[str, Any]) -> Frame:
        name = request["message"]
        form = self._form(name, request.get("form"), request.get("context"))
        cls = self.protocol.message_class(name, form)
        fields = self._from_json(cls.layout, request.get("fields", {}))
        data = _hex(request, "data")
        extra = _hex(request, "extra") or b""
        if issubclass(cls, UndecidedMessage) and data is not None:
            size = cls.layout.length
            if len(data) < size:
                raise BadLengthError(f"{name}: its packet has {size} bytes, data has {len(data)}")
            data, extra = data[:size], data[size:] + extra
        if issubclass(cls, UndocumentedMessage):
            if extra:
                raise BadValueError(f"{name} has no layout, so extra bytes are not possible")
            if data is None and "data" in request:  # a header without a packet
                fields = {"param1": 0, "param2": 0} | fields
            elif data is not None and fields:
                raise BadValueError(f"{name} has either data or parameters, not both")
        message = self.protocol.build(name, fields, form, data)
        for address in ("dest", "source"):
            if address not in request:
                raise MissingFieldError(f"{name} lacks {address}")
        return Frame(message, request["dest"], request["source"], extra)

    def _form(self, name: str, form: str | None, context: Context | None) -> str | None:
        """Return the requested form; without ``form``, ``context`` selects it."""
        if not context:
            return form
        for cls in self.protocol.messages:
            layout = cls.layout
            if layout.message != name or not layout.when:
                continue
            agrees = layout.when.items() <= context.items()
            if form is None and agrees:
                return layout.form
            if form == layout.form and not agrees:
                raise BadValueError(f"{name}: form {form} contradicts the context {dict(context)}")
        return form


def _hex(request: Mapping[str, Any], key: str) -> bytes | None:
    value = request.get(key)
    return None if value is None else from_hex(value)
