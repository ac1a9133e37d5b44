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
from stagewire_cli.formats.writer import EventWriter, Task, Writer
from stagewire_conformance.answers import frame_answer

__all__ = ["GENERAL", "GeneralWriter", "TypedWriter", "typed_columns"]

GENERAL: Final = (
    Column("offset", "uint64"),
    Column("event", "string"),
    Column("message", "string"),
    Column("form", "string"),
    Column("dest", "uint8"),
    Column("source", "uint8"),
    Column("fields", "string"),
    Column("extra", "string"),
    Column("data", "string"),
    Column("hex", "string"),
    Column("error", "string"),
)
"""The columns that fit everything: what JSON lines say, with the fields of a message as JSON."""

_HELD: Final = 4 * 1024 * 1024
"""Bytes that are no message and wait for a batch: a row of garbage may be a whole block."""

_TYPES: Final = {Kind.TEXT: "string", Kind.BYTES: "binary"}


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

    def accepted(self, offset: int, raw: bytes, name: str, frame: Frame) -> None:
        """Write a frame as a message."""
        self.message(offset, "message", frame)

    def refused(self, offset: int, raw: bytes, name: str, error: CodecError) -> None:
        """Write a frame as bytes, and why it is refused."""
        empty = (None,) * 7
        self._add((offset, "refused", *empty, raw.hex(), f"{error.code}: {error}"))

    def message(self, offset: int, kind: str, frame: Frame) -> None:
        """Write a message."""
        layout = frame.message.layout
        fields = self._fields.of(frame.message)
        if fields is None:
            answer = frame_answer(frame)
            shown, extra, data = compact(answer["fields"]), answer.get("extra"), answer.get("data")
        else:
            shown, extra, data = f"{{{fields}}}", frame.extra.hex() or None, None
        addressed = (layout.message, layout.form, frame.dest, frame.source)
        self._add((offset, kind, *addressed, shown, extra, data, None, None))

    def no_message(self, offset: int, kind: str, raw: bytes) -> None:
        """Write bytes."""
        empty = (None,) * 7
        self._add((offset, kind, *empty, raw.hex(), None))
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

    def __init__(self, task: Task, only: type[Message], sink: Sink) -> None:
        super().__init__(task, sink)
        self._sorter = Sorter(task.protocol, task.context, only=[only])
        self._frames = self._sorter.frames.setdefault(only, Frames(only))

    def events(self, offset: int, events: Iterable[Event]) -> None:
        """Write the events that are frames of the message."""
        self._sorter.take(offset, events)
        self._write_full()

    def accepted(self, offset: int, raw: bytes, name: str, frame: Frame) -> None:
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
