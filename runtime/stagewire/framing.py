"""Cutting a stream of bytes into frames, without any input or output.

Bytes go in by :meth:`Framer.feed`, events come out. A frame is a header of six bytes: message id, two
parameters or the length of a data packet, destination, source. The top bit of the destination says that a
packet follows. There is no checksum and no start mark, so one damaged byte can put the receiver out of
step. The rule below was chosen by damaging streams at every position and counting what was lost and what
was invented afterwards (``benchmarks/framing_experiment.py``).

**Terms.** An id is *ours* when the end that we sit on (:class:`End`) receives messages of its direction;
somebody who listens on the line (``End.NONE``) receives both. Addresses are *right* when one is the host's
and the other a controller's, and the message travels in a direction that the id has and that we receive.
They are *tolerated* when right, when unswapped (the controller sent its request's addresses back), or 0 and 0.

**The rule.** The framer starts *in step*, that is, where a frame is due.

1. A header that declares a packet of over 255 bytes is garbage, in step or out of step.
2. In step, an id of ours in a form that it has, with tolerated addresses:

   * a header form, or a data form of exactly a known length, is a message;
   * a packet shorter than every layout is ``BadLength``, consumed by its declared length: a flipped length
     must not make us read the payload as headers;
   * a packet longer than its layout is a message with extra bytes, as newer controllers send; but when the
     surplus could hold a header (6 bytes) and a header stands inside that would be accepted out of step,
     the length is what was damaged: out of step from the next byte on, so that this header is found;
   * a header form whose parameters spell one of the id's packet lengths is garbage: it is a data frame
     that lost its top bit, and taken for a header it would start a stored move;
   * a header form of an id with ``only_zero_parameters`` is garbage when they are not zero.

3. In step, an unknown id is ``Unknown`` and skipped by its length, but only with right addresses. An id
   known without a layout is treated in the same way and reported as ``Undocumented``. Never rescanned: a
   payload read as headers invents messages.
4. Anything else in step: drop one byte, and be *out of step*.
5. Out of step, one byte after the other is dropped until a header stands there that is ours, in a form that
   it has, of exactly a known length, with tolerated addresses for a data form and right ones for a header
   form (which has less to be recognised by). With it the framer is in step again.

**Any chunking gives the same.** Every decision looks at a header or at a whole declared frame, never at how
much happens to be there, and never at the clock; if the bytes are not all there it waits for them. The one
trace of a chunk is that garbage is given out at the end of each feed; compare after :func:`join_garbage`.

**Time and memory are bounded.** What is pending is less than one maximal frame, nothing is looked at again
before the number of bytes that the decision needs is there, and no byte is judged more than three times.
"""

from __future__ import annotations

import enum
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from struct import Struct
from typing import Final

__all__ = [
    "BadLength",
    "Direction",
    "End",
    "Event",
    "Forms",
    "Framer",
    "FramingTable",
    "Garbage",
    "Received",
    "Undocumented",
    "Unknown",
    "join_garbage",
]

_HEADER: Final = Struct("<HHBB")  # id, parameters or packet length, destination, source
_HEADER_SIZE: Final = 6
_NEVER: Final = 1 << 62  # the size of a frame that no buffer will ever hold
_REMEMBERED_HEADERS: Final = 1024


class Direction(enum.Flag):
    """Which way a message travels."""

    TO_CONTROLLER = 1
    TO_HOST = 2
    BOTH = 3


class End(enum.Enum):
    """Which end of the line a framer sits on, hence which messages reach it.

    ``HOST`` receives what controllers send, ``DEVICE`` what the host sends, ``NONE`` listens to both.
    """

    HOST = "host"
    DEVICE = "device"
    NONE = "none"

    @property
    def receives(self) -> Direction:
        """The directions of the messages that reach this end."""
        return _RECEIVES[self]


_RECEIVES: Final = {
    End.HOST: Direction.TO_HOST,
    End.DEVICE: Direction.TO_CONTROLLER,
    End.NONE: Direction.BOTH,
}


