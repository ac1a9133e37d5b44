"""The events that a framer gives out."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from stagewire.errors import BadValueError, UnsupportedError
from stagewire.frame import Frame
from stagewire.header import DATA_FLAG, HEADER_SIZE

TYPE_CHECKING = False  # typing would take half of the time of an import
if TYPE_CHECKING:
    from typing import Final

__all__ = [
    "BadLength",
    "DecodableEvent",
    "Event",
    "FrameEvent",
    "Garbage",
    "Received",
    "Undocumented",
    "Unknown",
    "fed",
    "join_garbage",
    "no_protocol",
]


class Event:
    """Something that came: ``raw`` holds its bytes, unchanged. Not to be modified."""

    __slots__ = ("raw",)
    __match_args__ = ("raw",)

    raw: bytes

    def __init__(self, raw: bytes) -> None:
        self.raw = raw

    def __eq__(self, other: object) -> bool:
        if other.__class__ is not self.__class__:
            return NotImplemented
        return self.raw == other.raw

    def __hash__(self) -> int:
        return hash((self.__class__, self.raw))

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.raw.hex(' ')!r})"


class FrameEvent(Event):
    """An event whose bytes are one whole frame, as long as its header declares."""

    __slots__ = ()

    payload_offset: Final = HEADER_SIZE  # where the packet begins, if there is one

    @property
    def id(self) -> int:
        """The message id."""
        return self.raw[0] | self.raw[1] << 8

    @property
    def dest(self) -> int:
        """Address of the receiver, without the bit that announces a packet."""
        return self.raw[4] & ~DATA_FLAG

    @property
    def source(self) -> int:
        """Address of the sender."""
        return self.raw[5]


def fed(data: bytes | bytearray | memoryview) -> bytes:
    """Return what is fed to a framer as bytes.

    Raises :class:`~stagewire.errors.BadValueError` (a ``TypeError``) for what is not bytes.
    """
    if isinstance(data, bytes):
        return data
    if isinstance(data, (bytearray, memoryview)):
        return bytes(data)
    raise BadValueError(f"a framer is fed bytes, not {type(data).__name__}")


def no_protocol(raw: bytes) -> Frame:
    """Stand for the decoder of a framer that was made without a protocol."""
    raise UnsupportedError("this event's framer knows no protocol; use Protocol.framer")


class DecodableEvent(FrameEvent):
    """A frame that is decoded when somebody asks for it."""

    __slots__ = ("decoder",)

    decoder: Callable[[bytes], Frame]

    def __init__(self, raw: bytes, decoder: Callable[[bytes], Frame] = no_protocol) -> None:
        self.raw = raw
        self.decoder = decoder

    @property
    def frame(self) -> Frame:
        """The decoded frame, by what the framer had been told of its source when it came.

        Raises :class:`~stagewire.errors.UnsupportedError` for an event of a framer that was made
        without a protocol; ``Protocol.framer`` makes them with one.
        """
        return self.decoder(self.raw)


class Received(DecodableEvent):
    """A message of a known layout, perhaps with extra bytes."""

    __slots__ = ()


class Undocumented(DecodableEvent):
    """A frame whose id is known and whose layout is not."""

    __slots__ = ()


class Unknown(FrameEvent):
    """A frame with an id that the table has not, skipped by its length."""

    __slots__ = ()


class BadLength(FrameEvent):
    """A frame of a known message whose packet is too short for every layout."""

    __slots__ = ()


class Garbage(Event):
    """Bytes that belong to no frame."""

    __slots__ = ()


def join_garbage(events: Iterable[Event]) -> list[Event]:
    """Return the events with adjacent garbage joined, as streams are compared."""
    joined: list[Event] = []
    run: list[bytes] = []  # joined at its end: adding piece by piece would be quadratic
    for event in events:
        if isinstance(event, Garbage):
            run.append(event.raw)
            continue
        if run:
            joined.append(Garbage(b"".join(run)))
            run.clear()
        joined.append(event)
    if run:
        joined.append(Garbage(b"".join(run)))
    return joined
