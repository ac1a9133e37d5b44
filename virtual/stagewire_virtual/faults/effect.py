"""A fault at work: which pieces its rule chooses, and what becomes of them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from itertools import repeat
from random import Random
from typing import Final

from stagewire_virtual.clock import nanoseconds
from stagewire_virtual.faults.fault import Fault
from stagewire_virtual.faults.keys import Action, Piece
from stagewire_virtual.faults.parcel import Parcel, bytes_of, joined

__all__ = ["Effect"]

_SHOWN: Final = 16  # bytes of a piece in a report


class Effect:
    """What one fault does among those of a direction.

    :param fault: what goes wrong.
    :param chance: its own stream of chance.
    :param report: told which piece was hit.
    :param flood: begins the flood, of a fault that is one.
    """

    def __init__(
        self,
        fault: Fault,
        chance: Random,
        report: Callable[[Fault, str], None],
        flood: Callable[[], None],
    ) -> None:
        self._fault = fault
        self._chance = chance
        self._report = report
        self._flood = flood
        self._count = 0

    def apply(self, parcel: Parcel) -> Iterable[Parcel]:
        """Return what becomes of a parcel, made as it is asked for: a fault may make very much of it."""
        if not parcel.data or self._fault.message not in (None, parcel.message):
            return [parcel]
        if self._fault.piece is Piece.FRAME:
            return self._passed(parcel) if parcel.is_frame else [parcel]
        return joined(self._bytes_passed(parcel))

    def _bytes_passed(self, parcel: Parcel) -> Iterator[Parcel]:
        """Yield what becomes of the bytes of a parcel; nothing follows the end of the line."""
        for byte in bytes_of(parcel):
            for part in self._passed(byte):
                yield part
                if part.cut:
                    return

    def _passed(self, piece: Parcel) -> Iterable[Parcel]:
        """Return what becomes of one piece."""
        self._count += 1
        if not self._hits():
            return [piece]
        fault = self._fault
        shown = piece.data[:_SHOWN].hex(" ") + (" …" if len(piece.data) > _SHOWN else "")
        assert fault.piece is not None  # only what has no direction has no pieces
        self._report(fault, f"{fault.piece.value} {self._count}: {shown}")
        if fault.action is Action.FLOOD:
            self._flood()
        return _BECOMES[fault.action](piece, fault, self._chance)

    def _hits(self) -> bool:
        """Say whether the rule chooses the piece that was just counted."""
        fault = self._fault
        if fault.at is not None:
            return self._count == fault.at
        if fault.p is not None:
            return self._chance.random() < fault.p
        return self._count % (fault.every or 1) == 0


def _drop(piece: Parcel, fault: Fault, chance: Random) -> list[Parcel]:
    return []


def _insert(piece: Parcel, fault: Fault, chance: Random) -> list[Parcel]:
    data = chance.randbytes(1) if fault.data is None else fault.data
    return [replace(piece, data=data), piece]


def _flip(piece: Parcel, fault: Fault, chance: Random) -> list[Parcel]:
    bits = 8 * len(piece.data)
    bit = chance.randrange(bits) if fault.bit is None else fault.bit % bits
    data = bytearray(piece.data)
    data[bit // 8] ^= 1 << bit % 8
    return [replace(piece, data=bytes(data))]


def _delay(piece: Parcel, fault: Fault, chance: Random) -> list[Parcel]:
    late = piece.delay + nanoseconds(fault.by or 0)
    return [replace(piece, delay=late, overtaken=piece.overtaken or bool(fault.overtaken))]


def _duplicate(piece: Parcel, fault: Fault, chance: Random) -> Iterable[Parcel]:
    return repeat(piece, 1 + (fault.count or 1))


def _flood(piece: Parcel, fault: Fault, chance: Random) -> list[Parcel]:
    return [piece]  # the flood comes behind it


def _disconnect(piece: Parcel, fault: Fault, chance: Random) -> list[Parcel]:
    """Cut the line behind a byte, but in the midst of a frame."""
    half = len(piece.data) // 2
    data = piece.data if fault.piece is Piece.BYTE else piece.data[:half]
    return [replace(piece, data=data), replace(piece, data=b"", is_frame=False, cut=True)]


_BECOMES: Final[Mapping[Action, Callable[[Parcel, Fault, Random], Iterable[Parcel]]]] = {
    Action.DROP: _drop,
    Action.INSERT: _insert,
    Action.FLIP: _flip,
    Action.DELAY: _delay,
    Action.DUPLICATE: _duplicate,
    Action.FLOOD: _flood,
    Action.DISCONNECT: _disconnect,
}
"""What becomes of a piece that is hit."""
