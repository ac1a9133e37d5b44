"""What is to be decoded: whose bytes they are, and what has to be known beforehand to read them.

With the rows that it makes of one message: a typed column for each field, gathered message by message. Frames
go through the columns of the library, which read the fields of many frames at once.
"""

from __future__ import annotations

import abc
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import cached_property
from typing import Any, Final

from stagewire.columns import Frames, Kind, Place, Sorter, shape_of
from stagewire.errors import CodecError
from stagewire.framing import Asking, End, Event, Replies
from stagewire.protocols import (
    CommandFrame,
    CommandProtocol,
    Direction,
    FramedProtocol,
    Message,
    PacketProtocol,
    Protocol,
)
from stagewire_cli.errors import CalledWronglyError
from stagewire_cli.formats.sinks import Column
from stagewire_cli.hints import codecs, hints_for_frame, hints_for_packet
from stagewire_conformance.answers import Decoded, message_of
from stagewire_conformance.codec import codec_of
from stagewire_conformance.codec.base import Codec, Reader
from stagewire_conformance.registry import Json, registry_of

_STRINGS: Final = {Kind.TEXT: "string", Kind.BYTES: "binary"}
_KINDS: Final = {kind.name.lower(): type for kind, type in _STRINGS.items()}


class TypedRows(abc.ABC):
    """Rows that wait for being written; ``len`` says how many they are."""

    columns: Sequence[Column]

    @abc.abstractmethod
    def __len__(self) -> int: ...

    @abc.abstractmethod
    def take(self, offset: int, events: Iterable[Event]) -> None:
        """Add what is wanted of events that follow one another, the first of which is at ``offset``."""

    @abc.abstractmethod
    def append(self, offset: int, raw: bytes, decoded: Decoded) -> None:
        """Add a message that is wanted."""

    @abc.abstractmethod
    def values(self) -> list[Sequence[Any]]:
        """Return the rows, column by column."""

    @abc.abstractmethod
    def clear(self) -> None:
        """Forget the rows, which were written."""


class FrameRows(TypedRows):
    """Frames: offset, addresses, fields, and bytes beyond the layout.

    Raises :class:`~stagewire.errors.UnsupportedError` for a message without a documented layout.
    """

    def __init__(self, task: FramedTask) -> None:
        only = task.only
        assert only is not None
        self._task = task
        fields = [Column(place.name, _type_of_place(place)) for place in shape_of(only).places]
        self.columns = _columns(task, fields)
        self._sorter = Sorter(task.protocol, task.request.get("context"), only=[only])
        self._frames = self._sorter.frames.setdefault(only, Frames(only))
        self._stamps: list[Stamp] = []  # of captures; then every frame has one

    def __len__(self) -> int:
        return len(self._frames)

    def take(self, offset: int, events: Iterable[Event]) -> None:
        """Add the frames of the message."""
        self._sorter.take(offset, events)
        if stamp := self._task.stamp:
            self._stamps += [stamp] * (len(self._frames) - len(self._stamps))

    def append(self, offset: int, raw: bytes, decoded: Decoded) -> None:
        """Add a frame."""
        self._frames.append(offset, raw)

    def values(self) -> list[Sequence[Any]]:
        """Return the rows, column by column."""
        frames = self._frames
        extra: list[bytes | None] = [None] * len(frames)
        for number, following in frames.extra.items():
            extra[number] = following
        stamps = zip(*self._stamps, strict=True)
        return [frames.offsets, *stamps, *frames.columns().values(), extra]

    def clear(self) -> None:
        """Forget the frames."""
        self._frames.clear()
        self._stamps.clear()


