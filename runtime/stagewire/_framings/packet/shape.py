"""The shape of packets: their parts, the order of the parts, what the length counts, and the check.

A check is a sum, an exclusive or, or a cyclic redundancy check. The receiver computes it again. If the result
differs, the packet was damaged.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache, reduce
from operator import xor

from stagewire._codec.events import Frozen

TYPE_CHECKING = False  # importing typing would double the import time
if TYPE_CHECKING:
    from typing import Any, Final


_COMPLEMENTS: Final = ("none", "ones", "twos")
_LARGEST: Final = 8  # bytes; the longest check in use is CRC-64


class Check(Frozen):
    """Base of the checks. Checks with the same parameters are equal.

    ``size`` is the size of the result in bytes.
    """

    __slots__ = ("size",)
    size: int

    def of(self, data: bytes) -> int:
        """Return the check of ``data``, a number of ``size`` bytes."""
        raise NotImplementedError

    def _set(self, **parts: object) -> None:
        for name, value in parts.items():
            object.__setattr__(self, name, value)

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), self._key()

    def __repr__(self) -> str:
        return f"{type(self).__name__}({', '.join(map(repr, self._key()))})"


class Sum(Check):
    """The sum of all bytes, cut to ``size`` bytes.

    :param size: bytes of the result.
    :param complement: ``none``; ``ones``: all bits inverted; ``twos``: the negative, so that the bytes and
        their check add up to zero.

    Raises :class:`ValueError` for an invalid size or complement.
    """

    __slots__ = ("complement",)
    complement: str

    def __new__(cls, size: int, complement: str = "none") -> Sum:
        """Make the check."""
        if complement not in _COMPLEMENTS:
            raise ValueError(
                f"complement must be one of {', '.join(_COMPLEMENTS)}, not {complement}"
            )
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
    """The exclusive or of all bytes; one byte."""

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
    """A cyclic redundancy check, in the terms of the Rocksoft model; its width is 8 bits per byte.

    :param size: bytes of the result.
    :param polynomial: the polynomial without its highest term, higher terms in higher bits.
    :param initial: the register before the first byte, in the same order of bits.
    :param reflected: whether bytes are processed low bit first and the result is reflected.
    :param final: the value that the result is combined with by exclusive or.

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
    """Return the change of the register for each byte; computed when the first packet is read or sent."""
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


PARTS: Final = ("start", "length", "address", "id", "payload", "check", "end")
"""The possible parts of a packet."""

_NUMBER: Final = 4  # bytes of the longest length, id or address


