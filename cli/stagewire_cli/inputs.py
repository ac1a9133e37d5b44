"""Input of ``stagewire decode``: hex text, recorded sessions, JSON, or raw bytes; in blocks."""

from __future__ import annotations

import codecs
import json
import os
import re
import stat
from collections.abc import Iterator
from typing import Any, BinaryIO

from stagewire.capture import CaptureReader, Heading, Recorded, is_capture
from stagewire.errors import CaptureError
from stagewire_cli.errors import CalledWronglyError
from stagewire_cli.values import HexText, parse_hex

BLOCK = 64 * 1024
_LENIENT = "backslashreplace"
_MAXIMUM_JSON = 64 * 1024 * 1024
_MIB = 1024 * 1024
_CONTROL = re.compile(rb"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f]")
_JSON = re.compile(r'\s*(?:\{|\[\s*(?:["{\[\]]|\Z))')

Capture = tuple[str, bytes]
"""The name of an entry, and its bytes."""


class Source:
    """A stream that is read in blocks.

    ``read`` counts its bytes so far; ``size`` is their number, None if unknown.
    """

    def __init__(self, stream: BinaryIO) -> None:
        self.read = 0
        self.size = _size(stream)
        # read1 returns available bytes, so a live stream is shown as it arrives
        self._reader = getattr(stream, "read1", stream.read)

    def block(self) -> bytes:
        """Return the next bytes; empty at the end."""
        block: bytes = self._reader(BLOCK)
        self.read += len(block)
        return block

    @property
    def progress(self) -> str:
        """The progress of reading for people."""
        if not self.size:
            return f"{self.read:,} bytes"
        return f"{self.read:,} of {self.size:,} bytes ({self.read * 100 // self.size} %)"


def _size(stream: BinaryIO) -> int | None:
    try:
        found = os.fstat(stream.fileno())
    except (OSError, ValueError, AttributeError):  # not every stream has a file descriptor
        return None
    return found.st_size if stat.S_ISREG(found.st_mode) else None


def opening(source: Source) -> tuple[bytes, str | None]:
    """Return the first block as bytes, and as text, or None for raw bytes.

    Control characters, such as the bytes 0 and 1 in frames, indicate raw bytes. A recorded session is always
    text, whatever its comments contain.
    """
    block = source.block()
    recorded = _decoder(_LENIENT).decode(block)  # a block may end inside a character
    if is_capture(recorded):
        return block, recorded
    if _CONTROL.search(block):
        return block, None
    try:
        return block, _decoder().decode(block)
    except UnicodeDecodeError:
        return block, None


def heading(text: str | None) -> Heading | None:
    """Return the header of a recorded session; None for any other text.

    The first block contains the whole line, because it is short and written in one piece.
    """
    if text is None or not is_capture(text):
        return None
    reader = CaptureReader()
    _recorded(reader, text.partition("\n")[0] + "\n")
    return reader.heading


def session(source: Source, block: bytes) -> Iterator[list[Recorded]]:
    """Yield the records of a session, block by block, beginning with the first ``block``."""
    reader = CaptureReader()
    for text in _texts(source, block, _LENIENT):
        yield _recorded(reader, text)
    yield _recorded(reader, None)


def _recorded(reader: CaptureReader, text: str | None) -> list[Recorded]:
    """Feed text to a reader, or the end of the input for None."""
    try:
        return reader.finish() if text is None else reader.feed(text)
    except CaptureError as error:
        raise CalledWronglyError(str(error)) from None


def is_json(text: str | None) -> bool:
    """Return whether text begins like a list of captures or like JSON lines."""
    return text is not None and _JSON.match(text) is not None


def chunks(source: Source, block: bytes, text: str | None) -> Iterator[bytes]:
    """Yield the bytes of a source, beginning with its first ``block``."""
    if text is None:
        while block:
            yield block
            block = source.block()
        return
    reader = HexText()
    texts = _texts(source, block)
    try:
        for text in texts:
            yield reader.feed(text)
        yield reader.finish()
    except ValueError as error:
        raise CalledWronglyError(str(error)) from None