class MessageRows(TypedRows):
    """Commands, replies or packets: offset, axis or address, fields, and bytes beyond the layout."""

    def __init__(self, task: Task) -> None:
        assert task.only is not None
        self._task = task
        layout = task.only.layout
        known = registry_of(task.protocol).fields(layout.message, layout.form)
        fields = [Column(name, _type_of_field(known[name])) for name in layout.fields]
        self.columns = _columns(task, fields)
        self._rows: list[tuple[Any, ...]] = []

    def __len__(self) -> int:
        return len(self._rows)

    def take(self, offset: int, events: Iterable[Event]) -> None:
        """Add the messages that are wanted."""
        for event in events:
            decoded = self._task.found(event)
            if decoded is not None and self._task.wants(decoded):
                self.append(offset, event.raw, decoded)
            offset += len(event.raw)

    def append(self, offset: int, raw: bytes, decoded: Decoded) -> None:
        """Add a message."""
        fields = message_of(decoded).values().values()
        extra = getattr(decoded, "extra", None) or None  # a reply has none
        task = self._task
        self._rows.append((offset, *task.stamp, *task.addressed(decoded), *fields, extra))

    def values(self) -> list[Sequence[Any]]:
        """Return the rows, column by column."""
        return list(zip(*self._rows, strict=True))

    def clear(self) -> None:
        """Forget the rows."""
        self._rows.clear()


def _columns(task: Task, fields: Iterable[Column]) -> list[Column]:
    return [*task.places, *task.addresses, *fields, Column("extra", "binary")]


def _type_of_place(place: Place) -> str:
    return _STRINGS.get(place.kind) or integer_type(place.kind is Kind.SIGNED, place.size)


def _type_of_field(field: Json) -> str:
    return _KINDS.get(field["kind"]) or integer_type(field["signed"], field["size"])


def integer_type(signed: bool, size: int) -> str:
    """Return the narrowest machine integer that holds ``size`` bytes."""
    return f"{'' if signed else 'u'}int{8 << (size - 1).bit_length()}"


Stamp = tuple[float, str]
"""When bytes of a capture passed, in seconds, and which way."""

_OFFSET = (Column("offset", "uint64"),)
_RECORDED = (Column("line", "uint64"), Column("time", "float64"), Column("direction", "string"))


class Task(abc.ABC):
    """What is to be decoded, by the codec of a protocol.

    :param protocol: whose bytes they are.
    :param request: what the codec has to be told beside the bytes.
    :param only: the one message class that is wanted; None for everything.
    """

    addresses: tuple[Column, ...]
    """What says whom a message is for: columns of a table, named as attributes of what is decoded."""

    places: tuple[Column, ...] = _OFFSET
    """What says where something stands: columns of a table, an offset or line and what :attr:`stamp` has."""

    stamp: Stamp | tuple[()] = ()
    """Of what is decoded next, where it comes from a capture."""

    def __init__(
        self, protocol: Protocol, request: Mapping[str, Any], only: type[Message] | None = None
    ) -> None:
        self.protocol = protocol
        self.codec = codec_of(protocol)
        self.request = request
        self.only = only

    def decode(self, raw: bytes) -> Decoded:
        """Decode the bytes of exactly one message; raises as the protocol does."""
        return self.codec.decoded(raw, self.request)

    def found(self, event: Event) -> Decoded | None:
        """Return the message in an event, None where it holds none."""
        return self.codec.received(event, self.request)

    def reader(self, end: End | None) -> Reader:
        """Return what cuts a stream into events.

        Raises :class:`CalledWronglyError` for an end whose stream cannot be cut.
        """
        return self.codec.reader({**self.request, "end": (end or End.NONE).value})

    def records(self) -> None:
        """Be told that what is decoded is a capture, which has lines, times and directions."""
        self.places = _RECORDED

    def readers(self) -> Mapping[Direction, Reader]:
        """Return what cuts both directions of one line, each as the end that receives it does."""
        return {
            Direction.TO_CONTROLLER: self._reads(End.DEVICE),
            Direction.TO_HOST: self._reads(End.HOST),
        }

    def _reads(self, end: End) -> Reader:
        return self.codec.reader({**self.request, "end": end.value})

    def wants(self, decoded: Decoded) -> bool:
        """Whether a message is to be shown."""
        return self.only is None or type(message_of(decoded)) is self.only

    def addressed(self, decoded: Decoded) -> tuple[int | None, ...]:
        """Return the values of :attr:`addresses`; None for what it has not."""
        return tuple(getattr(decoded, column.name, None) for column in self.addresses)

    def hints(self, raw: bytes, error: CodecError) -> Iterator[str]:
        """Yield what may be behind the refusal of bytes, as far as it shows."""
        yield from ()

    @cached_property
    def _known(self) -> list[Codec]:
        return codecs()

    @abc.abstractmethod
    def typed_rows(self) -> TypedRows:
        """Return rows with a typed column for each field of the one message that is wanted.

        Raises :class:`~stagewire.errors.UnsupportedError` for a message that has no columns.
        """


