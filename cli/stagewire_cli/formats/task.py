"""A decoding task: the protocol and direction of the bytes, and the facts needed to decode them.

Also has the rows of one message, with a typed column for each field. Frames use ``stagewire.columns``, which
reads the fields of many frames at a time.
"""

from __future__ import annotations

import abc
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Final

from stagewire.errors import CodecError, StagewireError
from stagewire.framing import End, Event
from stagewire.protocols import (
    CommandProtocol,
    Direction,
    FramedProtocol,
    Message,
    Protocol,
    available_protocols,
    load_protocol,
)
from stagewire_cli.formats.sinks import Column
from stagewire_cli.real_numbers import real_of, with_numbers
from stagewire_cli.stage_values import StageValues, in_unit
from stagewire_conformance.answers import Decoded, frame_answer, message_of
from stagewire_conformance.framings import codec_of
from stagewire_conformance.framings.base import Codec, Reader
from stagewire_conformance.registry import Json, registry_of

if TYPE_CHECKING:
    from stagewire import Scale, columns

_STRINGS: Final = {"text": "string", "bytes": "binary", "integers": "integers"}


class TypedRows(abc.ABC):
    """Rows to be written; ``len`` is their number."""

    columns: Sequence[Column]

    @abc.abstractmethod
    def __len__(self) -> int: ...

    @abc.abstractmethod
    def take(self, offset: int, events: Iterable[Event]) -> None:
        """Add the selected messages of consecutive events, the first of which is at ``offset``."""

    @abc.abstractmethod
    def append(self, offset: int, raw: bytes, decoded: Decoded) -> None:
        """Add a selected message."""

    @abc.abstractmethod
    def values(self) -> list[Sequence[Any]]:
        """Return the rows, column by column."""

    @abc.abstractmethod
    def clear(self) -> None:
        """Remove the rows, which have been written."""


class FrameRows(TypedRows):
    """Frames: offset, addresses, fields, and bytes beyond the layout.

    Raises :class:`~stagewire.errors.UnsupportedError` for a message without a documented layout.
    """

    def __init__(self, task: Task, protocol: FramedProtocol) -> None:
        from stagewire.columns import Frames, Sorter, shape_of

        only = task.only
        assert only is not None
        self._task = task
        self._reals = task.reals(only)
        fields = [
            Column(field.name, "float64" if field.name in self._reals else _type_of_column(field))
            for field in shape_of(only).fields
        ]
        self.columns = _columns(task, fields)
        self._sorter = Sorter(protocol, task.request.get("context"), only=[only])
        self._frames = self._sorter.frames.setdefault(only, Frames(only))
        self._stamps: list[Stamp] = []  # one for each frame of a capture; else empty

    def __len__(self) -> int:
        return len(self._frames)

    def take(self, offset: int, events: Iterable[Event]) -> None:
        """Add the frames of the selected message."""
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
        columns = frames.columns()
        shown = _with_numbers(self._reals, columns)
        return [frames.offsets, *stamps, *shown, extra, *_in_units(self._task, columns)]

    def clear(self) -> None:
        """Remove the frames."""
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
        """Add the selected messages."""
        for event in events:
            decoded = self._task.found(event)
            if decoded is not None and self._task.wants(decoded):
                self.append(offset, event.raw, decoded)
            offset += len(event.raw)

    def append(self, offset: int, raw: bytes, decoded: Decoded) -> None:
        """Add a message."""
        fields = (
            message_of(decoded).values().values()
        )  # only frames with a header have real numbers
        extra = getattr(decoded, "extra", None) or None  # replies have no extra bytes
        task = self._task
        self._rows.append((offset, *task.stamp, *task.addressed(decoded), *fields, extra))

    def values(self) -> list[Sequence[Any]]:
        """Return the rows, column by column."""
        columns = list(zip(*self._rows, strict=True))
        named = {column.name: values for column, values in zip(self.columns, columns, strict=False)}
        return [*columns, *_in_units(self._task, named)]

    def clear(self) -> None:
        """Remove the rows."""
        self._rows.clear()


def _columns(task: Task, fields: Iterable[Column]) -> list[Column]:
    """Return the columns; a field with the name of another column gets the suffix ``_value``."""
    before, last = [*task.places, *task.addresses], Column("extra", "binary")
    taken = {column.name for column in (*before, last)}
    named = (
        replace(field, name=f"{field.name}_value") if field.name in taken else field
        for field in fields
    )
    units = (Column(name, "float64") for _, name, _ in task.columns_in_units())
    return [*before, *named, last, *units]


def _with_numbers(
    reals: Mapping[str, Json], columns: Mapping[str, Sequence[Any]]
) -> Iterator[Sequence[Any]]:
    """Yield the columns, with numbers in place of the bit patterns of real numbers."""
    for name, values in columns.items():
        known = reals.get(name)
        yield values if known is None else [real_of(known, int(value)) for value in values]


def _in_units(task: Task, columns: Mapping[str, Sequence[Any]]) -> list[Sequence[Any]]:
    """Return the values of the selected message in the units of the stage, column by column."""
    return [
        [in_unit(scale, int(value)) for value in columns[name]]
        for name, _, scale in task.columns_in_units()
    ]


def _type_of_column(field: columns.Field) -> str:
    return _STRINGS.get(field.kind.name.lower()) or integer_type(
        field.kind.name == "SIGNED", field.size
    )


