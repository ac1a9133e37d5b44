"""Bytes on their way through the faults of a line."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

__all__ = ["Parcel", "bytes_of", "joined"]


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


def bytes_of(parcel: Parcel) -> list[Parcel]:
    """Return every byte of a parcel by itself."""
    data = parcel.data
    return [replace(parcel, data=data[at : at + 1]) for at in range(len(data))]


def joined(parts: Iterable[Parcel]) -> list[Parcel]:
    """Return parts of one parcel with those joined that still travel together; the first one is the frame."""
    runs: list[tuple[Parcel, bytearray]] = []
    for part in parts:
        if runs and _travel_together(runs[-1][0], part):
            runs[-1][1].extend(part.data)
            runs[-1] = (replace(part, is_frame=runs[-1][0].is_frame), runs[-1][1])
        else:
            runs.append((replace(part, is_frame=part.is_frame and not runs), bytearray(part.data)))
    return [replace(part, data=bytes(data)) for part, data in runs]


def _travel_together(one: Parcel, next: Parcel) -> bool:
    return (one.delay, one.overtaken, one.cut) == (next.delay, next.overtaken, next.cut)