class FramedTask(Task):
    """Frames with a header.

    :param context: what decides between layouts that bytes cannot tell apart.
    """

    protocol: FramedProtocol
    addresses = (Column("dest", "uint8"), Column("source", "uint8"))

    def __init__(
        self,
        protocol: FramedProtocol,
        context: Mapping[str, str] | None = None,
        only: type[Message] | None = None,
    ) -> None:
        super().__init__(protocol, {"context": context} if context else {}, only)

    def hints(self, raw: bytes, error: CodecError) -> Iterator[str]:
        """Yield what may be behind the refusal of a frame."""
        return hints_for_frame(self.protocol, raw, error, self._known)

    def typed_rows(self) -> FrameRows:
        """Return rows through the columns of the library."""
        assert self.only is not None
        return FrameRows(self)


class CommandTask(Task):
    """Commands, or the replies to one of them.

    :param command: name of the command whose replies are read; None for commands.
    :param form: the one form of a command that is wanted; None for all of them.
    """

    protocol: CommandProtocol
    addresses = (Column("axis", "uint8"),)

    def __init__(
        self,
        protocol: CommandProtocol,
        command: str | None = None,
        only: type[Message] | None = None,
        form: str | None = None,
    ) -> None:
        replies = {} if command is None else {"direction": "reply", "command": command}
        super().__init__(protocol, replies, only)
        self.form = form

    def reader(self, end: End | None) -> Reader:
        """Return a framer of commands; replies have no frame to cut a stream by."""
        if "command" in self.request or end is End.HOST:
            raise CalledWronglyError(
                "replies have no frame, so that a stream of them cannot be cut; give them one by one, in "
                "hex or as JSON captures, with --direction reply and --command"
            )
        return super().reader(end)

    def readers(self) -> Mapping[Direction, Reader]:
        """Return what cuts commands and text, and what knows by them which replies come."""
        replies = Replies()
        return {
            Direction.TO_CONTROLLER: Asking(self.protocol, replies),
            Direction.TO_HOST: replies,
        }

    def wants(self, decoded: Decoded) -> bool:
        """Whether a message is to be shown: with and without the size slot it has the same class."""
        if isinstance(decoded, CommandFrame) and self.form not in (None, decoded.form):
            return False
        return super().wants(decoded)

    def typed_rows(self) -> MessageRows:
        """Return rows with the columns that the registry gives."""
        return MessageRows(self)


class PacketTask(Task):
    """Packets, which may have an address."""

    protocol: PacketProtocol

    def __init__(self, protocol: PacketProtocol, only: type[Message] | None = None) -> None:
        super().__init__(protocol, {}, only)
        size = protocol.shape.address
        self.addresses = (Column("address", integer_type(False, size)),) if size else ()

    def hints(self, raw: bytes, error: CodecError) -> Iterator[str]:
        """Yield what may be behind the refusal of a packet."""
        return hints_for_packet(self.protocol, raw, error, self._known)

    def typed_rows(self) -> MessageRows:
        """Return rows with the columns that the registry gives."""
        return MessageRows(self)