def _type_of_field(field: Json) -> str:
    return _STRINGS.get(field["kind"]) or integer_type(field["signed"], field["size"])


def integer_type(signed: bool, size: int) -> str:
    """Return the narrowest machine integer that holds ``size`` bytes."""
    return f"{'' if signed else 'u'}int{8 << (size - 1).bit_length()}"


Stamp = tuple[float, str]
"""The time of bytes in a capture, in seconds, and their direction."""

_OFFSET = (Column("offset", "uint64"),)
_RECORDED = (Column("line", "uint64"), Column("time", "float64"), Column("direction", "string"))


class Task(abc.ABC):
    """A decoding task for the codec of a protocol.

    :param protocol: the protocol of the bytes.
    :param request: facts that the codec needs in addition to the bytes.
    :param only: the selected message class; None for all.
    """

    addresses: tuple[Column, ...]
    """Columns of addresses, named as attributes of a decoded message."""

    places: tuple[Column, ...] = _OFFSET
    """Columns of positions: an offset or line, and the columns of :attr:`stamp`."""

    stamp: Stamp | tuple[()] = ()
    """The stamp of the next bytes of a capture; empty for other inputs."""

    stage_values: StageValues | None = None
    """The stage whose units are shown; None without one."""

    def __init__(
        self, protocol: Protocol, request: Mapping[str, Any], only: type[Message] | None = None
    ) -> None:
        self.protocol = protocol
        self.codec = codec_of(protocol)
        self.request = request
        self.only = only

    def decode(self, raw: bytes) -> Decoded:
        """Decode the bytes of exactly one message; raise the errors of the protocol."""
        return self.codec.decoded(raw, self.request)

    def found(self, event: Event) -> Decoded | None:
        """Return the message in an event; None without one."""
        return self.codec.received(event, self.request)

    def reader(self, end: End | None) -> Reader:
        """Return a reader that cuts a stream into events.

        Raises :class:`CalledWronglyError` for an end whose stream cannot be cut.
        """
        return self.codec.reader({**self.request, "end": (end or End.NONE).value})

    def records(self) -> None:
        """Switch to the positions of a capture: lines, times and directions."""
        self.places = _RECORDED

    def readers(self) -> Mapping[Direction, Reader]:
        """Return a reader for each direction of a line, which works like the receiving end."""
        return {
            Direction.TO_CONTROLLER: self._reads(End.DEVICE),
            Direction.TO_HOST: self._reads(End.HOST),
        }

    def _reads(self, end: End) -> Reader:
        return self.codec.reader({**self.request, "end": end.value})

    def columns_in_units(self) -> list[tuple[str, str, Scale]]:
        """Return the fields of the selected message in the units of the stage: field, column and scale."""
        if self.stage_values is None or self.only is None:
            return []
        layout = self.only.layout
        fields = registry_of(self.protocol).fields(layout.message, layout.form)
        return list(self.stage_values.columns(fields))

    def in_units(self, answer: Json) -> dict[str, float]:
        """Return the fields of an answer in the units of the stage; empty without a stage."""
        if self.stage_values is None:
            return {}
        fields = registry_of(self.protocol).fields(answer["message"], answer["form"])
        return self.stage_values.values(fields, answer["fields"])

    def reals(self, cls: type[Message]) -> dict[str, Json]:
        """Return the fields of a message that are real numbers, by name."""
        layout = cls.layout
        fields = registry_of(self.protocol).fields(layout.message, layout.form)
        return {name: field for name, field in fields.items() if field.get("real")}

    def answer(self, decoded: Decoded) -> Json:
        """Return a decoded message as an answer of the testee, with numbers in place of bit patterns."""
        answer = frame_answer(decoded)
        reals = self.reals(type(message_of(decoded)))
        return with_numbers(reals, answer) if reals else answer

    def wants(self, decoded: Decoded) -> bool:
        """Return whether a message is selected."""
        return self.only is None or type(message_of(decoded)) is self.only

    def addressed(self, decoded: Decoded) -> tuple[int | None, ...]:
        """Return the values of :attr:`addresses`; None for a missing one."""
        return tuple(getattr(decoded, column.name, None) for column in self.addresses)

    def hints(self, raw: bytes, error: CodecError) -> Iterator[str]:
        """Yield possible causes of a refusal of bytes."""
        yield from ()

    def _in_others(self, raw: bytes) -> Iterator[str]:
        """Yield hints for refused bytes that are valid in other protocols."""
        for codec in self._known:
            try:
                message = message_of(codec.decoded(raw, {})).layout.message
            except StagewireError:  # not a possible cause
                continue
            name = codec.protocol.name
            if isinstance(codec.protocol, CommandProtocol):
                yield f"as a command of {name} this is {message}: use --direction command"
            else:
                yield f"in {name} this is {message}: use --protocol {name}"

    @cached_property
    def _known(self) -> list[Codec]:
        return _codecs()

    @abc.abstractmethod
    def typed_rows(self) -> TypedRows:
        """Return rows with a typed column for each field of the selected message.

        Raises :class:`~stagewire.errors.UnsupportedError` for a message that has no columns.
        """


def _codecs() -> list[Codec]:
    """Return the codecs of all usable installed protocols.

    This takes milliseconds, so the result is cached for many refusals.
    """
    found = []
    for name in available_protocols():
        try:
            found.append(codec_of(load_protocol(name)))
        except StagewireError:  # not a possible cause
            continue
    return found
