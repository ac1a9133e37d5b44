"""Columns of frames that end with an array, each as long as its fields state.

The frames differ in length, so they are read one after another. The column of the array has a tuple of
integers for each frame.
"""

from __future__ import annotations

from array import array
from typing import Any

from stagewire._columns.shape import Field, Kind, Shape
from stagewire._framings.header.message import DATA_FLAG, HEADER_SIZE
from stagewire.errors import BadLengthError, DecodeError, TruncatedError

_LENGTH = slice(2, 4)  # of the packet, in a header
_CODES = {
    kind: {array(code).itemsize: code for code in codes}
    for kind, codes in ((Kind.UNSIGNED, "BHLIQ"), (Kind.SIGNED, "bhliq"))
}


def read_counted(shape: Shape, view: memoryview) -> dict[str, Any]:
    """Return the columns of frames with an array, back to back.

    The errors name the offset of the first invalid frame. Raises
    :class:`~stagewire.errors.TruncatedError`, :class:`~stagewire.errors.DecodeError` for another id, and
    :class:`~stagewire.errors.BadLengthError` for another form, or a length that the fields contradict.
    """
    dest, source = array("B"), array("B")
    found: dict[str, Any] = {"dest": dest, "source": source}
    found |= {field.name: _empty(field) for field in shape.fields}
    at = 0
    while at < len(view):
        frame = _frame_at(shape, view, at)
        at += len(frame)
        dest.append(frame[4] & ~DATA_FLAG)
        source.append(frame[5])
        for field in shape.fields:
            found[field.name].append(_value(shape, field, frame))
    return found


def _empty(field: Field) -> Any:
    codes = _CODES.get(field.kind)
    return [] if codes is None else array(codes[field.width])


def _frame_at(shape: Shape, view: memoryview, at: int) -> bytes:
    """Return the frame at an offset, or raise the error for it."""
    counted = shape.counted
    assert counted is not None
    where = f"byte {at}: expected a frame of {shape.name}"
    header = bytes(view[at : at + HEADER_SIZE])
    if len(header) < HEADER_SIZE:
        raise TruncatedError(f"{where}, but only {len(header)} bytes are left")
    if header[:2] != shape.head:
        wanted, came = (int.from_bytes(head[:2], "little") for head in (shape.head, header))
        raise DecodeError(f"{where} with id {wanted:#06x}, found id {came:#06x}")
    length = int.from_bytes(header[_LENGTH], "little")
    if not header[4] & DATA_FLAG or not counted.admits(length):
        raise BadLengthError(
            f"{where} with a packet of {counted.least} to {counted.most} bytes, found the header "
            f"{header.hex(' ')}"
        )
    frame = bytes(view[at : at + HEADER_SIZE + length])
    if len(frame) < HEADER_SIZE + length:
        raise TruncatedError(f"{where} with {length} bytes of data, but only {len(frame)} are left")
    if (stated := counted.length_in(frame)) != length:
        raise BadLengthError(
            f"{where}: it has {length} bytes of data, but its fields state {stated}"
        )
    return frame


def _value(shape: Shape, field: Field, frame: bytes) -> int | str | bytes | tuple[int, ...]:
    if field.kind is Kind.INTEGERS:
        assert shape.counted is not None
        return shape.counted.read(frame)
    raw = frame[field.offset : field.offset + field.size]
    if field.kind is Kind.TEXT:
        return raw.rstrip(b"\0").decode("latin-1")
    if field.kind is Kind.BYTES:
        return raw
    return int.from_bytes(raw, "little", signed=field.kind is Kind.SIGNED)
