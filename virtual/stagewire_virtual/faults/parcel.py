"""Bytes on their way through the faults of a line."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Final

__all__ = ["MOST_HELD", "Parcel", "bytes_of", "joined"]

MOST_HELD: Final = 1 << 16
"""Bytes that one direction holds back; what comes beyond that is lost."""


@dataclass(frozen=True, slots=True)
class Parcel:
    """Bytes that travel together.

    :param data: the bytes.
    :param is_frame: whether they were sent as one whole frame; it stays one when bytes in it are damaged.
    :param message: name of its message, where somebody asks for it.
    :param delay: nanoseconds by which it is late.
    :param overtaken: whether what follows may be there before it.
    :param cut: of a parcel without bytes: it cuts the line.
    """

    data: bytes
    is_frame: bool = False
    message: str | None = None
    delay: int = 0
    overtaken: bool = False
    cut: bool = False


def bytes_of(parcel: Parcel) -> Iterator[Parcel]:
    """Yield every byte of a parcel by itself."""
    data = parcel.data
    for at in range(len(data)):
        yield replace(parcel, data=data[at : at + 1])


def joined(parts: Iterable[Parcel]) -> Iterator[Parcel]:
    """Yield parts of one parcel, those joined that still travel together; the first one is the frame."""
    run: Parcel | None = None
    data = bytearray()
    for part in parts:
        if run is not None and _travel_together(run, part) and len(data) < MOST_HELD:
            data += part.data
            continue
        if run is not None:
            yield replace(run, data=bytes(data))
            part = replace(part, is_frame=False)
        run, data = part, bytearray(part.data)
    if run is not None:
        yield replace(run, data=bytes(data))


def _travel_together(one: Parcel, next: Parcel) -> bool:
    return (one.delay, one.overtaken, one.cut) == (next.delay, next.overtaken, next.cut)
