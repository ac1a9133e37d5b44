"""CSV: a heading, then a row for each event or frame; byte strings in hex."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Sequence
from typing import Any, TextIO

from stagewire_cli.formats.sink import Column, Sink
from stagewire_cli.terminal import printable

__all__ = ["CsvSink"]


class CsvSink(Sink):
    """Writes CSV; a field with a comma, a quote or a line end is quoted.

    Text is written as it came, except to a terminal, which it could steer.
    """

    def __init__(self, columns: Sequence[Column], out: TextIO) -> None:
        self._out = out
        if isinstance(out, io.TextIOWrapper):
            out.reconfigure(newline="")  # lines end as RFC 4180 says, on every system
        self._rows = csv.writer(out)
        self._rows.writerow([column.name for column in columns])
        shown: dict[str, Callable[[Any], str]] = {"binary": _hex}
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
        """Hand on what has been written so far."""
        self._out.flush()

    def close(self) -> None:
        """Hand on the last rows."""
        self._out.flush()

    def abandon(self) -> None:
        """Nothing: no row is held."""


def _hex(raw: bytes | None) -> str:
    return "" if raw is None else raw.hex()


def _safely(text: str | None) -> str:
    return "" if text is None else printable(text)
