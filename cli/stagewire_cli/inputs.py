"""What ``stagewire decode`` reads: text of hex, a list of captures in JSON, or raw bytes; in blocks."""

from __future__ import annotations

import codecs
import json
import re
from collections.abc import Iterator
from typing import Any, BinaryIO

from stagewire_cli.errors import CalledWronglyError
from stagewire_cli.hextext import HexText, parse_hex

__all__ = ["Capture", "captures", "chunks", "is_json", "opening"]

BLOCK = 64 * 1024
_MAXIMUM_JSON = 64 * 1024 * 1024
_CONTROL = re.compile(rb"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f]")
_JSON = re.compile(r'\s*(?:\{|\[\s*(?:["{\[\]]|\Z))')

Capture = tuple[str, bytes]
"""What names an entry, and its bytes."""


def opening(stream: BinaryIO) -> tuple[bytes, str | None]:
    """Return the first block, and it as text; None when it is raw bytes.

    Frames hold zeros and ones, text does not: that is what tells them apart.
    """
    block = _block(stream)
    if _CONTROL.search(block):
        return block, None
    try:
        # the block may end inside a character
        return block, codecs.getincrementaldecoder("utf-8-sig")().decode(block)
    except UnicodeDecodeError:
        return block, None


def is_json(text: str | None) -> bool:
    """Whether text begins like a list of captures or like JSON lines."""
    return text is not None and _JSON.match(text) is not None


def chunks(stream: BinaryIO, block: bytes, text: str | None) -> Iterator[bytes]:
    """Yield the bytes that the stream says, beginning with its first ``block``."""
    if text is None:
        while block:
            yield block
            block = _block(stream)
        return
    decoder = codecs.getincrementaldecoder("utf-8-sig")()
    reader = HexText()
    try:
        while block:
            yield reader.feed(decoder.decode(block))
            block = _block(stream)
        decoder.decode(b"", final=True)
        yield reader.finish()
    except UnicodeDecodeError:
        raise CalledWronglyError("the input begins as text and goes on as something else") from None
    except ValueError as error:
        raise CalledWronglyError(str(error)) from None


def captures(stream: BinaryIO, block: bytes) -> Iterator[Capture]:
    """Yield the entries of a list of captures, or of one JSON object per line."""
    whole = block
    while more := _block(stream):
        whole += more
        if len(whole) > _MAXIMUM_JSON:
            limit = _MAXIMUM_JSON // 1024 // 1024
            raise CalledWronglyError(f"a JSON file of over {limit} MiB; give hex text or raw bytes")
    try:
        text = whole.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise CalledWronglyError(f"not UTF-8 text: byte {error.start}") from None
    for number, entry in enumerate(_entries(text), 1):
        yield _capture(entry, number)


def _entries(text: str) -> list[Any]:
    try:
        loaded = json.loads(text)
    except RecursionError:
        raise CalledWronglyError("the JSON is nested too deeply") from None
    except ValueError as error:
        return _lines(text, error)
    if isinstance(loaded, dict) and isinstance(loaded.get("captures"), list):
        loaded = loaded["captures"]
    return loaded if isinstance(loaded, list) else [loaded]


def _lines(text: str, first: ValueError) -> list[Any]:
    entries = []
    for number, line in enumerate(text.splitlines(), 1):
        if not line.strip():
            continue
        try:
            entries.append(json.loads(line))
        except RecursionError:
            raise CalledWronglyError(f"line {number}: nested too deeply") from None
        except ValueError as error:
            # neither one JSON text nor one a line: say what is nearer to the truth
            raise CalledWronglyError(f"not JSON: {first if number == 1 else error}") from None
    return entries


def _capture(entry: Any, number: int) -> Capture:
    text = entry
    if isinstance(entry, dict):
        text = entry.get("hex", entry.get("printed"))
    if not isinstance(text, str):
        raise CalledWronglyError(f'entry {number} is no hex text and has none under "hex"')
    try:
        return f"entry {number}", parse_hex(text)
    except ValueError as error:
        raise CalledWronglyError(f"entry {number}: {error}") from None


def _block(stream: BinaryIO) -> bytes:
    # read1 gives what is there: a live stream is shown as it comes
    reader = getattr(stream, "read1", stream.read)
    block: bytes = reader(BLOCK)
    return block
