"""Sinks for rows: CSV and Parquet, and their common parts.

CSV has a heading, then a row for each event or frame; byte strings are in hex. Parquet, through pyarrow, has
columns with types, written in row groups.
"""

from __future__ import annotations

import abc
import contextlib
import csv
import importlib
import io
from array import array
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, BinaryIO, TextIO

from stagewire_cli.errors import CalledWronglyError
from stagewire_cli.output import printable


@dataclass(frozen=True, slots=True)
class Column:
    """One column of a table.

    :param name: its heading.
    :param type: ``uint8`` to ``int64``, ``string`` or ``binary``, as in Parquet and NumPy; ``integers`` for
        an array.
    """

    name: str
    type: str


class Sink(abc.ABC):
    """A table that is written from top to bottom.

    ``batch`` is the number of rows to write at a time; ``live`` is whether it also accepts fewer, so that
    slow input is shown as it arrives.
    """

    batch = 4096
    live = True

    @abc.abstractmethod
    def write(self, values: Sequence[Sequence[Any]]) -> None:
        """Add rows, column by column; None is a missing value."""

    @abc.abstractmethod
    def flush(self) -> None:
        """Flush the rows written so far."""

    @abc.abstractmethod
    def close(self) -> None:
        """Write the end of the table."""

    @abc.abstractmethod
    def abandon(self) -> None:
        """Discard a table that will not be finished."""


class CsvSink(Sink):
    """Writes CSV; a field with a comma, a quote or a line end is quoted.

    Text is written unchanged, except to a terminal, which it could control.
    """

    def __init__(self, columns: Sequence[Column], out: TextIO) -> None:
        self._out = out
        if isinstance(out, io.TextIOWrapper):
            out.reconfigure(newline="")  # lines end as RFC 4180 says, on every system
        self._rows = csv.writer(out)
        self._rows.writerow([column.name for column in columns])
        shown: dict[str, Callable[[Any], str]] = {"binary": _hex, "integers": _spaced}
        if out.isatty():
            shown["string"] = _safely
        self._shown = [shown.get(column.type) for column in columns]

    def write(self, values: Sequence[Sequence[Any]]) -> None:
        """Add rows."""
        shown = (
            column if show is None else map(show, column)
            for show, column in zip(self._shown, values, strict=True)
        )
        self._rows.writerows(zip(*shown, strict=True))

    def flush(self) -> None:
        """Flush the rows written so far."""
        self._out.flush()

    def close(self) -> None:
        """Flush the last rows."""
        self._out.flush()

    def abandon(self) -> None:
        """Do nothing, because no rows are buffered."""


def _hex(raw: bytes | None) -> str:
    return "" if raw is None else raw.hex()


def _spaced(numbers: Sequence[int] | None) -> str:
    return "" if numbers is None else " ".join(map(str, numbers))


def _safely(text: str | None) -> str:
    return "" if text is None else printable(text)


def require_pyarrow() -> None:
    """Raise :class:`CalledWronglyError` if pyarrow is not installed."""
    try:
        importlib.import_module("pyarrow.parquet")
    except ImportError:
        raise CalledWronglyError(
            "Parquet needs pyarrow: run pip install 'stagewire[parquet]'"
        ) from None


class ParquetSink(Sink):
    """Writes a Parquet file; every batch becomes a row group."""

    batch = 65_536
    live = False

    def __init__(self, columns: Sequence[Column], out: BinaryIO) -> None:
        require_pyarrow()
        self._arrow = importlib.import_module("pyarrow")
        parquet = importlib.import_module("pyarrow.parquet")
        self._types = [self._type(column.type) for column in columns]
        names = [column.name for column in columns]
        self._schema = self._arrow.schema(list(zip(names, self._types, strict=True)))
        self._file = parquet.ParquetWriter(out, self._schema)

    def write(self, values: Sequence[Sequence[Any]]) -> None:
        """Add rows as one row group."""
        arrays = [
            self._array(column, type) for column, type in zip(values, self._types, strict=True)
        ]
        self._file.write_table(self._arrow.Table.from_arrays(arrays, schema=self._schema))

    def _type(self, name: str) -> Any:
        if name == "integers":
            return self._arrow.list_(self._arrow.int64())
        return getattr(self._arrow, name)()

    def _array(self, column: Sequence[Any], type: Any) -> Any:
        if isinstance(
            column, array
        ):  # already in the format of Arrow, so values need not be converted
            buffers = [None, self._arrow.py_buffer(column)]
            return self._arrow.Array.from_buffers(type, len(column), buffers)
        return self._arrow.array(column, type)

    def flush(self) -> None:
        """Do nothing: the file cannot be read before it is closed, and small row groups are slow."""

    def close(self) -> None:
        """Write the index at the end of the file."""
        self._file.close()

    def abandon(self) -> None:
        """Close the file while it can be written to, to avoid errors of pyarrow when it is collected."""
        with contextlib.suppress(Exception):  # an earlier failure may occur again
            self._file.close()
