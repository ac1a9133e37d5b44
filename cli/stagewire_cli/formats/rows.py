"""Rows of a table in two forms: one row for every event, or typed columns of one message."""

from __future__ import annotations

import abc
from collections.abc import Iterable
from typing import Any, Final

import typer

from stagewire.errors import CodecError
from stagewire.framing import Event
from stagewire.protocols import Frame
from stagewire_cli.formats.sinks import Column, Sink
from stagewire_cli.formats.task import Task, TypedRows
from stagewire_cli.formats.writer import (
    AS_JSON,
    ENGINEERING,
    EventWriter,
    FieldsText,
    Writer,
    compact,
)
from stagewire_conformance.answers import Decoded, frame_answer, message_of

_HELD: Final = 4 * 1024 * 1024
"""The most bytes of garbage to hold for a batch; a row of garbage may be a whole block."""


def general_columns(task: Task) -> list[Column]:
    """Return columns for all events, like those of JSON lines, with the fields of a message as JSON."""
    return [
        *task.places,
        *(Column(name, "string") for name in ("event", "message", "form")),
        *task.addresses,
        *(Column(name, "string") for name in ("fields", "extra", "data", "hex", "error")),
        *(Column(ENGINEERING, "string") for _ in (task.stage_values,) if _),
    ]


class _RowWriter(Writer):
    """Collects rows and passes them to a table in batches."""

    def __init__(self, task: Task, sink: Sink) -> None:
        super().__init__(task)
        self._sink = sink

    @abc.abstractmethod
    def _write(self) -> None:
        """Pass the collected rows to the table."""

    def flush(self) -> None:
        """Write the rows so far, if the format can."""
        if self._sink.live:
            self._write()
            self._sink.flush()

    def close(self) -> None:
        """Write the last rows."""
        self._write()
        self._sink.close()

    def abandon(self) -> None:
        """Abandon the table; its file is discarded."""
        self._sink.abandon()


class GeneralWriter(_RowWriter, EventWriter):
    """Writes a row for each frame or event of any kind."""

    def __init__(self, task: Task, sink: Sink) -> None:
        super().__init__(task, sink)
        self._rows: list[tuple[Any, ...]] = []
        self._held = 0
        self._fields = FieldsText(AS_JSON, task)
        # message, form, addresses, fields, extra, data
        self._no_units = (None,) if task.stage_values else ()
        self._nothing = (None,) * (len(task.addresses) + 5)

    def accepted(self, offset: int, raw: bytes, name: str, decoded: Decoded) -> None:
        """Write a frame as a message."""
        self.message(offset, "message", decoded)

    def refused(self, offset: int, raw: bytes, name: str, error: CodecError) -> None:
        """Write a refused frame as bytes, with the error."""
        self._add(
            (
                offset,
                *self.task.stamp,
                "refused",
                *self._nothing,
                raw.hex(),
                f"{error.code}: {error}",
                *self._no_units,
            )
        )

    def message(self, offset: int, kind: str, decoded: Decoded) -> None:
        """Write a message."""
        units: tuple[str | None, ...] = ()
        if self.task.stage_values:
            answer = frame_answer(decoded)
            units = (compact(found) if (found := self.task.in_units(answer)) else None,)
        if isinstance(decoded, Frame) and (fields := self._fields.of(decoded.message)) is not None:
            form, shown = decoded.message.layout.form, f"{{{fields}}}"
            extra, data = decoded.extra.hex() or None, None
        else:
            answer = self.task.answer(decoded)
            form, shown = answer["form"], compact(answer["fields"])
            extra, data = answer.get("extra"), answer.get("data")
        name = message_of(decoded).layout.message
        addressed = self.task.addressed(decoded)
        place = (offset, *self.task.stamp)
        self._add((*place, kind, name, form, *addressed, shown, extra, data, None, None, *units))

    def no_message(self, offset: int, kind: str, raw: bytes) -> None:
        """Write bytes."""
        self._add(
            (offset, *self.task.stamp, kind, *self._nothing, raw.hex(), None, *self._no_units)
        )
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


class TypedWriter(_RowWriter):
    """Writes a row for each message of one kind, with typed columns.

    The columns fit only this message, so a refusal is reported on standard error.
    """

    def __init__(self, task: Task, rows: TypedRows, sink: Sink) -> None:
        super().__init__(task, sink)
        self._rows = rows

    def events(self, offset: int, events: Iterable[Event]) -> None:
        """Write the events with the message."""
        self._rows.take(offset, events)
        self._write_full()

    def accepted(self, offset: int, raw: bytes, name: str, decoded: Decoded) -> None:
        """Write one message."""
        self._rows.append(offset, raw, decoded)
        self._write_full()

    def pending(self, offset: int, raw: bytes) -> None:
        """Write nothing, because the bytes are not a message."""

    def refused(self, offset: int, raw: bytes, name: str, error: CodecError) -> None:
        """Print why bytes are refused."""
        where = f"{name}: " if name else ""
        typer.echo(f"{where}{error.code}: {error}", err=True)

    def _write_full(self) -> None:
        if len(self._rows) >= self._sink.batch:
            self._write()

    def _write(self) -> None:
        if len(self._rows):
            self._sink.write(self._rows.values())
            self._rows.clear()
