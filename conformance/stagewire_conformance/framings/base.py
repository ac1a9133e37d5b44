"""The base class of the codecs of all framings. A codec uses the JSON values of the testee protocol."""

from __future__ import annotations

import abc
import typing
from collections.abc import Iterable, Iterator, Mapping
from functools import cached_property
from typing import Any, ClassVar, TypeAlias

from stagewire.errors import BadValueError
from stagewire.framing import End, Event, Garbage, join_garbage
from stagewire.protocols import Layout, Protocol
from stagewire_conformance.answers import Decoded, frame_answer
from stagewire_conformance.notation import from_hex
from stagewire_conformance.registry import registry_of

EVENTS: dict[type[Event], str] = {Garbage: "garbage"}
"""The events of every framing, and their names."""

Part: TypeAlias = tuple[str, range]
"""A part of the bytes of a message: its name and its position."""

Json = dict[str, Any]
Context = Mapping[str, str]

ENDS = {end.value: end for end in End}


class Reader(typing.Protocol):
    """Splits a stream into events."""

    def feed(self, data: bytes) -> list[Event]:
        """Add bytes and return the events that they complete."""
        ...

    @property
    def pending(self) -> bytes | bytearray | memoryview:
        """The bytes of an incomplete event."""
        ...


class Codec(abc.ABC):
    """Encodes and decodes one protocol with JSON values.

    A request is a mapping with the keys of the testee protocol. Its required keys and their types have
    already been validated.
    """

    keys: ClassVar[Mapping[str, Mapping[str, type]]]
    """Operation -> the optional keys of its requests, with types."""

    events: ClassVar[Mapping[type[Event], str]]
    """The events of its framers in addition to :data:`EVENTS`, and their names in the testee protocol."""

    def __init__(self, protocol: Protocol) -> None:
        self.protocol = protocol

    def keys_of(self, operation: str) -> Mapping[str, type]:
        """Return the optional keys of a request for an operation, with types."""
        return self.keys[operation]

    @abc.abstractmethod
    def decoded(self, raw: bytes, request: Mapping[str, Any]) -> Decoded:
        """Decode the bytes of exactly one message. Raises the errors of the protocol."""

    @abc.abstractmethod
    def received(self, event: Event, request: Mapping[str, Any]) -> Decoded | None:
        """Decode the message in an event; None for an event without one."""

    @abc.abstractmethod
    def reader(self, request: Mapping[str, Any]) -> Reader:
        """Return a reader that splits the stream of a request into events."""

    def decode(self, raw: bytes, request: Mapping[str, Any]) -> Json:
        """Decode the bytes of exactly one message to JSON. Raises the errors of the protocol."""
        return frame_answer(self.decoded(raw, request))

    @abc.abstractmethod
    def encode(self, request: Mapping[str, Any]) -> bytes:
        """Encode ``message``, ``form``, ``fields`` and the other keys of a request.

        Every field is checked. Raises an error of :mod:`stagewire.errors` with its refusal code.
        """

    def stream(self, chunks: Iterable[bytes], request: Mapping[str, Any]) -> Json:
        """Return the events of a stream that arrives in ``chunks``, and the bytes left over."""
        reader = self.reader(request)
        events: list[Event] = []
        for chunk in chunks:
            events.extend(reader.feed(chunk))
        return {
            "events": [self.event_answer(event, request) for event in join_garbage(events)],
            "pending": bytes(reader.pending).hex(),
        }

    def event_answer(self, event: Event, request: Mapping[str, Any]) -> Json:
        """Return one event of a stream as the JSON object of an answer."""
        decoded = self.received(event, request)
        answer: Json = {"event": {**EVENTS, **self.events}[type(event)]}
        return answer | ({"hex": event.raw.hex()} if decoded is None else frame_answer(decoded))

    def field_place(self, layout: Layout, offset: int, size: int) -> range:
        """Return the position of a field in the bytes of a message.

        :param offset: its position in the payload.
        """
        return range(offset, offset + size)

    def frame_parts(self, layout: Layout, raw: bytes) -> Iterator[Part]:
        """Yield the parts of a message that are not fields."""
        yield from ()

    @abc.abstractmethod
    def reading(self, wanted: Mapping[str, Any]) -> Json:
        """Return the keys that a decode request needs, in addition to the bytes, to read a message."""

    def begun(self, raw: bytes) -> str | None:
        """Return the message whose id begins bytes that are not a valid message.

        Empty if there is none; None if this framing cannot tell.
        """
        return None

    @cached_property
    def contexts(self) -> dict[str, list[str]]:
        """Return the contexts on which decoding may depend, each with its possible values."""
        known: dict[str, set[str]] = {}
        for cls in self.protocol.messages:
            for key, value in cls.layout.when.items():
                known.setdefault(key, set()).add(value)
        return {key: sorted(values) for key, values in sorted(known.items())}

    def check_context(self, context: Context | None) -> None:
        """Raise :class:`BadValueError` for an unknown or irrelevant context."""
        if not context:
            return
        known = self.contexts
        for key, value in context.items():
            if not known:
                raise BadValueError(
                    f"no layout of {self.protocol.title} depends on {key!r}, or on any other context"
                )
            if key not in known:
                raise BadValueError(f"unknown context {key!r} (choose one of {', '.join(known)})")
            if value not in known[key]:
                raise BadValueError(f"{key} must be one of {', '.join(known[key])}, not {value!r}")

    def _from_json(self, layout: Layout, fields: Mapping[str, Any]) -> Json:
        """Return the fields with hex converted to bytes for byte strings."""
        known = registry_of(self.protocol).fields(layout.message, layout.form)
        made = dict(fields)
        for name, value in fields.items():
            if known.get(name, {}).get("kind") == "bytes":
                if not isinstance(value, str):
                    raise BadValueError(
                        f"{layout.message}.{name} requires bytes in hex, not {value!r}"
                    )
                try:
                    made[name] = from_hex(value)
                except ValueError as error:
                    raise BadValueError(f"{layout.message}.{name}: {error}") from None
        return made


def in_a_row(*parts: tuple[str, int]) -> Iterator[Part]:
    """Yield consecutive parts, starting at the first byte."""
    at = 0
    for name, size in parts:
        yield name, range(at, at + size)
        at += size
