"""Rows of a table, in two forms: one row for whatever comes, or typed columns of one message."""

from __future__ import annotations

import abc
from collections.abc import Iterable
from typing import Any, Final

import typer

from stagewire.columns import Frames, Kind, Place, Sorter, shape_of
from stagewire.errors import CodecError
from stagewire.frame import Frame
from stagewire.framing import Event
from stagewire.message import Message
from stagewire_cli.formats.fields import AS_JSON, FieldsText, compact
from stagewire_cli.formats.sink import Column, Sink
from stagewire_cli.formats.task import Decoded, FramedTask, Task, message_of
from stagewire_cli.formats.writer import EventWriter, Writer
from stagewire_conformance.answers import frame_answer

__all__ = ["GeneralWriter", "TypedWriter", "general_columns", "typed_columns"]

_HELD: Final = 4 * 1024 * 1024
"""Bytes that are no message and wait for a batch: a row of garbage may be a whole block."""

_TYPES: Final = {Kind.TEXT: "string", Kind.BYTES: "binary"}


def general_columns(task: Task) -> list[Column]:
    """Return the columns that fit everything: what JSON lines say, with the fields of a message as JSON."""
    return [
        Column("offset", "uint64"),
        *(Column(name, "string") for name in ("event", "message", "form")),
        *(Column(name, "uint8") for name in task.addresses),
        *(Column(name, "string") for name in ("fields", "extra", "data", "hex", "error")),
    ]


class _RowWriter(Writer):
    """Gathers rows and hands them to a table, a batch at a time."""

    def __init__(self, task: Task, sink: Sink) -> None:
        super().__init__(task)
        self._sink = sink

    @abc.abstractmethod
    def _write(self) -> None:
        """Hand the rows that were gathered to the table."""

    def flush(self) -> None:
        """Hand on what has been written so far, where the format can."""
        if self._sink.live:
            self._write()
            self._sink.flush()

    def close(self) -> None:
        """Write the last rows."""
        self._write()
        self._sink.close()

    def abandon(self) -> None:
        """Let go of the table; its file is thrown away."""
        self._sink.abandon()


class GeneralWriter(_RowWriter, EventWriter):
    """Writes a row for each frame or event, whatever it is."""

    def __init__(self, task: Task, sink: Sink) -> None:
        super().__init__(task, sink)
        self._rows: list[tuple[Any, ...]] = []
        self._held = 0
        self._fields = FieldsText(AS_JSON)
        # message, form, addresses, fields, extra, data
        self._nothing = (None,) * (len(task.addresses) + 5)

    def accepted(self, offset: int, raw: bytes, name: str, decoded: Decoded) -> None:
        """Write a frame as a message."""
        self.message(offset, "message", decoded)

    def refused(self, offset: int, raw: bytes, name: str, error: CodecError) -> None:
        """Write a frame as bytes, and why it is refused."""
        self._add((offset, "refused", *self._nothing, raw.hex(), f"{error.code}: {error}"))

    def message(self, offset: int, kind: str, decoded: Decoded) -> None:
        """Write a message."""
        if isinstance(decoded, Frame) and (fields := self._fields.of(decoded.message)) is not None:
            form, shown = decoded.message.layout.form, f"{{{fields}}}"
            extra, data = decoded.extra.hex() or None, None
        else:
            answer = frame_answer(decoded)
            form, shown = answer["form"], compact(answer["fields"])
            extra, data = answer.get("extra"), answer.get("data")
        name = message_of(decoded).layout.message
        addressed = self.task.addressed(decoded)
        self._add((offset, kind, name, form, *addressed, shown, extra, data, None, None))

    def no_message(self, offset: int, kind: str, raw: bytes) -> None:
        """Write bytes."""
        self._add((offset, kind, *self._nothing, raw.hex(), None))
        self._held += len(raw)
        if self._held > _HELD:
            self._write()

    def _add(self, row: tuple[Any, ...]) -> None:
        self._rows.append(row)
        if len(self._rows) >= self._sink.batch:
            self._write()

    def _write(self) -> None:
        if self._rows:
            self._sink.write(list(zip(*self._rows, strict=True)))
            self._rows.clear()
            self._held = 0


def typed_columns(message: type[Message]) -> list[Column]:
    """Return the columns for one message: a typed one for each field, and bytes beyond the layout.

    Raises :class:`~stagewire.errors.UnsupportedError` for a message without a documented layout.
    """
    header = (Column("offset", "uint64"), Column("dest", "uint8"), Column("source", "uint8"))
    fields = (Column(place.name, _type(place)) for place in shape_of(message).places)
    return [*header, *fields, Column("extra", "binary")]


def _type(place: Place) -> str:
    if place.kind in _TYPES:
        return _TYPES[place.kind]
    return f"{'u' * (place.kind is Kind.UNSIGNED)}int{place.width * 8}"


class TypedWriter(_RowWriter):
    """Writes a row for each frame of one message, through columns.

    What is no such frame has no place in these columns: a refusal is said on standard error.
    """

    def __init__(self, task: FramedTask, only: type[Message], sink: Sink) -> None:
        super().__init__(task, sink)
        self._sorter = Sorter(task.protocol, task.context, only=[only])
        self._frames = self._sorter.frames.setdefault(only, Frames(only))

    def events(self, offset: int, events: Iterable[Event]) -> None:
        """Write the events that are frames of the message."""
        self._sorter.take(offset, events)
        self._write_full()

    def accepted(self, offset: int, raw: bytes, name: str, decoded: Decoded) -> None:
        """Write a frame of the message."""
        self._frames.append(offset, raw)
        self._write_full()

    def pending(self, offset: int, raw: bytes) -> None:
        """Nothing: it is no frame of the message."""

    def refused(self, offset: int, raw: bytes, name: str, error: CodecError) -> None:
        """Say why a frame is refused."""
        where = f"{name}: " if name else ""
        typer.echo(f"{where}{error.code}: {error}", err=True)

    def _write_full(self) -> None:
        if len(self._frames) >= self._sink.batch:
            self._write()

    def _write(self) -> None:
        frames = self._frames
        if not len(frames):
            return
        columns = frames.columns()
        extra: list[bytes | None] = [None] * len(frames)
        for number, following in frames.extra.items():
            extra[number] = following
        self._sink.write([frames.offsets, *columns.values(), extra])
        frames.clear()
