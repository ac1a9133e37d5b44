"""Columns with NumPy: a structured view of the frames, and one copy of each field.

Importing this module requires NumPy. :mod:`stagewire._columns.arrays` imports it on use.
"""

from __future__ import annotations

from typing import Any, Final

import numpy
from numpy.typing import NDArray

from stagewire._columns.shape import Field, Kind, Shape
from stagewire._framings.header.message import DATA_FLAG

Column = NDArray[Any]

_INTEGERS: Final = {Kind.UNSIGNED: "u", Kind.SIGNED: "i"}


def read(shape: Shape, view: memoryview) -> tuple[dict[str, Column], int | None]:
    """Return the columns, and the offset of the first invalid frame; the columns are then empty."""
    frames, rest = divmod(len(view), shape.size)
    end = len(view) - rest

    def field(offset: int, format: str) -> Column:
        """Return a view of the bytes at ``offset`` of all frames."""
        dtype = numpy.dtype(
            {"names": ["it"], "formats": [format], "offsets": [offset], "itemsize": shape.size}
        )
        return numpy.ndarray((frames,), dtype, view)["it"]

    head = int.from_bytes(shape.head, "little")
    wrong = field(0, f"<u{len(shape.head)}") != head
    dest = field(4, "u1").copy()
    wrong |= (dest < DATA_FLAG) if shape.has_packet else (dest >= DATA_FLAG)
    if shape.sub_message:
        wanted = int.from_bytes(shape.sub_message, "little")
        wrong |= field(shape.sub_message_at, f"<u{len(shape.sub_message)}") != wanted
    if wrong.any():
        return {}, int(wrong.argmax()) * shape.size
    dest &= DATA_FLAG - 1
    columns = {"dest": dest, "source": field(5, "u1").copy()}
    for place in shape.fields:
        columns[place.name] = _copy(field(place.offset, _format(place)), place)
    return columns, end if rest else None


def from_columns(shape: Shape, columns: dict[str, Any]) -> dict[str, Column]:
    """Return columns of the standard library as arrays; tuples stay objects."""
    made: dict[str, Column] = {}
    for place in (None, None, *shape.fields):
        name = place.name if place else ("dest", "source")[len(made)]
        values = columns[name]
        if place is None or place.kind in _INTEGERS:
            made[name] = numpy.array(values)
        elif place.kind is Kind.INTEGERS:
            made[name] = numpy.fromiter(values, dtype=object, count=len(values))
        else:
            format = "U" if place.kind is Kind.TEXT else "V"
            made[name] = numpy.array(values, dtype=f"{format}{place.size}")
    return made


def _format(place: Field) -> str:
    """Return the format of one field in a frame; single bytes for a field that NumPy has no type for."""
    if place.kind in _INTEGERS and place.size == place.width:
        return f"<{_INTEGERS[place.kind]}{place.size}"
    return f"V{place.size}" if place.kind is Kind.BYTES else f"({place.size},)u1"


def _copy(seen: Column, place: Field) -> Column:
    """Return the values of one field as an array that owns its data, in native byte order."""
    if place.kind is Kind.BYTES:
        return seen.copy()
    if place.kind is Kind.TEXT:
        # Latin-1 is the first 256 code points, and U strips trailing NULs as decoding does.
        return seen.astype("=u4", order="C").view(f"=U{place.size}").reshape(len(seen))
    native = f"={_INTEGERS[place.kind]}{place.width}"
    if place.size == place.width:
        return seen.astype(native)
    wide = numpy.zeros((len(seen), place.width), "u1")
    wide[:, : place.size] = seen
    if place.kind is Kind.SIGNED:
        wide[:, place.size :] = numpy.where(seen[:, -1:] & 0x80, 0xFF, 0)
    return wide.view(f"<{native[1:]}").reshape(len(seen)).astype(native)