@dataclass(frozen=True, slots=True)
class Forms:
    """What framing has to know of one message id.

    :param name: name of the message, for people.
    :param direction: which way it travels.
    :param header: whether it has a form without a packet.
    :param lengths: packet lengths of its data forms; empty when it has none.
    :param documented: False for an id that is known without a layout.
    :param only_zero_parameters: the header form counts only with both parameter bytes zero.
    """

    name: str
    direction: Direction
    header: bool
    lengths: frozenset[int]
    documented: bool = True
    only_zero_parameters: bool = False


@dataclass(frozen=True, slots=True)
class FramingTable:
    """Everything that framing has to know of a protocol.

    :param forms: message id -> its forms.
    :param host: address of the host.
    :param devices: addresses that controllers have.
    :param data_flag: the bit of the destination that says that a packet follows.
    :param maximum_length: the longest packet that a header may declare.
    """

    forms: Mapping[int, Forms]
    host: int
    devices: frozenset[int]
    data_flag: int = 0x80
    maximum_length: int = 255


class Event:
    """Something that came: ``raw`` holds its bytes, unchanged. Not to be modified."""

    __slots__ = ("raw",)
    __match_args__ = ("raw",)

    raw: bytes

    def __init__(self, raw: bytes) -> None:
        self.raw = raw

    def __eq__(self, other: object) -> bool:
        if other.__class__ is not self.__class__:
            return NotImplemented
        return self.raw == other.raw

    def __hash__(self) -> int:
        return hash((self.__class__, self.raw))

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.raw.hex(' ')!r})"


class _Frame(Event):
    """An event whose bytes are one whole frame, as long as its header declares."""

    __slots__ = ()

    payload_offset: Final = _HEADER_SIZE  # where the packet begins, if there is one

    @property
    def id(self) -> int:
        """The message id."""
        return self.raw[0] | self.raw[1] << 8

    @property
    def dest(self) -> int:
        """Address of the receiver, without the bit that announces a packet."""
        return self.raw[4] & 0x7F

    @property
    def source(self) -> int:
        """Address of the sender."""
        return self.raw[5]


class Received(_Frame):
    """A message of a known layout, perhaps with extra bytes; decoded by whoever asks."""

    __slots__ = ()


class Undocumented(_Frame):
    """A frame whose id is known and whose layout is not."""

    __slots__ = ()


class Unknown(_Frame):
    """A frame with an id that the table has not, skipped by its length."""

    __slots__ = ()


class BadLength(_Frame):
    """A frame of a known message whose packet is too short for every layout."""

    __slots__ = ()


class Garbage(Event):
    """Bytes that belong to no frame."""

    __slots__ = ()


class _TooLong(_Frame):
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
        """The longest layout that a packet of ``length`` bytes fills; None if it fills none."""
        return max((known for known in self.lengths if known <= length), default=None)


