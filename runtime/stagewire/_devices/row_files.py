"""Files of rows: CSV, safe line by line, and Parquet, which is finished at the end."""

from __future__ import annotations

import csv
import errno
import io
import os
import tempfile
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from typing import Any, Final, Protocol

from stagewire._devices.rows import Row
from stagewire.errors import RecordingError

_DIGITS: Final = 10
"""Significant digits of a number in a text file."""


class RowFile(Protocol):
    """A file that rows are appended to."""

    def write(self, rows: Sequence[Row]) -> None:
        """Append rows; raise :class:`OSError` if they cannot be written."""

    def close(self) -> None:
        """Finish the file. Harmless if called twice."""

    def discard(self) -> None:
        """Close and remove the file."""


def check_path(path: Path, *, overwrite: bool) -> None:
    """Raise :class:`~stagewire.errors.RecordingError` if a recording cannot be written to a path."""
    if path.suffix.lower() not in _KINDS:
        known = " or ".join(_KINDS)
        raise RecordingError(f"{path}: the name of a recording must end in {known}")
    if path.exists() and not path.is_file():
        raise RecordingError(f"{path} is not a regular file")
    if path.exists() and not overwrite:
        raise RecordingError(
            f"{path} exists and is not replaced: choose another name, or pass overwrite=True"
        )
    if not path.absolute().parent.is_dir():
        raise RecordingError(f"{path}: missing folder {path.absolute().parent}")
    if path.suffix.lower() == ".parquet":
        _import_arrow()


def create(path: Path, columns: Mapping[str, type], *, overwrite: bool) -> RowFile:
    """Create the file for a recording, with its columns; the suffix of its name selects the format.

    Raise :class:`~stagewire.errors.RecordingError`.
    """
    check_path(path, overwrite=overwrite)
    try:
        return _KINDS[path.suffix.lower()](path, columns, overwrite)
    except OSError as error:
        raise RecordingError(f"{path} cannot be written: {error.strerror or error}") from error


class CsvFile:
    """CSV. Each call writes whole lines, so that a process that is killed leaves whole lines only."""

    def __init__(self, path: Path, columns: Mapping[str, type], overwrite: bool) -> None:
        self._path = path
        self._columns = tuple(columns)
        self._file = path.open("wb" if overwrite else "xb", buffering=0)
        self._end = 0  # of the last whole line
        try:
            self._append([self._columns])
        except OSError:
            self.discard()
            raise

    def write(self, rows: Sequence[Row]) -> None:
        """Append rows, and pass them to the system at once."""
        self._append([[as_text(row[name]) for name in self._columns] for row in rows])

    def _append(self, lines: Sequence[Sequence[Any]]) -> None:
        text = io.StringIO(newline="")
        csv.writer(text, lineterminator="\n").writerows(lines)
        data = memoryview(text.getvalue().encode())
        try:
            while data:
                data = data[self._file.write(data) :]
        except OSError:
            with suppress(OSError):  # a full disk accepts only a part of the last line
                self._file.truncate(self._end)
                self._file.seek(self._end)
            raise
        self._end = self._file.tell()

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def discard(self) -> None:
        """Close and remove the file."""
        self._file.close()
        _remove(self._path)


def as_text(value: Any) -> Any:
    """Return a value as it is written to text: numbers with at most ten digits, and nothing for None."""
    if isinstance(value, float):
        return f"{value:.{_DIGITS}g}"
    return "" if value is None else value


class ParquetFile:
    """Parquet. It has a temporary name until it is closed; before that, no program can read it."""

    _GROUP: Final = 10_000  # rows

    def __init__(self, path: Path, columns: Mapping[str, type], overwrite: bool) -> None:
        self._arrow, self._parquet = _import_arrow()
        self._path = Path(os.path.realpath(path))  # replaces the target of a symbolic link
        self._overwrite = overwrite
        arrow = self._arrow
        types = {
            bool: arrow.bool_(),
            int: arrow.int64(),
            float: arrow.float64(),
            str: arrow.string(),
        }
        self._schema = arrow.schema([(name, types[kind]) for name, kind in columns.items()])
        self._rows: list[Row] = []
        number, part = tempfile.mkstemp(".part", f".{self._path.name}.", self._path.parent)
        self._part = Path(part)
        self._out = os.fdopen(number, "wb")
        try:
            self._writer = self._parquet.ParquetWriter(self._out, self._schema)
        except BaseException:
            self.discard()
            raise

    def write(self, rows: Sequence[Row]) -> None:
        """Keep rows until there are enough for a group of the file."""
        self._rows += rows
        if len(self._rows) >= self._GROUP:
            self._flush()

    def _flush(self) -> None:
        rows, self._rows = self._rows, []
        columns = {name: [row[name] for row in rows] for name in self._schema.names}
        self._writer.write_table(self._arrow.table(columns, schema=self._schema))

    def close(self) -> None:
        """Write the remaining rows and the table of contents, and give the file its name."""
        if self._out.closed:
            return
        try:
            try:
                self._flush()
            finally:  # the groups that were written before are kept
                self._writer.close()
                self._out.close()
        except BaseException:
            if not self._out.closed:
                self.discard()
                raise
            self._name()
            raise
        self._name()

    def _name(self) -> None:
        """Give the file its name; raise :class:`FileExistsError` rather than replace another file."""
        if self._path.exists() and not self._overwrite:
            raise FileExistsError(
                errno.EEXIST, f"{self._path} appeared meanwhile; the recording is {self._part}"
            )
        self._part.chmod(0o666 & ~_umask())
        self._part.replace(self._path)

    def discard(self) -> None:
        """Close and remove the file under its temporary name."""
        with suppress(OSError):
            self._out.close()
        _remove(self._part)


def _umask() -> int:
    """Return the mask of permissions of new files; the system reports it only while it is set."""
    mask = os.umask(0o077)
    os.umask(mask)
    return mask


def _remove(path: Path) -> None:
    with suppress(OSError):
        path.unlink()


_KINDS: Final[dict[str, Callable[[Path, Mapping[str, type], bool], RowFile]]] = {
    ".csv": CsvFile,
    ".parquet": ParquetFile,
}


def _import_arrow() -> tuple[Any, Any]:
    try:
        return import_module("pyarrow"), import_module("pyarrow.parquet")
    except ImportError:
        raise RecordingError(
            "a recording as Parquet requires pyarrow; install it with pip install 'stagewire[parquet]'"
        ) from None
