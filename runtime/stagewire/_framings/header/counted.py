"""Messages whose packet ends with rows of integers, as many as fields before them state."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from struct import Struct

from stagewire._codec.message import Layout
from stagewire._framings.header.message import (
    DATA_FLAG,
    HEADER_SIZE,
    FramedMessage,
    check_addresses,
)
from stagewire.errors import BadValueError, OutOfRangeError

TYPE_CHECKING = False  # importing typing would double the import time
if TYPE_CHECKING:
    from typing import ClassVar

_DATA_HEADER = Struct("<HHBB")


class Counted:
    """The array at the end of a packet, and the fields that determine its length.

    :param name: the field with the array.
    :param code: the :mod:`struct` code of one integer.
    :param least: bytes of the packet before the array.
    :param most: bytes of the longest packet.
    :param rows: the field with the number of rows.
    :param single: integers in every row, in addition to one for each bit of ``masks``.
    :param masks: the fields with these bits.
    :param places: field -> its offset and size in the packet, for ``rows`` and ``masks``.
    """

    __slots__ = ("code", "least", "masks", "most", "name", "places", "rows", "single", "size")

    def __init__(
        self,
        name: str,
        code: str,
        least: int,
        most: int,
        rows: str,
        single: int,
        masks: tuple[str, ...],
        places: Mapping[str, tuple[int, int]],
    ) -> None:
        self.name = name
        self.code = code
        self.least = least
        self.most = most
        self.rows = rows
        self.single = single
        self.masks = masks
        self.places = places
        self.size = Struct(f"<{code}").size
        """Bytes of one integer."""

    def width(self, values: Mapping[str, int]) -> int:
        """Return the number of integers in a row."""
        return self.single + sum(values[name].bit_count() for name in self.masks)

    def admits(self, length: int) -> bool:
        """Whether a packet may have this length."""
        return self.least <= length <= self.most and (length - self.least) % self.size == 0

    def length_in(self, frame: bytes) -> int:
        """Return the length of the packet that its fields state; 0 if it is too short for them.

        :param frame: a whole frame.
        """
        if len(frame) < HEADER_SIZE + self.least:
            return 0
        values = {}
        for name, (offset, size) in self.places.items():
            at = HEADER_SIZE + offset
            values[name] = int.from_bytes(frame[at : at + size], "little")
        return self.least + values[self.rows] * self.width(values) * self.size

    def read(self, frame: bytes) -> tuple[int, ...]:
        """Return the integers in a whole frame."""
        start = HEADER_SIZE + self.least
        count = (len(frame) - start) // self.size
        return Struct(f"<{count}{self.code}").unpack_from(frame, start)

    def check(
        self, layout: Layout, given: object, minimum: int, maximum: int, values: Mapping[str, int]
    ) -> tuple[int, ...]:
        """Return the integers of an array if they fit the other fields.

        Raises :class:`~stagewire.errors.OutOfRangeError` for a wrong number of integers, for one out of range
        and for a packet that is too long, and :class:`~stagewire.errors.BadValueError` for values of the
        wrong type.
        """
        where = f"{layout.message}.{self.name}"
        if isinstance(given, (str, bytes, bytearray, Mapping)) or not isinstance(given, Iterable):
            raise BadValueError(f"{where} must be a sequence of integers, not {given!r}")
        numbers = tuple(given)
        for index, number in enumerate(numbers):
            if isinstance(number, bool) or not isinstance(number, int):
                raise BadValueError(f"{where}[{index}] must be an integer, not {number!r}")
            if not minimum <= number <= maximum:
                raise OutOfRangeError(
                    f"{where}[{index}] must be {minimum} to {maximum} (raw counts), not {number}"
                    f"{layout.source_of(self.name)}"
                )
        rows, width = values[self.rows], self.width(values)
        if len(numbers) != rows * width:
            raise OutOfRangeError(
                f"{where} must have {rows * width} integers, {self.rows} ({rows}) rows of {width}, "
                f"not {len(numbers)}{layout.source_of(self.name)}"
            )
        length = self.least + len(numbers) * self.size
        if length > self.most:
            raise OutOfRangeError(
                f"{where}: a packet has at most {self.most} bytes, and this one would have {length}"
            )
        return tuple(int(number) for number in numbers)


class CountedMessage(FramedMessage, abstract=True):
    """A message whose packet ends with an array; the generated classes list its fields."""

    __slots__ = ()

    if TYPE_CHECKING:
        counted: ClassVar[Counted]

    def pack_fields(self) -> bytes:
        """Return the bytes of the fields before the array."""
        raise NotImplementedError

    def pack(self, dest: int, source: int) -> bytes:
        """Return the bytes of the frame.

        Raises :class:`~stagewire.errors.OutOfRangeError` if an address is out of range.
        """
        check_addresses(dest, source)
        numbers = getattr(self, self.counted.name)
        packet = self.pack_fields() + Struct(f"<{len(numbers)}{self.counted.code}").pack(*numbers)
        return _DATA_HEADER.pack(self.layout.id, len(packet), dest | DATA_FLAG, source) + packet

    @property
    def rows(self) -> tuple[tuple[int, ...], ...]:
        """The array as rows, each with the integers of the columns in order."""
        counted = self.counted
        width = counted.width({name: getattr(self, name) for name in counted.masks})
        numbers = getattr(self, counted.name)
        return tuple(numbers[at : at + width] for at in range(0, len(numbers), width or 1))
