"""Captures: recorded sessions as text, with the bytes between host and controller and their times.

::

    # stagewire capture 1 protocol=thorlabs_apt unit=TDC001
    0.000000 > 05 00 00 00 50 01  # HW_REQ_INFO
    0.001250 < 06 00 54 00 81 50  # the first bytes of HW_GET_INFO
    # 0.200000 the line was cut

The first line names the format, its version, the protocol and, if known, the unit. Each of the other lines
holds a time in seconds since the recording began, a direction (``>`` from the host, ``<`` from the
controller) and bytes in hex as they were transferred: one frame, part of one, or several. Text after ``#`` is
a comment. A line may be blank or only a comment. Times never decrease.

This module does not decode messages. The program that writes a capture chooses its comments.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final, TextIO

from stagewire._codec.message import Direction
from stagewire.errors import BadValueError, CaptureError

__all__ = [
    "Capture",
    "CaptureReader",
    "CaptureWriter",
    "Heading",
    "Recorded",
    "is_capture",
    "read_capture",
]

_MAGIC: Final = "# stagewire capture "
_VERSION: Final = "1"
_SECOND: Final = 1_000_000_000
_LONGEST_LINE: Final = 1 << 20  # characters
_LONGEST_WRITTEN: Final = 1 << 16  # bytes per line; longer data takes several lines
_BLOCK: Final = 1 << 16

_BEGINNING = re.compile(re.escape(_MAGIC) + "[0-9]")
_TIME = re.compile(r"([0-9]{1,12})(?:\.([0-9]{1,9}))?\Z")
_WORD = re.compile(r"[A-Za-z0-9_.+-]+\Z")
_DIRECTIONS: Final = {">": Direction.TO_CONTROLLER, "<": Direction.TO_HOST}
_MARKS: Final = {direction: mark for mark, direction in _DIRECTIONS.items()}


@dataclass(frozen=True, slots=True)
class Heading:
    """The first line of a capture.

    :param protocol: name of the protocol.
    :param unit: name of the unit, if it is known.

    Raises :class:`~stagewire.errors.BadValueError` for an invalid name.
    """

    protocol: str
    unit: str | None = None

    def __post_init__(self) -> None:
        for name in (self.protocol, self.unit):
            if name is not None and not _WORD.match(name):
                raise BadValueError(f"{name!r} is not a valid name of a protocol or unit")

    def __str__(self) -> str:
        unit = f" unit={self.unit}" if self.unit else ""
        return f"{_MAGIC}{_VERSION} protocol={self.protocol}{unit}"


@dataclass(frozen=True, slots=True)
class Recorded:
    """Bytes that were transferred.

    :param time: when, in nanoseconds since the recording began.
    :param direction: which way.
    :param data: the bytes.
    :param comment: the comment after the bytes.
    :param line: line number in the capture.
    """

    time: int
    direction: Direction
    data: bytes
    comment: str = ""
    line: int = 0


@dataclass(frozen=True, slots=True)
class Capture:
    """A whole recorded session."""

    heading: Heading
    recorded: tuple[Recorded, ...]


class CaptureWriter:
    """A writer of captures. It writes line by line and leaves flushing to ``out``.

    :param out: the text file; the heading is written immediately.
    :param heading: the first line.
    """

    def __init__(self, out: TextIO, heading: Heading) -> None:
        self._out = out
        self._latest = 0
        out.write(f"{heading}\n")

    def write(self, time: int, direction: Direction, data: bytes, comment: str = "") -> None:
        """Write bytes that were transferred at ``time``, in nanoseconds. Write nothing if there are none.

        A time before the previous one is replaced by the previous one, so that times never decrease.
        Raises :class:`~stagewire.errors.BadValueError` unless ``direction`` is exactly one direction.
        """
        mark = _MARKS.get(direction)
        if mark is None:
            raise BadValueError(f"direction is TO_CONTROLLER or TO_HOST, not {direction!r}")
        said = f"  # {_one_line(comment)}" if comment else ""
        for start in range(0, len(data), _LONGEST_WRITTEN):
            shown = data[start : start + _LONGEST_WRITTEN].hex(" ")
            self._out.write(f"{self._spelled(time)} {mark} {shown}{said}\n")
            said = ""

    def note(self, time: int, text: str) -> None:
        """Write a comment line, such as for a connection or a fault."""
        self._out.write(f"# {self._spelled(time)} {_one_line(text)}\n")

    def _spelled(self, time: int) -> str:
        self._latest = max(self._latest, time)
        seconds, rest = divmod(self._latest, _SECOND)
        return f"{seconds}.{rest // 1000:06d}"


class CaptureReader:
    """A reader of captures that arrive in blocks of text, cut anywhere."""

    def __init__(self) -> None:
        self.heading: Heading | None = None
        """The first line, once it was read."""
        self._tail = ""
        self._line = 0
        self._latest = 0

    def feed(self, text: str) -> list[Recorded]:
        """Take the next block and return the entries of its complete lines.

        Raises :class:`~stagewire.errors.CaptureError` for an invalid line.
        """
        *lines, self._tail = (self._tail + text).split("\n")
        recorded = list(self._read(lines))
        if len(self._tail) > _LONGEST_LINE:
            raise CaptureError(self._line + 1, f"over {_LONGEST_LINE} characters in one line")
        return recorded

    def finish(self) -> list[Recorded]:
        """Take the end of the text and return its last entry. The last line need not end in a newline.

        Raises :class:`~stagewire.errors.CaptureError` for an invalid line or a text without a heading.
        """
        lines, self._tail = [self._tail], ""
        return list(self._read(lines))

    def _read(self, lines: list[str]) -> Iterator[Recorded]:
        for text in lines:
            self._line += 1
            if self.heading is None:
                self.heading = _heading(text)
            elif (said := text.strip()) and not said.startswith("#"):
                recorded = _recorded(said, self._line)
                if recorded.time < self._latest:
                    raise CaptureError(self._line, "its time is earlier than that of a line above")
                self._latest = recorded.time
                yield recorded


def is_capture(text: str) -> bool:
    """Return whether a text begins like a capture, of any version."""
    return _BEGINNING.match(text) is not None


def read_capture(path: Path | str) -> Capture:
    """Read a whole capture from a file.

    Raises :class:`~stagewire.errors.CaptureError`, with the name of the file, for a file that is not a valid
    capture, and :class:`OSError` for a file that cannot be read.
    """
    reader = CaptureReader()
    recorded: list[Recorded] = []
    try:
        with open(path, encoding="utf-8-sig", errors="backslashreplace") as file:
            while block := file.read(_BLOCK):
                recorded += reader.feed(block)
        recorded += reader.finish()
    except CaptureError as error:
        raise error.of(path) from None
    assert reader.heading is not None  # finish raises without one
    return Capture(reader.heading, tuple(recorded))


def _heading(text: str) -> Heading:
    """Return the heading in the first line."""
    if not is_capture(text):
        raise CaptureError(
            1, f"not a capture: the first line must begin with {_MAGIC + _VERSION!r}"
        )
    version, *words = text.removeprefix(_MAGIC).split()
    if version != _VERSION:
        raise CaptureError(1, f"capture version {version} is unsupported (supported: {_VERSION})")
    values: dict[str, str] = {}
    for word in words:
        key, _, value = word.partition("=")
        if key not in ("protocol", "unit") or not _WORD.match(value):
            raise CaptureError(1, f"{word!r} is not protocol=NAME or unit=NAME")
        if key in values:
            raise CaptureError(1, f"{key} is given twice")
        values[key] = value
    if "protocol" not in values:
        raise CaptureError(1, "the protocol is missing: add protocol=NAME")
    return Heading(**values)


def _recorded(text: str, line: int) -> Recorded:
    """Return the entry of a line that is not a comment."""
    said, _, comment = text.partition("#")
    time, mark, digits = (*said.split(None, 2), "", "", "")[:3]
    matched = _TIME.match(time)
    if matched is None:
        raise CaptureError(line, f"{_short(time)} is not a time in seconds, such as 0.250000")
    if mark not in _DIRECTIONS:
        raise CaptureError(
            line, f"{_short(mark)} is not a direction: > is from the host, < from the controller"
        )
    try:
        data = bytes.fromhex(digits)
    except ValueError:
        raise CaptureError(line, f"{_short(digits)} is not pairs of hex digits") from None
    if not data:
        raise CaptureError(line, f"no bytes after {mark}")
    whole, part = matched.groups()
    nanoseconds = int(whole) * _SECOND + int((part or "").ljust(9, "0"))
    return Recorded(nanoseconds, _DIRECTIONS[mark], data, comment.strip(), line)


def _short(text: str) -> str:
    text = text.strip()
    return repr(text if len(text) <= 40 else f"{text[:40]}…")


def _one_line(text: str) -> str:
    """Return a comment with line ends and control characters escaped."""
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() else repr(c)[1:-1] for c in text)