def _decoder(errors: str = "strict") -> codecs.IncrementalDecoder:
    return codecs.getincrementaldecoder("utf-8-sig")(errors)


def _texts(source: Source, block: bytes, errors: str = "strict") -> Iterator[str]:
    """Yield a source as text, block by block, beginning with its first ``block``."""
    decoder = _decoder(errors)
    try:
        while block:
            yield decoder.decode(block)
            block = source.block()
        decoder.decode(b"", final=True)
    except UnicodeDecodeError:
        raise CalledWronglyError("the input begins as text but is not UTF-8 throughout") from None


def captures(source: Source, block: bytes) -> Iterator[Capture]:
    """Yield the entries of a list of captures, or of one JSON object per line.

    Lines are read one by one, so their number is not limited. A line, or a whole list, may have at most 64
    MiB.
    """
    for number, entry in enumerate(_entries(_lines(source, block)), 1):
        yield _capture(entry, number)


def _entries(lines: Iterator[tuple[int, str]]) -> Iterator[Any]:
    number, first = next(lines)
    try:
        value = _loaded(number, first)
    except ValueError as error:
        # The first line is not JSON, so all lines together are one value.
        yield from _list_of(_whole(first, lines, error))
        return
    is_list = isinstance(value, list) or _in_captures(value)
    yield from _list_of(value)
    for number, line in lines:
        if is_list:
            raise CalledWronglyError(f"line {number}: unexpected text after the end of the list")
        try:
            yield _loaded(number, line)
        except ValueError as error:
            raise CalledWronglyError(f"not JSON: line {number}: {error}") from None


def _list_of(value: Any) -> list[Any]:
    if _in_captures(value):
        value = value["captures"]
    return value if isinstance(value, list) else [value]


def _in_captures(value: Any) -> bool:
    return isinstance(value, dict) and isinstance(value.get("captures"), list)


def _loaded(number: int, text: str) -> Any:
    try:
        return json.loads(text)
    except RecursionError:
        raise CalledWronglyError(f"line {number}: nested too deeply") from None


def _whole(first: str, lines: Iterator[tuple[int, str]], error: ValueError) -> Any:
    parts, size = [first], len(first)
    for _, line in lines:
        parts.append(line)
        size += len(line)
        if size > _MAXIMUM_JSON:
            raise CalledWronglyError(
                f"the JSON list has over {_MAXIMUM_JSON // _MIB} MiB; give one object per line, hex text "
                f"or raw bytes (as one object per line it is invalid: {error})"
            )
    try:
        return _loaded(1, "\n".join(parts))
    except ValueError as wrong:
        raise CalledWronglyError(f"not JSON: {wrong}") from None


def _lines(source: Source, block: bytes) -> Iterator[tuple[int, str]]:
    """Yield the lines that are not blank, with their numbers."""
    number, parts, size = 1, [], 0
    while block:
        *ended, rest = block.split(b"\n")
        for piece in ended:
            parts.append(piece)
            yield from _line(number, b"".join(parts))
            number, parts, size = number + 1, [], 0
        parts.append(rest)
        size += len(rest)
        if size > _MAXIMUM_JSON:
            raise CalledWronglyError(
                f"line {number}: over {_MAXIMUM_JSON // _MIB} MiB of JSON in one line; give one object "
                "per line, hex text or raw bytes"
            )
        block = source.block()
    yield from _line(number, b"".join(parts))


def _line(number: int, raw: bytes) -> Iterator[tuple[int, str]]:
    try:
        text = raw.decode("utf-8-sig" if number == 1 else "utf-8")
    except UnicodeDecodeError as error:
        raise CalledWronglyError(f"line {number}: not UTF-8 text: byte {error.start}") from None
    if text.strip():
        yield number, text


def _capture(entry: Any, number: int) -> Capture:
    text = entry
    if isinstance(entry, dict):
        text = entry.get("hex", entry.get("printed"))
    if not isinstance(text, str):
        raise CalledWronglyError(f'entry {number} is neither hex text nor an object with "hex"')
    try:
        return f"entry {number}", parse_hex(text)
    except ValueError as error:
        raise CalledWronglyError(f"entry {number}: {error}") from None