class Shape(Frozen):
    """The shape of the packets of one protocol; immutable.

    Numbers are sent low byte first. Payload bytes are not escaped.

    :param order: the parts in the order sent; the start comes first, the end (if any) last.
    :param start: the bytes that every packet begins with.
    :param length: bytes of the length.
    :param counts: the parts whose bytes the length counts; the payload is among them.
    :param id: bytes of the message id.
    :param maximum: bytes of the longest payload.
    :param address: bytes of the controller's address; 0 if packets have none.
    :param check: how the check is computed; None if packets have none.
    :param covers: the parts that the check covers, in the order sent.
    :param end: the bytes that every packet ends with; empty if there are none.

    Raises :class:`ValueError` for a shape that no packet can have or no receiver can read.
    """

    __slots__ = (
        "_covered", "_offsets", "address", "check", "counted", "counts", "covers", "end", "head",
        "id", "least", "length", "maximum", "order", "sizes", "start", "tail",
    )  # fmt: skip
    order: tuple[str, ...]
    start: bytes
    length: int
    counts: tuple[str, ...]
    id: int
    maximum: int
    address: int
    check: Check | None
    covers: tuple[str, ...]
    end: bytes
    sizes: dict[str, int]
    """Part -> its bytes; 0 for the payload."""
    head: int
    """Bytes up to the end of the length: the part that contains the length of the packet."""
    tail: int
    """Bytes after the payload."""
    least: int
    """Bytes of a packet without payload."""
    counted: int
    """The length in a packet without payload."""
    _offsets: dict[str, int]  # of each part in a packet without payload
    _covered: tuple[slice, ...]

    def __new__(
        cls,
        order: Iterable[str],
        start: bytes,
        length: int,
        counts: Iterable[str],
        id: int,
        maximum: int,
        address: int = 0,
        check: Check | None = None,
        covers: Iterable[str] = (),
        end: bytes = b"",
    ) -> Shape:
        """Make the shape."""
        order, counts, covers = tuple(order), tuple(counts), tuple(covers)
        sizes = {
            "start": len(start), "length": length, "address": address, "id": id, "payload": 0,
            "check": check.size if check else 0, "end": len(end),
        }  # fmt: skip
        _check_order(order, sizes)
        _check_counting(order, counts, maximum, sizes)
        _check_cover(order, covers, check)
        offsets, position = {}, 0
        for part in order:
            offsets[part] = position
            position += sizes[part]
        shape = object.__new__(cls)
        parts: dict[str, object] = {
            "order": order, "start": bytes(start), "length": length, "counts": counts, "id": id,
            "maximum": maximum, "address": address, "check": check, "covers": covers,
            "end": bytes(end), "sizes": sizes, "head": offsets["length"] + length,
            "tail": position - offsets["payload"], "least": position,
            "counted": sum(sizes[part] for part in counts), "_offsets": offsets,
        }  # fmt: skip
        for name, value in parts.items():
            object.__setattr__(shape, name, value)
        object.__setattr__(shape, "_covered", tuple(shape._runs()))
        return shape

    def _runs(self) -> Iterable[slice]:
        """Yield the bytes that the check covers. Consecutive parts form one run."""
        run: list[str] = []
        for part in (*self.order, ""):
            if part in self.covers:
                run.append(part)
            elif run:
                yield slice(self._edge(run[0]), self._edge(run[-1], behind=True))
                run.clear()

    def _edge(self, part: str, behind: bool = False) -> int | None:
        """Return where a part begins or ends; after the payload, counted from the end of the packet."""
        place = self._offsets[part] + (self.sizes[part] if behind else 0)
        if self.order.index(part) + behind > self.order.index("payload"):
            return place - self.least or None  # None: the end itself
        return place

    def place(self, part: str, payload: int) -> range:
        """Return the bytes of a part in a packet whose payload has ``payload`` bytes."""
        size = payload if part == "payload" else self.sizes[part]
        start = self._offsets[part]
        if self.order.index(part) > self.order.index("payload"):
            start += payload
        return range(start, start + size)

    def declared(self, data: bytes, at: int = 0) -> int:
        """Return the length in the packet at ``at``, of which :attr:`head` bytes must be available."""
        end = at + self.head
        return int.from_bytes(data[end - self.length : end], "little")

    def number(self, part: str, packet: bytes) -> int:
        """Return the number in a part of a whole packet."""
        place = self.place(part, len(packet) - self.least)
        return int.from_bytes(packet[place.start : place.stop], "little")

    def payload(self, packet: bytes) -> bytes:
        """Return the payload of a whole packet."""
        return packet[self._offsets["payload"] : len(packet) - self.tail]

    def check_of(self, packet: bytes) -> int:
        """Return the right check of a whole packet; 0 if packets have none."""
        if self.check is None:
            return 0
        if len(self._covered) == 1:
            return self.check.of(packet[self._covered[0]])
        return self.check.of(b"".join([packet[run] for run in self._covered]))

    def is_whole(self, packet: bytes) -> bool:
        """Whether a packet of the right length has the right end bytes and the right check."""
        if not packet.endswith(self.end):
            return False
        return self.check is None or self.number("check", packet) == self.check_of(packet)

    def pack(self, id: int, address: int | None, payload: bytes) -> bytes:
        """Return the bytes of a packet, from parts that are known to be valid."""
        sizes = self.sizes
        contents = {
            "start": self.start,
            "length": (self.counted + len(payload)).to_bytes(self.length, "little"),
            "address": (address or 0).to_bytes(self.address, "little"),
            "id": id.to_bytes(self.id, "little"),
            "payload": payload,
            "check": bytes(sizes["check"]),
            "end": self.end,
        }
        packet = b"".join([contents[part] for part in self.order])
        if self.check is None:
            return packet
        place = self.place("check", len(payload))
        check = self.check_of(packet).to_bytes(sizes["check"], "little")
        return packet[: place.start] + check + packet[place.stop :]

    def _key(self) -> tuple[Any, ...]:
        return (
            self.order, self.start, self.length, self.counts, self.id, self.maximum,
            self.address, self.check, self.covers, self.end,
        )  # fmt: skip

    def __reduce__(self) -> tuple[Any, ...]:
        return Shape, self._key()

    def __repr__(self) -> str:
        return f"<Shape {' '.join(self.order)}>"


def _check_order(order: tuple[str, ...], sizes: dict[str, int]) -> None:
    for part in ("length", "id", "address"):
        least = 0 if part == "address" else 1
        if not least <= sizes[part] <= _NUMBER:
            raise ValueError(f"{part} has {least} to {_NUMBER} bytes, not {sizes[part]}")
    if not sizes["start"]:
        raise ValueError("a packet begins with at least one byte that is always the same")
    for part in order:
        if part not in PARTS:
            raise ValueError(f"a packet has no part {part} ({', '.join(PARTS)})")
        if order.count(part) > 1:
            raise ValueError(f"{part} is in the order twice")
        if not sizes[part] and part != "payload":
            raise ValueError(f"{part} is in the order but has no bytes")
    for part in PARTS:
        if part not in order and (sizes[part] or part == "payload"):
            raise ValueError(f"{part} is missing from the order")
    if order[0] != "start":
        raise ValueError(f"start must come first, not {order[0]}")
    if "end" in order and order[-1] != "end":
        raise ValueError(f"end must come last, not {order[-1]}")
    payload = order.index("payload")
    for part in ("length", "id"):
        if order.index(part) > payload:
            raise ValueError(f"{part} must come before the payload")
    if "check" in order and order.index("check") < payload:
        raise ValueError("check must come after the payload")


def _check_counting(
    order: tuple[str, ...], counts: tuple[str, ...], maximum: int, sizes: dict[str, int]
) -> None:
    _check_parts("the length counts", counts, order)
    if "payload" not in counts:
        raise ValueError("the length must count the payload")
    most = (1 << 8 * sizes["length"]) - 1
    longest = maximum + sum(sizes[part] for part in counts)
    if maximum < 0 or longest > most:
        raise ValueError(
            f"a length of {sizes['length']} bytes counts to {most}; a payload of {maximum} bytes "
            f"makes it {longest}"
        )


def _check_cover(order: tuple[str, ...], covers: tuple[str, ...], check: Check | None) -> None:
    if (check is None) != (not covers):
        raise ValueError("check and covers must be given together")
    _check_parts("the check covers", covers, order)
    for part in ("check", "end"):
        if part in covers:
            raise ValueError(f"the check cannot cover the {part}")


def _check_parts(what: str, named: tuple[str, ...], order: tuple[str, ...]) -> None:
    for part in named:
        if part not in order:
            raise ValueError(f"{what} {part}, which is not in the order")
        if named.count(part) > 1:
            raise ValueError(f"{what} {part} twice")
