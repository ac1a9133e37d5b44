"""The board of ``stagewire monitor``: the latest status of every part, and the rate of statuses.

A row is a status as ``record()`` of the library writes it, a dictionary of column and value.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from typing import Any, TypeAlias

Row: TypeAlias = dict[str, Any]

_RATE_OVER = 2.0  # seconds over which the rate of statuses is counted
_SMALLEST = 0.001  # smallest number that is written with four decimal places
_HEAD = ("time_s", "wall_clock", "part")


def part_of(row: Row) -> str:
    """Return the bay, channel or axis of a row; empty for a controller with a single part."""
    return str(row.get("part", ""))


def numbers_of(row: Row) -> Iterator[tuple[str, str]]:
    """Yield the numbers of a row as text, by column."""
    for name, value in row.items():
        if name in _HEAD or value is None or isinstance(value, bool):
            continue
        yield name, _decimal(value) if isinstance(value, float) else str(value)


def _decimal(value: float) -> str:
    """Return a number with four decimal places; a smaller one with four significant digits."""
    return f"{value:.4f}" if value == 0 or abs(value) >= _SMALLEST else f"{value:.4g}"


def state_of(row: Row) -> str | None:
    """Return the names of the bits that are set, a dash if none is, and None for a row without bits."""
    bits = {name: value for name, value in row.items() if isinstance(value, bool)}
    return ", ".join(name for name, value in bits.items() if value) or "-" if bits else None


def line_of(row: Row) -> str:
    """Return one line of text for a row."""
    words = [f"{row['time_s']:9.3f}", *([part_of(row)] if part_of(row) else [])]
    words += [f"{name}={value}" for name, value in numbers_of(row)]
    state = state_of(row)
    return "  ".join([*words, *([] if state is None else [f"[{state}]"])])


class Board:
    """The latest row of every part, with the rate of rows."""

    def __init__(self) -> None:
        self.latest: dict[str, Row] = {}
        self.dropped = 0
        self.count = 0
        self._times: dict[str, deque[float]] = {}

    def add(self, row: Row) -> None:
        """Add a row."""
        self.count += 1
        part = part_of(row)
        self.latest[part] = row
        self._times.setdefault(part, deque()).append(row["time_s"])

    def rate(self, part: str, now: float) -> float:
        """Return the number of rows of a part per second, over the last two seconds."""
        times = self._times[part]
        while times and times[0] < now - _RATE_OVER:
            times.popleft()
        return len(times) / min(_RATE_OVER, max(now, 0.1))
