"""Parquet, through pyarrow: columns with types, written in row groups."""

from __future__ import annotations

import contextlib
import importlib
from array import array
from collections.abc import Sequence
from typing import Any, BinaryIO

from stagewire_cli.errors import CalledWronglyError
from stagewire_cli.formats.sink import Column, Sink

__all__ = ["ParquetSink", "require_pyarrow"]


def require_pyarrow() -> None:
    """Raise :class:`CalledWronglyError` where pyarrow is not installed."""
    try:
        importlib.import_module("pyarrow.parquet")
    except ImportError:
        raise CalledWronglyError(
            "Parquet needs pyarrow; it comes with pip install 'stagewire[parquet]'"
        ) from None


class ParquetSink(Sink):
    """Writes a Parquet file; every batch becomes a row group."""

    batch = 65_536
    live = False

    def __init__(self, columns: Sequence[Column], out: BinaryIO) -> None:
        require_pyarrow()
        self._arrow = importlib.import_module("pyarrow")
        parquet = importlib.import_module("pyarrow.parquet")
        self._types = [getattr(self._arrow, column.type)() for column in columns]
        names = [column.name for column in columns]
        self._schema = self._arrow.schema(list(zip(names, self._types, strict=True)))
        self._file = parquet.ParquetWriter(out, self._schema)

    def write(self, values: Sequence[Sequence[Any]]) -> None:
        """Add rows as one row group."""
        arrays = [
            self._array(column, type) for column, type in zip(values, self._types, strict=True)
        ]
        self._file.write_table(self._arrow.Table.from_arrays(arrays, schema=self._schema))

    def _array(self, column: Sequence[Any], type: Any) -> Any:
        if isinstance(
            column, array
        ):  # already as Arrow holds it: taken over without a look at values
            buffers = [None, self._arrow.py_buffer(column)]
            return self._arrow.Array.from_buffers(type, len(column), buffers)
        return self._arrow.array(column, type)

    def flush(self) -> None:
        """Nothing: the file can be read when it is closed, and small row groups are slow."""

    def close(self) -> None:
        """Write the index at the end of the file."""
        self._file.close()

    def abandon(self) -> None:
        """Close the file while it can be written to, or pyarrow complains when it is collected."""
        with contextlib.suppress(Exception):  # what has failed before may fail again
            self._file.close()
