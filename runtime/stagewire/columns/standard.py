"""Columns with the standard library: a slice with a step takes one byte of every frame at once."""

from __future__ import annotations

import sys
from array import array
from typing import Any, Final, TypeAlias

from stagewire.columns.shape import Kind, Place, Shape
from stagewire.header import DATA_FLAG

__all__ = ["Column", "read"]

Column: TypeAlias = "array[int] | list[str] | list[bytes]"
"""Integers, text or byte strings, one for every frame."""

_BLOCK: Final = 8192
"""Frames that are read at once: few enough for what is copied on the way to stay small."""

_FLAGGED: Final = bytes(range(DATA_FLAG, 256))
_ADDRESSES: Final = bytes(byte & ~DATA_FLAG & 0xFF for byte in range(256))
_SIGNS: Final = bytes(0xFF if byte & 0x80 else 0 for byte in range(256))
_CODES: Final = {
    kind: {array(code).itemsize: code for code in codes}
    for kind, codes in ((Kind.UNSIGNED, "BHLIQ"), (Kind.SIGNED, "bhliq"))
}


def read(shape: Shape, view: memoryview) -> tuple[dict[str, Column], int | None]:
    """Return the columns, and the offset of the first wrong frame (then they end before its block)."""
    dest, source = array("B"), array("B")
    columns: dict[str, Column] = {"dest": dest, "source": source}
    columns |= {place.name: _empty(place) for place in shape.places}
    size = shape.size
    whole = len(view) - len(view) % size
    for start in range(0, whole, _BLOCK * size):
        block = bytes(view[start : min(start + _BLOCK * size, whole)])
        if not _right(shape, block):
            return columns, start + _wrong_frame(shape, block)
        dest.frombytes(block[4::size].translate(_ADDRESSES))
        source.frombytes(block[5::size])
        for place in shape.places:
            _extend(columns[place.name], block, place, size)
    if sys.byteorder == "big":
        for column in columns.values():
            if isinstance(column, array):
                column.byteswap()
    return columns, whole if whole < len(view) else None


def _wrong_frame(shape: Shape, block: bytes) -> int:
    """Return the offset of the first frame that is wrong."""
    starts = range(0, len(block), shape.size)
    wrong = (at for at in starts if not _right(shape, block[at : at + shape.size]))
    return next(wrong)


def _right(shape: Shape, block: bytes) -> bool:
    """Whether every frame of a block has the id, the length and the form of this shape."""
    size = shape.size
    destinations = block[4::size]
    # Without the bytes that announce a packet none may be left, or all of them (ASCII is below).
    right = (
        not destinations.translate(None, _FLAGGED) if shape.has_packet else destinations.isascii()
    )
    frames = len(destinations)
    return right and all(
        block[at::size].count(byte) == frames for at, byte in enumerate(shape.head)
    )


def _empty(place: Place) -> Column:
    codes = _CODES.get(place.kind)
    return [] if codes is None else array(codes[place.width])


def _extend(column: Any, block: bytes, place: Place, step: int) -> None:
    """Add the values of one field in a block of frames."""
    if isinstance(column, array):
        column.frombytes(_integers(block, place, step))
        return
    starts = range(place.offset, len(block), step)
    values = [block[start : start + place.size] for start in starts]
    if place.kind is Kind.TEXT:
        column += [value.rstrip(b"\0").decode("latin-1") for value in values]
    else:
        column += values


def _integers(block: bytes, place: Place, step: int) -> bytes | bytearray:
    """Return one field of all frames as machine integers, low byte first."""
    offset, size, width = place.offset, place.size, place.width
    if width == 1:
        return block[offset::step]
    wide = bytearray(len(block) // step * width)
    for byte in range(size):
        wide[byte::width] = block[offset + byte :: step]
    if place.kind is Kind.SIGNED and size < width:
        signs = block[offset + size - 1 :: step].translate(_SIGNS)
        for byte in range(size, width):
            wide[byte::width] = signs
    return wide
