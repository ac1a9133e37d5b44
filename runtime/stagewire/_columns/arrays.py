"""Columns of back-to-back frames of one layout, with the standard library or NumPy.

With the standard library, a slice with a step reads the same byte of all frames in one operation.
"""

from __future__ import annotations

import sys
from array import array
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import chain
from typing import TYPE_CHECKING, Any, Final, NoReturn, TypeAlias

from stagewire._codec.message import Message
from stagewire._columns.counted import read_counted
from stagewire._columns.shape import Field, Kind, Shape, shape_of
from stagewire._framings.header.message import DATA_FLAG
from stagewire.errors import (
    BadLengthError,
    BadValueError,
    DecodeError,
    TruncatedError,
    UnsupportedError,
)

if TYPE_CHECKING:
    from mmap import mmap

    from numpy.typing import NDArray

Buffer: TypeAlias = "bytes | bytearray | memoryview | mmap"
Column: TypeAlias = "array[int] | list[str] | list[bytes] | list[tuple[int, ...]]"
"""Integers, text, byte strings or arrays of integers, one per frame."""

_BLOCK: Final = 8192
"""Frames that are read together; few enough to keep temporary copies small."""

_FLAGGED: Final = bytes(range(DATA_FLAG, 256))
_ADDRESSES: Final = bytes(byte & ~DATA_FLAG & 0xFF for byte in range(256))
_SIGNS: Final = bytes(0xFF if byte & 0x80 else 0 for byte in range(256))
_CODES: Final = {
    kind: {array(code).itemsize: code for code in codes}
    for kind, codes in ((Kind.UNSIGNED, "BHLIQ"), (Kind.SIGNED, "bhliq"))
}


def _read_standard(shape: Shape, view: memoryview) -> tuple[dict[str, Column], int | None]:
    """Return the columns, and the offset of the first invalid frame; columns then end before its block."""
    dest, source = array("B"), array("B")
    columns: dict[str, Column] = {"dest": dest, "source": source}
    columns |= {place.name: _empty(place) for place in shape.fields}
    size = shape.size
    whole = len(view) - len(view) % size
    for start in range(0, whole, _BLOCK * size):
        block = bytes(view[start : min(start + _BLOCK * size, whole)])
        if not _right(shape, block):
            return columns, start + _wrong_frame(shape, block)
        dest.frombytes(block[4::size].translate(_ADDRESSES))
        source.frombytes(block[5::size])
        for place in shape.fields:
            _extend(columns[place.name], block, place, size)
    if sys.byteorder == "big":
        for column in columns.values():
            if isinstance(column, array):
                column.byteswap()
    return columns, whole if whole < len(view) else None


def _wrong_frame(shape: Shape, block: bytes) -> int:
    """Return the offset of the first invalid frame."""
    starts = range(0, len(block), shape.size)
    wrong = (at for at in starts if not _right(shape, block[at : at + shape.size]))
    return next(wrong)


def _right(shape: Shape, block: bytes) -> bool:
    """Whether all frames of a block have the id, length, form and sub-message of this shape."""
    size = shape.size
    destinations = block[4::size]
    # Without the bytes that announce a packet, none may be left, or all must be (ASCII is < 0x80).
    right = (
        not destinations.translate(None, _FLAGGED) if shape.has_packet else destinations.isascii()
    )
    frames = len(destinations)
    fixed = chain(enumerate(shape.head), enumerate(shape.sub_message, shape.sub_message_at))
    return right and all(block[at::size].count(byte) == frames for at, byte in fixed)


def _empty(place: Field) -> Column:
    codes = _CODES.get(place.kind)
    return [] if codes is None else array(codes[place.width])


def _extend(column: Any, block: bytes, place: Field, step: int) -> None:
    """Append the values of one field in a block of frames."""
    if isinstance(column, array):
        column.frombytes(_integers(block, place, step))
        return
    starts = range(place.offset, len(block), step)
    values = [block[start : start + place.size] for start in starts]
    if place.kind is Kind.TEXT:
        column += [value.rstrip(b"\0").decode("latin-1") for value in values]
    else:
        column += values


def _integers(block: bytes, place: Field, step: int) -> bytes | bytearray:
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


