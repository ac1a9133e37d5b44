"""The operations of the testee on one protocol: decode, encode and stream, from and to JSON values."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from stagewire.errors import BadLengthError, BadValueError, MissingFieldError
from stagewire.frame import Frame
from stagewire.framing import (
    BadLength,
    End,
    Event,
    Garbage,
    Received,
    Undocumented,
    Unknown,
    join_garbage,
)
from stagewire.message import Message, UndecidedMessage, UndocumentedMessage
from stagewire.protocol import Protocol
from stagewire_conformance.answers import frame_answer
from stagewire_conformance.hexes import from_hex
from stagewire_conformance.registry import registry_of

__all__ = ["ENDS", "EVENT_NAMES", "Codec", "encode_frame", "event_answer"]

Json = dict[str, Any]
Context = Mapping[str, str]

ENDS = {end.value: end for end in End}
EVENT_NAMES: dict[type[Event], str] = {
    Received: "message",
    Undocumented: "undocumented",
    Unknown: "unknown",
    BadLength: "bad_length",
    Garbage: "garbage",
}


class Codec:
    """One protocol, spoken to in JSON values."""

    def __init__(self, protocol: Protocol) -> None:
        self.protocol = protocol

    def decode(self, raw: bytes, context: Context | None = None) -> Json:
        """Return what the bytes of exactly one frame say; raise as the protocol does."""
        self.check_context(context)
        return frame_answer(self.protocol.decode(raw, context))

    def encode(self, request: Mapping[str, Any]) -> bytes:
        """Return the bytes that ``message``, ``form``, ``fields`` and the rest describe."""
        self.check_context(request.get("context"))
        return encode_frame(self.protocol, request).encode()

    def stream(self, chunks: Iterable[bytes], end: str, context: Context | None = None) -> Json:
        """Return the events of a stream that comes in ``chunks``, and what is left at its end."""
        self.check_context(context)
        framer = self.protocol.framer(ENDS[end])
        events: list[Event] = []
        for chunk in chunks:
            events.extend(framer.feed(chunk))
        return {
            "events": [event_answer(self.protocol, e, context) for e in join_garbage(events)],
            "pending": bytes(framer.pending).hex(),
        }

    def contexts(self) -> dict[str, list[str]]:
        """Return what a receiver may have to know, and the values that it can have."""
        known: dict[str, set[str]] = {}
        for cls in self.protocol.messages:
            for key, value in cls.layout.when.items():
                known.setdefault(key, set()).add(value)
        return {key: sorted(values) for key, values in sorted(known.items())}

    def check_context(self, context: Context | None) -> None:
        """Raise :class:`BadValueError` for a context that decides nothing in this protocol."""
        if not context:
            return
        known = self.contexts()
        for key, value in context.items():
            if key not in known:
                raise BadValueError(f"no layout depends on {key!r} (known: {', '.join(known)})")
            if value not in known[key]:
                raise BadValueError(f"{key} is one of {', '.join(known[key])}, not {value!r}")


def event_answer(protocol: Protocol, event: Event, context: Context | None = None) -> Json:
    """Return one event of a stream as the object that a testee answers with."""
    answer: Json = {"event": EVENT_NAMES[type(event)]}
    if isinstance(event, (Received, Undocumented)):
        return answer | frame_answer(protocol.decode(event.raw, context))
    return answer | {"hex": event.raw.hex()}


def encode_frame(protocol: Protocol, request: Mapping[str, Any]) -> Frame:
    """Make the frame that an ``encode`` request (or a worked example) describes.

    Every field is checked. Raises an error of :mod:`stagewire.errors` with its refusal code.
    """
    name = request["message"]
    form = _form(protocol, name, request.get("form"), request.get("context"))
    cls = protocol.message_class(name, form)
    fields = _from_json(protocol, cls, request.get("fields", {}))
    data = _hex(request, "data")
    extra = _hex(request, "extra") or b""
    if issubclass(cls, UndecidedMessage) and data is not None:
        size = cls.layout.length
        if len(data) < size:
            raise BadLengthError(f"{name}: its packet has {size} bytes, data has {len(data)}")
        data, extra = data[:size], data[size:] + extra
    if issubclass(cls, UndocumentedMessage):
        if extra:
            raise BadValueError(f"{name} has no layout that extra bytes could follow")
        if data is None and "data" in request:  # a header without a packet
            fields = {"param1": 0, "param2": 0} | fields
        elif data is not None and fields:
            raise BadValueError(f"{name} carries data or parameters, not both")
    message = protocol.build(name, fields, form, data)
    for address in ("dest", "source"):
        if address not in request:
            raise MissingFieldError(f"{name} lacks {address}")
    return Frame(message, request["dest"], request["source"], extra)


def _form(protocol: Protocol, name: str, form: str | None, context: Context | None) -> str | None:
    """Return the form that is meant; ``context`` chooses where ``form`` leaves it open."""
    if not context:
        return form
    decided = [c for c in protocol.messages if c.layout.message == name and c.layout.when]
    for cls in decided:
        agrees = cls.layout.when.items() <= context.items()
        if form is None and agrees:
            return cls.layout.form
        if form == cls.layout.form and not agrees:
            raise BadValueError(f"{name}: form {form} contradicts the context {dict(context)}")
    return form


def _from_json(protocol: Protocol, cls: type[Message], fields: Mapping[str, Any]) -> dict[str, Any]:
    """Return the fields with hex text made bytes where the layout holds a byte string."""
    layout = cls.layout
    known = registry_of(protocol).fields(layout.message, layout.form)
    made = dict(fields)
    for name, value in fields.items():
        if known.get(name, {}).get("kind") == "bytes":
            if not isinstance(value, str):
                raise BadValueError(f"{layout.message}.{name} takes bytes in hex, not {value!r}")
            try:
                made[name] = from_hex(value)
            except ValueError as error:
                raise BadValueError(f"{layout.message}.{name}: {error}") from None
    return made


def _hex(request: Mapping[str, Any], key: str) -> bytes | None:
    value = request.get(key)
    return None if value is None else from_hex(value)
