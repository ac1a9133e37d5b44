"""Frames of one layout, back to back, to columns."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, NoReturn, TypeAlias

from stagewire.columns import standard
from stagewire.columns.shape import Shape, shape_of
from stagewire.columns.standard import Column
from stagewire.errors import (
    BadLengthError,
    BadValueError,
    DecodeError,
    TruncatedError,
    UnsupportedError,
)
from stagewire.message import Message

if TYPE_CHECKING:
    from mmap import mmap

    from numpy.typing import NDArray

__all__ = ["Buffer", "Column", "bytes_of", "columns", "numpy_columns", "read", "read_numpy"]

Buffer: TypeAlias = "bytes | bytearray | memoryview | mmap"


def columns(message: type[Message], raw: Buffer) -> dict[str, Column]:
    """Return the columns of frames of one message class, with the standard library alone.

    ``raw`` holds whole frames and nothing else: bytes, bytearray, memoryview, mmap. Integers come
    as :class:`array.array`; text (trailing NULs stripped) and byte strings as lists.

    Raises an error that names the offset of the first frame that is wrong:
    :class:`~stagewire.errors.DecodeError` for another id, :class:`~stagewire.errors.BadLengthError`
    for another length or form, :class:`~stagewire.errors.TruncatedError` for a part of a frame at
    the end. Raises :class:`~stagewire.errors.BadValueError` for what is not bytes or no message
    class, and :class:`~stagewire.errors.UnsupportedError` for a message without a layout.
    """
    return read(shape_of(message), raw)


def numpy_columns(message: type[Message], raw: Buffer) -> dict[str, NDArray[Any]]:
    """Return the columns of frames of one message class as NumPy arrays of their own.

    Integers in the byte order of the machine, text as ``U``, byte strings as ``V`` (``S`` would lose
    zeros at their ends). Raises as :func:`columns` does, and
    :class:`~stagewire.errors.UnsupportedError` where NumPy is not installed.
    """
    return read_numpy(shape_of(message), raw)


def read(shape: Shape, raw: Buffer) -> dict[str, Column]:
    """Do the work of :func:`columns` for any shape of frames."""
    with bytes_of(raw) as view:
        found, wrong = standard.read(shape, view)
        if wrong is not None:
            _refuse(shape, view, wrong)
    return found


def read_numpy(shape: Shape, raw: Buffer) -> dict[str, NDArray[Any]]:
    """Do the work of :func:`numpy_columns` for any shape of frames."""
    try:
        from stagewire.columns.vectors import read as read_vectors
    except ImportError:
        raise UnsupportedError(
            "NumPy is not installed: pip install 'stagewire[numpy]', or use columns()"
        ) from None
    with bytes_of(raw) as view:
        found, wrong = read_vectors(shape, view)
        if wrong is not None:
            _refuse(shape, view, wrong)
    return found


@contextmanager
def bytes_of(raw: Buffer) -> Iterator[memoryview]:
    """Give a view of single bytes, which is let go when the block ends.

    Raises :class:`~stagewire.errors.BadValueError` for what does not hold bytes in one piece.
    """
    try:
        view = memoryview(raw)
    except (TypeError, ValueError):  # a mapping that is closed raises ValueError
        raise BadValueError(f"columns are read from bytes, not {type(raw).__name__}") from None
    with view:
        if not view.c_contiguous:
            raise BadValueError(
                "columns are read from bytes that stand back to back, without steps"
            )
        with view.cast("B") as plain:
            yield plain


def _refuse(shape: Shape, view: memoryview, offset: int) -> NoReturn:
    """Say what is wrong with the frame at ``offset``."""
    start = bytes(view[offset : offset + 6])
    where = f"byte {offset}: a frame of {shape.name} was expected"
    if len(view) - offset < shape.size and start[: len(shape.head)] == shape.head[: len(start)]:
        raise TruncatedError(
            f"{where}, of {shape.size} bytes; {len(view) - offset} are left, so this is no whole "
            "number of frames"
        )
    if start[:2] != shape.head[:2]:
        wanted, came = (int.from_bytes(head[:2], "little") for head in (shape.head, start))
        raise DecodeError(f"{where} (id {wanted:#06x}), here is id {came:#06x}")
    wanted_form = f"a packet of {shape.size - 6} bytes" if shape.has_packet else "no packet"
    raise BadLengthError(f"{where}, with {wanted_form}; its header is {start.hex(' ')}")
