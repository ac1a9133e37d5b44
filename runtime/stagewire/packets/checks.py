"""Checks of packets: a sum, an exclusive or, and cyclic redundancy checks.

A receiver computes them again; a packet whose check is another was damaged on the way.
"""

from __future__ import annotations

from functools import cache, reduce
from operator import xor

from stagewire.frozen import Frozen

TYPE_CHECKING = False  # typing would take half of the time of an import
if TYPE_CHECKING:
    from typing import Any, Final

__all__ = ["Check", "Crc", "Sum", "Xor"]

_COMPLEMENTS: Final = ("none", "ones", "twos")
_LARGEST: Final = 8  # bytes; CRC-64 is the longest that is in use


class Check(Frozen):
    """Base of the checks: equal by what they were made with.

    ``size`` is how many bytes of a packet hold the result.
    """

    __slots__ = ("size",)
    size: int

    def of(self, data: bytes) -> int:
        """Return the check of ``data``, from 0 to what ``size`` bytes hold."""
        raise NotImplementedError

    def _set(self, **parts: object) -> None:
        for name, value in parts.items():
            object.__setattr__(self, name, value)

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), self._key()

    def __repr__(self) -> str:
        return f"{type(self).__name__}({', '.join(map(repr, self._key()))})"


class Sum(Check):
    """The sum of all bytes, without what goes beyond ``size`` bytes.

    :param size: bytes of the result.
    :param complement: ``none``; ``ones``: every bit turned; ``twos``: the negative, so that the
        bytes and their check add up to zero.

    Raises :class:`ValueError` for another size or complement.
    """

    __slots__ = ("complement",)
    complement: str

    def __new__(cls, size: int, complement: str = "none") -> Sum:
        """Make the check."""
        if complement not in _COMPLEMENTS:
            raise ValueError(f"a complement is one of {', '.join(_COMPLEMENTS)}, not {complement}")
        check = object.__new__(cls)
        check._set(size=_checked_size(size), complement=complement)
        return check

    def of(self, data: bytes) -> int:
        """Return the check of ``data``."""
        total = sum(data)
        if self.complement == "ones":
            total = ~total
        elif self.complement == "twos":
            total = -total
        return total & _mask(self.size)

    def _key(self) -> tuple[int, str]:
        return self.size, self.complement


class Xor(Check):
    """The exclusive or of all bytes, in one byte."""

    __slots__ = ()

    def __new__(cls) -> Xor:
        """Make the check."""
        check = object.__new__(cls)
        check._set(size=1)
        return check

    def of(self, data: bytes) -> int:
        """Return the check of ``data``."""
        return reduce(xor, data, 0)

    def _key(self) -> tuple[()]:
        return ()


class Crc(Check):
    """A cyclic redundancy check, in the terms of the Rocksoft model; its width is 8 bits a byte.

    :param size: bytes of the result.
    :param polynomial: without its highest term, the other high terms in the high bits.
    :param initial: the register before the first byte, in the same order of bits.
    :param reflected: whether bytes go in with their low bit first and the result comes out likewise.
    :param final: what the result is combined with by exclusive or at the end.

    Raises :class:`ValueError` for a number that does not fit the width.
    """

    __slots__ = ("final", "initial", "polynomial", "reflected")
    polynomial: int
    initial: int
    reflected: bool
    final: int

    def __new__(cls, size: int, polynomial: int, initial: int, reflected: bool, final: int) -> Crc:
        """Make the check."""
        most = _mask(_checked_size(size))
        numbers = {"polynomial": polynomial, "initial": initial, "final": final}
        for name, number in numbers.items():
            if not 0 <= number <= most:
                raise ValueError(f"{name} {number:#x} does not fit {8 * size} bits")
        check = object.__new__(cls)
        check._set(size=size, reflected=bool(reflected), **numbers)
        return check

    def of(self, data: bytes) -> int:
        """Return the check of ``data``."""
        table = _table(self.size, self.polynomial, self.reflected)
        if self.reflected:
            register = _reflected(self.initial, 8 * self.size)
            for byte in data:
                register = table[(register ^ byte) & 0xFF] ^ register >> 8
        else:
            register, high, most = self.initial, 8 * self.size - 8, _mask(self.size)
            for byte in data:
                register = (table[register >> high ^ byte] ^ register << 8) & most
        return register ^ self.final

    def _key(self) -> tuple[int, int, int, bool, int]:
        return self.size, self.polynomial, self.initial, self.reflected, self.final


@cache
def _table(size: int, polynomial: int, reflected: bool) -> tuple[int, ...]:
    """Return what each byte adds to the register; made when a first packet is read or sent."""
    width, most = 8 * size, _mask(size)
    turned = _reflected(polynomial, width)
    entries = []
    for byte in range(0x100):
        register = byte if reflected else byte << width - 8
        for _ in range(8):
            if reflected:
                register = register >> 1 ^ (turned if register & 1 else 0)
            else:
                register = (register << 1 ^ (polynomial if register >> width - 1 else 0)) & most
        entries.append(register)
    return tuple(entries)


def _reflected(number: int, width: int) -> int:
    return int(f"{number:0{width}b}"[::-1], 2)


def _mask(size: int) -> int:
    return (1 << 8 * size) - 1


def _checked_size(size: int) -> int:
    if not 1 <= size <= _LARGEST:
        raise ValueError(f"a check has 1 to {_LARGEST} bytes, not {size}")
    return size
