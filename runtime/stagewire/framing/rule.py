"""The rule: what one header means. It is stated, with its reasons, in :mod:`stagewire.framing`."""

from __future__ import annotations

from functools import cache
from struct import Struct

from stagewire.framing.events import (
    BadLength,
    Event,
    FrameEvent,
    Garbage,
    Received,
    Undocumented,
    Unknown,
)
from stagewire.framing.table import Direction, End, Forms, FramingTable
from stagewire.header import DATA_FLAG, HEADER_SIZE, MAXIMUM_PACKET

TYPE_CHECKING = False  # typing would take half of the time of an import
if TYPE_CHECKING:
    from re import Pattern
    from typing import Final

__all__ = ["Rule", "TooLong", "rule_of"]

_HEADER: Final = Struct("<HHBB")  # id, parameters or packet length, destination, source


class TooLong(FrameEvent):
    """Never given out: a packet with room for a header after its layout; look inside first."""

    __slots__ = ()


class _Shape:
    """The forms of one id of ours, with the addresses that are right for it."""

    __slots__ = ("header", "lengths", "only_zero", "right")

    def __init__(self, forms: Forms, right: frozenset[int]) -> None:
        self.header = forms.header
        self.lengths = forms.lengths
        self.only_zero = forms.only_zero_parameters
        self.right = right

    def has_header_form(self, parameters: int) -> bool:
        """Whether both parameter bytes, read as one word, may stand in a header form."""
        if parameters in self.lengths or (self.only_zero and parameters):
            return False
        return self.header

    def layout_length(self, length: int) -> int | None:
        """Return the longest layout that a packet of ``length`` bytes fills, if any."""
        return max((known for known in self.lengths if known <= length), default=None)


class Rule:
    """What one header means, for one table and one end. Not changed once it is made.

    A pair of addresses is one number here: destination (without its top bit) times 256, plus
    source.
    """

    def __init__(self, table: FramingTable, end: End) -> None:
        host, devices = table.host, table.devices
        to_host = frozenset(host << 8 | device for device in devices)
        to_controller = frozenset(device << 8 | host for device in devices)

        def right(direction: Direction) -> frozenset[int]:
            pairs: frozenset[int] = frozenset()
            if Direction.TO_HOST in direction:
                pairs |= to_host
            if Direction.TO_CONTROLLER in direction:
                pairs |= to_controller
            return pairs

        self.right = right(end.receives)
        self.tolerated = to_host | to_controller | {0}
        self.shapes: dict[int, _Shape] = {}
        self.undocumented: set[int] = set()
        self.not_ours: set[int] = set()
        for id, forms in table.forms.items():
            ours = forms.direction & end.receives
            if not forms.documented:
                self.undocumented.add(id)
            elif ours:
                self.shapes[id] = _Shape(forms, right(ours))
            else:
                self.not_ours.add(id)
        self._sieve = self._make_sieve()

    def _make_sieve(self) -> Pattern[bytes]:
        """Return a pattern that all headers accepted out of step match, and little else does."""
        import re  # only who frames a stream needs it

        destinations = {pair >> 8 for pair in self.tolerated}
        destinations |= {destination | DATA_FLAG for destination in destinations}
        sources = {pair & 0xFF for pair in self.tolerated}
        low, high = {id & 0xFF for id in self.shapes}, {id >> 8 for id in self.shapes}
        if not self.shapes:
            return re.compile(b"(?!)")
        one_of = [b"[" + b"".join(b"\\x%02x" % byte for byte in sorted(bytes_)) + b"]"
                  for bytes_ in (low, high, destinations, sources)]  # fmt: skip
        return re.compile(b"%b%b..%b%b" % tuple(one_of), re.DOTALL)

    def in_step(self, header: bytes) -> tuple[type[Event], int]:
        """Return what begins with ``header`` where a frame is due, and how many bytes it takes."""
        id, word, dest, source = _HEADER.unpack(header)
        has_packet = dest & DATA_FLAG
        if has_packet and word > MAXIMUM_PACKET:
            return Garbage, 1
        size = HEADER_SIZE + word if has_packet else HEADER_SIZE
        addresses = (dest & ~DATA_FLAG) << 8 | source
        shape = self.shapes.get(id)
        if shape is None:
            if id in self.not_ours or addresses not in self.right:
                return Garbage, 1
            return (Undocumented if id in self.undocumented else Unknown), size
        if addresses not in self.tolerated:
            return Garbage, 1
        if not has_packet:
            return (Received, size) if shape.has_header_form(word) else (Garbage, 1)
        if not shape.lengths:
            return Garbage, 1
        layout = shape.layout_length(word)
        if layout is None:
            return BadLength, size
        return (Received if word - layout < HEADER_SIZE else TooLong), size

    def out_of_step(self, header: bytes) -> int:
        """Return the size of the frame that ``header`` begins, 0 if not accepted out of step."""
        id, word, dest, source = _HEADER.unpack(header)
        shape = self.shapes.get(id)
        if shape is None:
            return 0
        addresses = (dest & ~DATA_FLAG) << 8 | source
        if dest & DATA_FLAG:
            exact = word in shape.lengths and addresses in self.tolerated
            return HEADER_SIZE + word if exact else 0
        return HEADER_SIZE if shape.has_header_form(word) and addresses in shape.right else 0

    def find(self, data: bytes, start: int, stop: int) -> tuple[int, int]:
        """Return where the first header accepted out of step stands, and the size of its frame.

        The whole header lies between ``start`` and ``stop``. Without one the size is 0 and the
        position is the first that has no whole header any more.
        """
        while (candidate := self._sieve.search(data, start, stop)) is not None:
            start = candidate.start()
            size = self.out_of_step(data[start : start + HEADER_SIZE])
            if size:
                return start, size
            start += 1
        return max(start, stop - HEADER_SIZE + 1), 0


@cache
def rule_of(table: FramingTable, end: End) -> Rule:
    """Return the rule of a table and an end, made once: every session and framer needs it."""
    return Rule(table, end)