def columns(message: type[Message], raw: Buffer) -> dict[str, Column]:
    """Return the columns of frames of one message class; needs only the standard library.

    ``raw`` is a bytes, bytearray, memoryview or mmap that holds whole frames and nothing else. Integers are
    returned as :class:`array.array`; text (trailing NULs stripped), byte strings and arrays (tuples of
    integers) as lists.

    The errors name the offset of the first invalid frame. Raises :class:`~stagewire.errors.DecodeError` for
    another id, :class:`~stagewire.errors.BadLengthError` for another length or form, and
    :class:`~stagewire.errors.TruncatedError` if ``raw`` ends inside a frame. Raises
    :class:`~stagewire.errors.BadValueError` if ``raw`` is not bytes or ``message`` is not a message class,
    and :class:`~stagewire.errors.UnsupportedError` for a message without a layout.
    """
    return read(shape_of(message), raw)


def numpy_columns(message: type[Message], raw: Buffer) -> dict[str, NDArray[Any]]:
    """Return the columns of frames of one message class as NumPy arrays that own their data.

    Integers are in native byte order, text is ``U`` and byte strings are ``V`` (``S`` would lose trailing
    zeros). Arrays whose length varies are ``O``, tuples of integers. Raises the errors of :func:`columns`,
    and :class:`~stagewire.errors.UnsupportedError` if NumPy is not installed.
    """
    return read_numpy(shape_of(message), raw)


def read(shape: Shape, raw: Buffer) -> dict[str, Column]:
    """Implement :func:`columns` for any shape of frames."""
    with bytes_of(raw) as view:
        if shape.counted is not None:
            return read_counted(shape, view)
        found, wrong = _read_standard(shape, view)
        if wrong is not None:
            _refuse(shape, view, wrong)
    return found


def read_numpy(shape: Shape, raw: Buffer) -> dict[str, NDArray[Any]]:
    """Implement :func:`numpy_columns` for any shape of frames."""
    try:
        from stagewire._columns.vectors import from_columns
        from stagewire._columns.vectors import read as read_vectors
    except ImportError:
        raise UnsupportedError(
            "NumPy is not installed: run pip install 'stagewire[numpy]', or use columns()"
        ) from None
    with bytes_of(raw) as view:
        if shape.counted is not None:
            return from_columns(shape, read_counted(shape, view))
        found, wrong = read_vectors(shape, view)
        if wrong is not None:
            _refuse(shape, view, wrong)
    return found


@contextmanager
def bytes_of(raw: Buffer) -> Iterator[memoryview]:
    """Return a view of single bytes, released when the block ends.

    Raises :class:`~stagewire.errors.BadValueError` unless ``raw`` holds contiguous bytes.
    """
    try:
        view = memoryview(raw)
    except (TypeError, ValueError):  # a closed mmap raises ValueError
        raise BadValueError(f"columns are made from bytes, not {type(raw).__name__}") from None
    with view:
        if not view.c_contiguous:
            raise BadValueError(
                "columns are made from contiguous bytes, not from a view with steps"
            )
        with view.cast("B") as plain:
            yield plain


def _refuse(shape: Shape, view: memoryview, offset: int) -> NoReturn:
    """Raise the error for the frame at ``offset``."""
    start = bytes(view[offset : offset + 6])
    where = f"byte {offset}: expected a frame of {shape.name}"
    if len(view) - offset < shape.size and start[: len(shape.head)] == shape.head[: len(start)]:
        raise TruncatedError(
            f"{where} with {shape.size} bytes, but only {len(view) - offset} are left; "
            "the data is not a whole number of frames"
        )
    if start[:2] != shape.head[:2]:
        wanted, came = (int.from_bytes(head[:2], "little") for head in (shape.head, start))
        raise DecodeError(f"{where} with id {wanted:#06x}, found id {came:#06x}")
    form_and_length = start[: len(shape.head)] == shape.head
    if form_and_length and bool(start[4] & DATA_FLAG) == shape.has_packet:
        wanted, came = (
            int.from_bytes(part, "little")
            for part in (
                shape.sub_message,
                view[offset + shape.sub_message_at :][: len(shape.sub_message)],
            )
        )
        raise DecodeError(f"{where} with the sub-message {wanted}, found {came}")
    wanted_form = (
        f"with a packet of {shape.size - 6} bytes" if shape.has_packet else "without packet"
    )
    raise BadLengthError(f"{where} {wanted_form}, found the header {start.hex(' ')}")
