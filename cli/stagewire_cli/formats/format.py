"""The formats of ``stagewire decode``, by name."""

from __future__ import annotations

import enum
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from stagewire_cli.formats.lines import JsonLinesWriter, TableWriter
from stagewire_cli.formats.rows import GeneralWriter, TypedWriter, general_columns
from stagewire_cli.formats.sinks import CsvSink, ParquetSink, require_pyarrow
from stagewire_cli.formats.task import Task
from stagewire_cli.formats.writer import Writer


class Format(enum.Enum):
    """Values of ``--format``."""

    TABLE = "table"
    JSONL = "jsonl"
    CSV = "csv"
    PARQUET = "parquet"

    @property
    def has_rows(self) -> bool:
        """Whether it is a table of rows and columns."""
        return self in (Format.CSV, Format.PARQUET)


def check_format(format: Format, task: Task) -> None:
    """Raise for a format that cannot be written, before anything is read.

    Raises :class:`~stagewire.errors.UnsupportedError` for a message that has no columns, and
    ``CalledWronglyError`` if pyarrow is required and not installed.
    """
    if format.has_rows and task.only is not None:
        task.typed_rows()
    if format is Format.PARQUET:
        require_pyarrow()


@contextmanager
def writing(format: Format, task: Task, out: Any) -> Iterator[Writer]:
    """Yield a writer of ``format`` to ``out``, which is a binary stream for Parquet, else a text stream.

    Buffered rows are written when the block ends, unless it fails.
    """
    made = _writer(format, task, out)
    try:
        yield made
    except BaseException:
        made.abandon()
        raise
    made.close()


def _writer(format: Format, task: Task, out: Any) -> Writer:
    if format is Format.TABLE:
        return TableWriter(task, out)
    if format is Format.JSONL:
        return JsonLinesWriter(task, out)
    sink = CsvSink if format is Format.CSV else ParquetSink
    if task.only is None:
        return GeneralWriter(task, sink(general_columns(task), out))
    rows = task.typed_rows()
    return TypedWriter(task, rows, sink(rows.columns, out))
