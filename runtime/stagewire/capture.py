"""A recorded session: what host and controller said to each other on one line, and when; as text.

::

    # stagewire capture 1 protocol=thorlabs_apt unit=TDC001
    0.000000 > 05 00 00 00 50 01  # HW_REQ_INFO
    0.001250 < 06 00 54 00 81 50  # the first bytes of HW_GET_INFO
    # 0.200000 the line was cut

The first line names format, version and protocol, and the unit if it is known. Every other line is a time
in seconds since the recording began, ``>`` for what the host said or ``<`` for what the controller said, and
bytes in hex, as they passed: a frame, a part of one, or several. What follows ``#`` is for people; a line may
be blank, or a comment alone. Times never go back.

Nothing here knows a message; what a comment says of the bytes is said by who writes it.
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
_LONGEST_WRITTEN: Final = 1 << 16  # bytes in a line; what is longer takes several
_BLOCK: Final = 1 << 16

_BEGINNING = re.compile(re.escape(_MAGIC) + "[0-9]")
_TIME = re.compile(r"([0-9]{1,12})(?:\.([0-9]{1,9}))?\Z")
_WORD = re.compile(r"[A-Za-z0-9_.+-]+\Z")
_DIRECTIONS: Final = {">": Direction.TO_CONTROLLER, "<": Direction.TO_HOST}
_MARKS: Final = {direction: mark for mark, direction in _DIRECTIONS.items()}


@dataclass(frozen=True, slots=True)
class Heading:
    """What the first line of a capture says.

    :param protocol: name of the protocol that was spoken.
    :param unit: name of the unit, if it is known.

    Raises :class:`~stagewire.errors.BadValueError` for a name that is none.
    """

    protocol: str
    unit: str | None = None

    def __post_init__(self) -> None:
        for name in (self.protocol, self.unit):
            if name is not None and not _WORD.match(name):
                raise BadValueError(f"{name!r} is no name of a protocol or unit")

    def __str__(self) -> str:
        unit = f" unit={self.unit}" if self.unit else ""
        return f"{_MAGIC}{_VERSION} protocol={self.protocol}{unit}"


@dataclass(frozen=True, slots=True)
class Recorded:
    """Bytes that passed.

    :param time: when, in nanoseconds since the recording began.
    :param direction: which way.
    :param data: the bytes.
    :param comment: what was written behind them, for people.
    :param line: number of the line in the capture.
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
    """Writes a capture line by line, as things happen; when lines are flushed is up to ``out``.

    :param out: where to; the heading is written at once.
    :param heading: what was recorded.
    """

    def __init__(self, out: TextIO, heading: Heading) -> None:
        self._out = out
        self._latest = 0
        out.write(f"{heading}\n")

    def write(self, time: int, direction: Direction, data: bytes, comment: str = "") -> None:
        """Write bytes that passed at ``time``, in nanoseconds; no bytes are no line.

        A time before the latest is written as the latest: lines stand in the order in which they were
        written.
        Raises :class:`~stagewire.errors.BadValueError` for a direction that is none, or both.
        """
        mark = _MARKS.get(direction)
        if mark is None:
            raise BadValueError(f"bytes pass one way, not {direction!r}")
        said = f"  # {_one_line(comment)}" if comment else ""
        for start in range(0, len(data), _LONGEST_WRITTEN):
            shown = data[start : start + _LONGEST_WRITTEN].hex(" ")
            self._out.write(f"{self._spelled(time)} {mark} {shown}{said}\n")
            said = ""

    def note(self, time: int, text: str) -> None:
        """Write a comment of its own: a connection, a fault."""
        self._out.write(f"# {self._spelled(time)} {_one_line(text)}\n")

    def _spelled(self, time: int) -> str:
        self._latest = max(self._latest, time)
        seconds, rest = divmod(self._latest, _SECOND)
        return f"{seconds}.{rest // 1000:06d}"


class CaptureReader:
    """Reads a capture that comes in blocks of text, cut anywhere."""

    def __init__(self) -> None:
        self.heading: Heading | None = None
        """What the first line says, as soon as it was read."""
        self._tail = ""
        self._line = 0
        self._latest = 0

    def feed(self, text: str) -> list[Recorded]:
        """Take the next block and return what its whole lines say.

        Raises :class:`~stagewire.errors.CaptureError` for a line that is none of a capture.
        """
        *lines, self._tail = (self._tail + text).split("\n")
        recorded = list(self._read(lines))
        if len(self._tail) > _LONGEST_LINE:
            raise CaptureError(self._line + 1, f"over {_LONGEST_LINE} characters in one line")
        return recorded

    def finish(self) -> list[Recorded]:
        """Take the end of the text; a last line may lack its line end.

        Raises :class:`~stagewire.errors.CaptureError` as :meth:`feed` does, and for a text without a heading.
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
                    raise CaptureError(self._line, "its time is before that of a line above it")
                self._latest = recorded.time
                yield recorded


def is_capture(text: str) -> bool:
    """Say whether a text begins as a capture does, of whichever version."""
    return _BEGINNING.match(text) is not None


def read_capture(path: Path | str) -> Capture:
    """Read a whole capture from a file.

    Raises :class:`~stagewire.errors.CaptureError` for what is none, with the name of the file, and
    :class:`OSError` for a file that cannot be read.
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
    """Return what the first line says."""
    if not is_capture(text):
        raise CaptureError(1, f"not a capture, which begins with {_MAGIC + _VERSION!r}")
    version, *words = text.removeprefix(_MAGIC).split()
    if version != _VERSION:
        raise CaptureError(1, f"a capture of version {version}; this reads version {_VERSION}")
    values: dict[str, str] = {}
    for word in words:
        key, _, value = word.partition("=")
        if key not in ("protocol", "unit") or not _WORD.match(value):
            raise CaptureError(1, f"{word!r} is not protocol=NAME or unit=NAME")
        if key in values:
            raise CaptureError(1, f"{key} is there twice")
        values[key] = value
    if "protocol" not in values:
        raise CaptureError(1, "it does not say which protocol: protocol=NAME is missing")
    return Heading(**values)


def _recorded(text: str, line: int) -> Recorded:
    """Return what a line says that is no comment."""
    said, _, comment = text.partition("#")
    time, mark, digits = (*said.split(None, 2), "", "", "")[:3]
    matched = _TIME.match(time)
    if matched is None:
        raise CaptureError(line, f"{_short(time)} is no time in seconds, such as 0.250000")
    if mark not in _DIRECTIONS:
        raise CaptureError(
            line, f"{_short(mark)} is no direction: > is from the host, < from the controller"
        )
    try:
        data = bytes.fromhex(digits)
    except ValueError:
        raise CaptureError(line, f"{_short(digits)} is not bytes as pairs of hex digits") from None
    if not data:
        raise CaptureError(line, f"no bytes after {mark}")
    whole, part = matched.groups()
    nanoseconds = int(whole) * _SECOND + int((part or "").ljust(9, "0"))
    return Recorded(nanoseconds, _DIRECTIONS[mark], data, comment.strip(), line)


def _short(text: str) -> str:
    text = text.strip()
    return repr(text if len(text) <= 40 else f"{text[:40]}…")


def _one_line(text: str) -> str:
    """Return a comment with nothing in it that ends a line or steers a terminal."""
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() else repr(c)[1:-1] for c in text)
