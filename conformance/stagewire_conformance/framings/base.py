"""The base of the codecs of all framings: a protocol, spoken to in the JSON values of the testee protocol."""

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
"""A part of the bytes of a message: its name, and where it is."""

Json = dict[str, Any]
Context = Mapping[str, str]

ENDS = {end.value: end for end in End}


class Reader(typing.Protocol):
    """What cuts a stream into events."""

    def feed(self, data: bytes) -> list[Event]:
        """Take the next bytes and return what they complete."""
        ...

    @property
    def pending(self) -> bytes | bytearray | memoryview:
        """The bytes that wait for more."""
        ...


class Codec(abc.ABC):
    """One protocol, spoken to in JSON values.

    A request is a mapping with the keys of the testee protocol; what it has to hold at least, and of
    which type, is known to be right.
    """

    keys: ClassVar[Mapping[str, Mapping[str, type]]]
    """Operation -> what its requests may say beside what every protocol needs, with types."""

    events: ClassVar[Mapping[type[Event], str]]
    """The events of its framers besides :data:`EVENTS`, and their names in the testee protocol."""

    def __init__(self, protocol: Protocol) -> None:
        self.protocol = protocol

    def keys_of(self, operation: str) -> Mapping[str, type]:
        """Return what a request for an operation may say of this protocol, with types."""
        return self.keys[operation]

    @abc.abstractmethod
    def decoded(self, raw: bytes, request: Mapping[str, Any]) -> Decoded:
        """Return what the bytes of exactly one message decode to; raise as the protocol does."""

    @abc.abstractmethod
    def received(self, event: Event, request: Mapping[str, Any]) -> Decoded | None:
        """Return what the message in an event decodes to, None for an event that holds none."""

    @abc.abstractmethod
    def reader(self, request: Mapping[str, Any]) -> Reader:
        """Return what cuts the stream of a request into events."""

    def decode(self, raw: bytes, request: Mapping[str, Any]) -> Json:
        """Return what the bytes of exactly one message say; raise as the protocol does."""
        return frame_answer(self.decoded(raw, request))

    @abc.abstractmethod
    def encode(self, request: Mapping[str, Any]) -> bytes:
        """Return the bytes that ``message``, ``form``, ``fields`` and the rest describe.

        Every field is checked. Raises an error of :mod:`stagewire.errors` with its refusal code.
        """

    def stream(self, chunks: Iterable[bytes], request: Mapping[str, Any]) -> Json:
        """Return the events of a stream that comes in ``chunks``, and what is left at its end."""
        reader = self.reader(request)
        events: list[Event] = []
        for chunk in chunks:
            events.extend(reader.feed(chunk))
        return {
            "events": [self.event_answer(event, request) for event in join_garbage(events)],
            "pending": bytes(reader.pending).hex(),
        }

    def event_answer(self, event: Event, request: Mapping[str, Any]) -> Json:
        """Return one event of a stream as the object that a testee answers with."""
        decoded = self.received(event, request)
        answer: Json = {"event": {**EVENTS, **self.events}[type(event)]}
        return answer | ({"hex": event.raw.hex()} if decoded is None else frame_answer(decoded))

    def field_place(self, layout: Layout, offset: int, size: int) -> range:
        """Return where a field is in the bytes of a message.

        :param offset: where it is in the payload.
        """
        return range(offset, offset + size)

    def frame_parts(self, layout: Layout, raw: bytes) -> Iterator[Part]:
        """Yield the parts of the bytes of a message that are no fields, for people."""
        yield from ()

    @abc.abstractmethod
    def reading(self, wanted: Mapping[str, Any]) -> Json:
        """Return what a decoder has to be told beside the bytes to read what is wanted."""

    @cached_property
    def contexts(self) -> dict[str, list[str]]:
        """What a receiver may have to know beside the bytes, and the values that it can have."""
        known: dict[str, set[str]] = {}
        for cls in self.protocol.messages:
            for key, value in cls.layout.when.items():
                known.setdefault(key, set()).add(value)
        return {key: sorted(values) for key, values in sorted(known.items())}

    def check_context(self, context: Context | None) -> None:
        """Raise :class:`BadValueError` for a context that decides nothing in this protocol."""
        if not context:
            return
        known = self.contexts
        for key, value in context.items():
            if not known:
                raise BadValueError(
                    f"no layout of {self.protocol.title} depends on {key!r} or on any other context"
                )
            if key not in known:
                raise BadValueError(f"no layout depends on {key!r} (known: {', '.join(known)})")
            if value not in known[key]:
                raise BadValueError(f"{key} is one of {', '.join(known[key])}, not {value!r}")

    def _from_json(self, layout: Layout, fields: Mapping[str, Any]) -> Json:
        """Return the fields with hex text made bytes where the layout holds a byte string."""
        known = registry_of(self.protocol).fields(layout.message, layout.form)
        made = dict(fields)
        for name, value in fields.items():
            if known.get(name, {}).get("kind") == "bytes":
                if not isinstance(value, str):
                    raise BadValueError(
                        f"{layout.message}.{name} takes bytes in hex, not {value!r}"
                    )
                try:
                    made[name] = from_hex(value)
                except ValueError as error:
                    raise BadValueError(f"{layout.message}.{name}: {error}") from None
        return made


def in_a_row(*parts: tuple[str, int]) -> Iterator[Part]:
    """Yield parts that follow one another from the first byte on, each with its size."""
    at = 0
    for name, size in parts:
        yield name, range(at, at + size)
        at += size