class _Rule:
    """What one header means: the rule of this module for one table and one end.

    A pair of addresses is one number here: destination (without its top bit) times 256, plus source.
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

        self.data_flag = table.data_flag
        self.maximum_length = table.maximum_length
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

    def _make_sieve(self) -> re.Pattern[bytes]:
        """Return a pattern that every header accepted out of step matches, and hardly anything else."""
        destinations = {pair >> 8 for pair in self.tolerated}
        destinations |= {destination | self.data_flag for destination in destinations}
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
        has_packet = dest & self.data_flag
        if has_packet and word > self.maximum_length:
            return Garbage, 1
        size = _HEADER_SIZE + word if has_packet else _HEADER_SIZE
        addresses = (dest & ~self.data_flag) << 8 | source
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
        return (Received if word - layout < _HEADER_SIZE else _TooLong), size

    def out_of_step(self, header: bytes) -> int:
        """Return the size of the frame that begins with ``header``, or 0: not accepted out of step."""
        id, word, dest, source = _HEADER.unpack(header)
        shape = self.shapes.get(id)
        if shape is None:
            return 0
        addresses = (dest & ~self.data_flag) << 8 | source
        if dest & self.data_flag:
            exact = word in shape.lengths and addresses in self.tolerated
            return _HEADER_SIZE + word if exact else 0
        return _HEADER_SIZE if shape.has_header_form(word) and addresses in shape.right else 0

    def find(self, data: bytes, start: int, stop: int) -> tuple[int, int]:
        """Return where the first header accepted out of step stands, and the size of its frame.

        The whole header lies between ``start`` and ``stop``. Without one the size is 0 and the
        position is the first that has no whole header any more.
        """
        while (candidate := self._sieve.search(data, start, stop)) is not None:
            start = candidate.start()
            size = self.out_of_step(data[start : start + _HEADER_SIZE])
            if size:
                return start, size
            start += 1
        return max(start, stop - _HEADER_SIZE + 1), 0


class Framer:
    """Cuts one stream into events, for the end of the line that it sits on.

    The bytes of all events so far, followed by :attr:`pending`, are the bytes that were fed. Nothing that
    comes from outside makes it raise.

    :param table: what framing has to know of the protocol.
    :param end: which end receives here; a framer that knows it recovers sooner.
    """

    __slots__ = ("_in_step", "_needed", "_pending", "_rule", "_sizes")

    def __init__(self, table: FramingTable, end: End = End.NONE) -> None:
        self._rule = _Rule(table, end)
        # Headers that were messages in step -> size of their frame: a controller says the same few
        # things again and again. No more than _REMEMBERED_HEADERS, whatever comes.
        self._sizes: dict[bytes, int] = {}
        self.reset()

    def reset(self) -> None:
        """Forget what is pending and be in step, as at the beginning of a stream."""
        self._pending = b""
        self._needed = _HEADER_SIZE
        self._in_step = True

    @property
    def pending(self) -> bytes:
        """The bytes that wait for more to come: the beginning of a frame."""
        return self._pending

    def abandon(self) -> list[Event]:
        """Give up waiting: what is pending becomes garbage, and the framer is out of step.

        The session calls this after a silence in which the rest of a frame would have come.
        """
        if not self._pending:
            return []
        garbage = Garbage(self._pending)
        self._pending = b""
        self._needed = _HEADER_SIZE
        self._in_step = False
        return [garbage]

    def feed(self, data: bytes | bytearray | memoryview) -> list[Event]:
        """Take the next bytes of the stream and return what they complete."""
        if not isinstance(data, bytes):
            if not isinstance(data, (bytearray, memoryview)):
                raise TypeError(f"a framer is fed bytes, not {type(data).__name__}")
            data = bytes(data)
        if self._pending:
            data = self._pending + data
        available = len(data)
        if available < self._needed:
            self._pending = data
            return []

        events: list[Event] = []
        append, new, size_of = events.append, object.__new__, self._sizes.get
        position = 0  # everything before it has been given out, or is garbage since `garbage`
        garbage = 0
        in_step = self._in_step
        while True:
            if in_step:
                # Headers seen before. A part of a header is never among them.
                while (
                    end := position + size_of(data[position : position + 6], _NEVER)
                ) <= available:
                    event = new(Received)
                    event.raw = data[position:end]
                    append(event)
                    position = end
                garbage = position
            if available - position < _HEADER_SIZE:
                needed = _HEADER_SIZE
                break
            if in_step:
                header = data[position : position + _HEADER_SIZE]
                kind, size = self._rule.in_step(header)
                if available - position < size:
                    needed = size
                    break
                if kind is _TooLong:
                    _, found = self._rule.find(data, position + 1, position + size)
                    kind, size = (Garbage, 1) if found else (Received, size)
                elif kind is Received and len(self._sizes) < _REMEMBERED_HEADERS:
                    self._sizes[header] = size
                if kind is Garbage:
                    in_step = False
                else:
                    append(kind(data[position : position + size]))
                position += size
            else:
                position, size = self._rule.find(data, position, available)
                if not size or available - position < size:
                    needed = size or _HEADER_SIZE
                    break
                if garbage < position:
                    append(Garbage(data[garbage:position]))
                append(Received(data[position : position + size]))
                position += size
                in_step = True

        if garbage < position:
            append(Garbage(data[garbage:position]))
        self._pending = data[position:]
        self._needed = needed
        self._in_step = in_step
        return events


def join_garbage(events: Iterable[Event]) -> list[Event]:
    """Return the events with adjacent garbage joined, as streams are compared."""
    joined: list[Event] = []
    run: list[bytes] = []  # joined at its end: adding piece by piece would be quadratic
    for event in events:
        if isinstance(event, Garbage):
            run.append(event.raw)
            continue
        if run:
            joined.append(Garbage(b"".join(run)))
            run.clear()
        joined.append(event)
    if run:
        joined.append(Garbage(b"".join(run)))
    return joined
