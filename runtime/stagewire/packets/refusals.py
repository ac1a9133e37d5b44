"""Why bytes are not exactly one packet: part by part, the first one that is wrong."""

from __future__ import annotations

from stagewire.errors import (
    BadLengthError,
    DamagedError,
    DecodeError,
    TrailingBytesError,
    TruncatedError,
)
from stagewire.packets.shape import Shape

__all__ = ["named", "refusal"]


def refusal(shape: Shape, raw: bytes) -> DecodeError:
    """Return what is wrong with bytes that are not exactly one packet of this shape."""
    size = len(raw)
    for at, (came, wanted) in enumerate(zip(raw, shape.start, strict=False)):
        if came != wanted:
            text = f"a packet begins with {_hex(shape.start)}; byte {at} is {came:02X}"
            return DamagedError(text, range(at, at + 1))
    if size < shape.least:
        text = f"a packet has at least {shape.least} bytes, here are {size}"
        return TruncatedError(text, range(size, size + 1))
    declared, place = shape.declared(raw), shape.place("length", 0)
    payload = declared - shape.counted
    says = f"{named(place)} give{'s' if len(place) == 1 else ''} the length {declared}"
    if payload < 0:
        text = f"{says}, but {_and(shape.counts)} have at least {shape.counted} bytes"
        return BadLengthError(text, place)
    if payload > shape.maximum:
        text = f"{says}, a payload of {payload} bytes; none has more than {shape.maximum}"
        return BadLengthError(text, place)
    end = shape.least + payload
    if size < end:
        text = f"{says}, so that the packet has {end} bytes; it ends before byte {size}"
        return TruncatedError(text, place)
    if size > end:
        more = f"{size - end} byte{'s' if size > end + 1 else ''} more"
        text = f"{says}, so that the packet ends before byte {end}; {more}"
        return TrailingBytesError(text, range(end, size))
    return _damage(shape, raw, payload)


def _damage(shape: Shape, raw: bytes, payload: int) -> DecodeError:
    """Return what is wrong with the end or the check of bytes that are as long as they say."""
    if not raw.endswith(shape.end):
        place = shape.place("end", payload)
        came = raw[place.start : place.stop]
        text = f"a packet ends with {_hex(shape.end)}; {_are(place)} {_hex(came)}"
        return DamagedError(text, place)
    place = shape.place("check", payload)
    wanted = shape.check_of(raw).to_bytes(len(place), "little")
    came = raw[place.start : place.stop]
    text = (
        f"{_are(place)} {_hex(came)}, the check of {_and(shape.covers)}; "
        f"of the bytes that came it is {_hex(wanted)}"
    )
    return DamagedError(text, place)


def named(place: range) -> str:
    """Return how bytes are named: ``byte 2``, ``bytes 2 and 3``, ``bytes 2 to 5``."""
    if len(place) == 1:
        return f"byte {place.start}"
    return f"bytes {place.start} {'and' if len(place) == 2 else 'to'} {place.stop - 1}"


def _are(place: range) -> str:
    return f"{named(place)} {'is' if len(place) == 1 else 'are'}"


def _and(parts: tuple[str, ...]) -> str:
    return " and ".join([", ".join(parts[:-1]), parts[-1]]) if len(parts) > 1 else parts[0]


def _hex(raw: bytes) -> str:
    return raw.hex(" ").upper()
