"""Fuzzing inputs for the codec: real frames of the registry, and damaged ones.

Random bytes rarely contain a known id, a matching length and valid addresses together. A fuzzer that starts
from them mostly tests the refusal of unknown ids. This module therefore builds frames from the layouts, and
then cuts, flips, duplicates, splices and lengthens them. One ``random.Random`` makes every choice, so the
same seed gives the same bytes.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from random import Random
from typing import Any

import command_streams
from command_streams import change_commands

from stagewire.protocols import (
    DATA_FLAG,
    HEADER_SIZE,
    MAXIMUM_PACKET,
    Direction,
    UndocumentedMessage,
)

sys.path.append(str(Path(__file__).parents[1] / "support"))
from undocumented import PROTOCOL

__all__ = [
    "ARRAYS",
    "LONGEST_PACKET",
    "PROTOCOL",
    "beginnings",
    "change_codec",
    "change_commands",
    "change_stream",
    "damaged",
    "frame",
    "new_codec",
    "new_stream",
]

STREAM_CONTROLS = 4
"""Control bytes before a stream: end and context, chunk sizes (two bytes), where to abandon."""

LAYOUTS = tuple(cls.layout for cls in PROTOCOL.messages)
UNDOCUMENTED_IDS = frozenset(
    cls.layout.id for cls in PROTOCOL.messages if issubclass(cls, UndocumentedMessage)
)
IDS = frozenset(layout.id for layout in LAYOUTS)
DEVICES = tuple(sorted(PROTOCOL.devices))


class Array:
    """The array at the end of a packet, as the registry describes it.

    :param fields: the fields of its layout.
    """

    def __init__(self, fields: list[dict[str, Any]]) -> None:
        by_name = {field["name"]: field for field in fields}
        field = fields[-1]
        array = field["array"]
        masks = [column["each"] for column in array["columns"] if column["each"]]
        self.name: str = field["name"]
        self.least: int = field["offset"]
        self._item: int = array["item_size"]
        self._single = len(array["columns"]) - len(masks)
        self._rows = by_name[array["rows"]]
        self._masks = [by_name[name] for name in masks]
        self.most = self.length({field["name"]: field["maximum"] for field in fields})
        """Bytes of the longest packet; the greatest mask has all bits."""

    def count(self, values: Mapping[str, int]) -> int:
        """Return the number of integers that the values of the other fields state."""
        bits = sum(values[field["name"]].bit_count() for field in self._masks)
        return values[self._rows["name"]] * (self._single + bits)

    def length(self, values: Mapping[str, int]) -> int:
        """Return the length of the packet that the values of the other fields state."""
        return self.least + self._item * self.count(values)

    def stated(self, packet: bytes) -> int:
        """Return the length that the fields of a packet state; it has at least ``least`` bytes."""
        read = {}
        for field in (self._rows, *self._masks):
            at = field["offset"]
            read[field["name"]] = int.from_bytes(packet[at : at + field["size"]], "little")
        return self.length(read)

    def beginning(self, rng: Random) -> bytes:
        """Return the fields of a packet before the array, usually within their ranges."""
        made = bytearray(rng.randbytes(self.least))
        for field, numbers in ((self._rows, (0, 1, 2, 5)), *((mask, ()) for mask in self._masks)):
            value = rng.choice((*numbers, rng.randrange(field["maximum"] + 1)))
            if rng.random() < 0.05:
                value = field["maximum"] + 1
            made[field["offset"] : field["offset"] + field["size"]] = value.to_bytes(
                field["size"], "little"
            )
        return bytes(made)


ARRAYS = {
    message["id"]: Array(layout["fields"])
    for message in PROTOCOL.registry()["messages"]
    for layout in message["layouts"]
    if layout["fields"] and "array" in layout["fields"][-1]
}
"""Id -> the array of the message."""
LAYOUTS_WITH_ARRAY = tuple(layout for layout in LAYOUTS if layout.id in ARRAYS)
LONGEST_PACKET = max(MAXIMUM_PACKET, *(array.most for array in ARRAYS.values()))
"""Bytes of the longest packet of any message."""


def as_sent(raw: bytes) -> bytes:
    """Return a received frame as it is sent. Only one kind of packet is received without the data flag."""
    lacks_flag = raw[:4] == b"\xc0\x08\x08\0"
    return raw[:4] + bytes((raw[4] | DATA_FLAG,)) + raw[5:] if lacks_flag else raw


LONG = 120
INTERESTING = (0x00, 0x01, 0x04, 0x06, 0x0E, 0x50, 0x7F, 0x80, 0x81, 0xD0, 0xFF)


def _published() -> list[bytes]:
    """Return the frames of the worked examples and captures, including the misprinted ones."""
    vectors = PROTOCOL.vectors()
    found = set()
    for entry in [*vectors["examples"], *vectors["captures"]]:
        try:
            found.add(bytes.fromhex(entry.get("printed") or ""))
        except ValueError:  # an example in prose, or with a misprinted digit
            continue
    return sorted(found - {b""})


PUBLISHED = tuple(_published())


def frame(rng: Random) -> bytes:
    """Return one frame, usually whole and valid."""
    if rng.random() < 0.1:
        return rng.choice(PUBLISHED)
    layout = rng.choice(LAYOUTS_WITH_ARRAY if rng.random() < 0.05 else LAYOUTS)
    id = layout.id
    length = layout.length
    beginning = b""
    if id in UNDOCUMENTED_IDS:
        length = rng.choice((0, 1, 6, 68, MAXIMUM_PACKET))
    elif id in ARRAYS:
        beginning = ARRAYS[id].beginning(rng)
        length = min(ARRAYS[id].stated(beginning), LONGEST_PACKET + 1)
    elif rng.random() < 0.05:
        id = rng.choice((id ^ 1 << rng.randrange(16), rng.randrange(1 << 16)))
    kind = rng.random()
    if length and kind < 0.08:  # longer, as newer controllers send, or longer than that
        most = LONGEST_PACKET if beginning else MAXIMUM_PACKET
        length = min(length + rng.choice((1, 2, 4, 6, 12, 60)), most)
    elif length and kind < 0.12:
        length = rng.randrange(length)
    elif length and kind < 0.13:  # longer than any packet
        length = LONGEST_PACKET if rng.random() < 0.1 else MAXIMUM_PACKET
        length += rng.choice((1, 1, 2, 20))
    dest, source = _addresses(rng, layout.direction)
    if not layout.length and not (id in UNDOCUMENTED_IDS and length):
        parameters = bytes(2) if rng.random() < 0.5 else bytes((_byte(rng), _byte(rng)))
        return id.to_bytes(2, "little") + parameters + bytes((dest, source))
    header = (id | length << 16).to_bytes(4, "little") + bytes((dest | DATA_FLAG, source))
    return header + (beginning + _payload(rng, length))[:length]


def _addresses(rng: Random, direction: Direction) -> tuple[int, int]:
    kind = rng.random()
    if kind < 0.05:
        return 0, 0
    if kind < 0.08:
        return rng.randrange(128), rng.randrange(256)
    ends = PROTOCOL.host, rng.choice(DEVICES)
    if direction is Direction.TO_CONTROLLER or (direction is Direction.BOTH and kind < 0.5):
        ends = ends[::-1]
    return ends[::-1] if kind > 0.95 else ends


def _payload(rng: Random, length: int) -> bytes:
    kind = rng.random()
    if kind < 0.2:
        return bytes(length)
    if kind < 0.3:
        return b"\xff" * length
    if kind < 0.4:  # a payload that imitates frames
        return (frame(rng) * (length // HEADER_SIZE + 1))[:length]
    return rng.randbytes(length)


def _byte(rng: Random) -> int:
    return rng.choice(INTERESTING) if rng.random() < 0.7 else rng.randrange(256)


# Inputs of the properties


def beginnings(target: str) -> list[bytes]:
    """Return the inputs a fuzzer starts from: the published frames, and one input per layout."""
    if target == "commands":
        return command_streams.beginnings()
    rng = Random(0)
    if target == "stream":
        made = [bytes((number % 256, 200, 7, 255)) + raw for number, raw in enumerate(PUBLISHED)]
        return [*made, *(new_stream(rng) for _ in range(200))]
    by_name = [b"\x80" + number.to_bytes(2, "little") for number in range(len(LAYOUTS))]
    return [*(bytes(1) + raw for raw in PUBLISHED), *by_name]


def new_stream(rng: Random) -> bytes:
    """Return control bytes and a few consecutive frames, some of them damaged."""
    made = b"".join([frame(rng) for _ in range(rng.randrange(1, 9))])
    for _ in range(rng.choice((0, 1, 1, 2, 4))):
        made = damaged(rng, made)
    return rng.randbytes(STREAM_CONTROLS) + made


def change_stream(rng: Random, data: bytes) -> bytes:
    """Return an input with its control bytes or its stream changed."""
    if rng.random() < 0.05:
        return new_stream(rng)
    controls, body = data[:STREAM_CONTROLS].ljust(STREAM_CONTROLS, b"\0"), data[STREAM_CONTROLS:]
    if rng.random() < 0.3:
        controls = _overwrite(rng, controls) if rng.random() < 0.5 else rng.randbytes(len(controls))
    # Most mutations lengthen the stream, and long streams are slow.
    if len(body) > LONG and rng.random() < 0.7:
        return controls + _cut(rng, body)
    return controls + damaged(rng, body)


def new_codec(rng: Random) -> bytes:
    """Return the choosing byte, followed by one frame or by the values for building a message by name."""
    choice = rng.randrange(256)
    if choice & 0x80:
        return bytes((choice,)) + rng.randbytes(rng.choice((10, 40, 120)))
    made = frame(rng)
    return bytes((choice,)) + (damaged(rng, made) if rng.random() < 0.4 else made)


def change_codec(rng: Random, data: bytes) -> bytes:
    """Return an input with its frame, its values or its context changed."""
    kind = rng.random()
    if kind < 0.3 or not data:
        return new_codec(rng)
    if kind < 0.4:
        return bytes((data[0] & 0x80 | rng.randrange(0x80),)) + data[1:]
    change = rng.choice((_flip, _overwrite, _insert)) if data[0] & 0x80 else damaged
    return data[:1] + change(rng, data[1:])


# Mutations


def damaged(rng: Random, data: bytes) -> bytes:
    """Return ``data`` with one mutation."""
    return rng.choice(_MUTATIONS)(rng, data)


def _flip(rng: Random, data: bytes) -> bytes:
    if not data:
        return data
    at = rng.randrange(len(data))
    return data[:at] + bytes((data[at] ^ 1 << rng.randrange(8),)) + data[at + 1 :]


def _overwrite(rng: Random, data: bytes) -> bytes:
    if not data:
        return data
    at = rng.randrange(len(data))
    return data[:at] + bytes((_byte(rng),)) + data[at + 1 :]


def _piece(rng: Random, data: bytes) -> tuple[int, int]:
    start = rng.randrange(len(data) + 1)
    return start, min(start + rng.choice((1, 1, 2, 4, 6, 20)), len(data))


def _lose(rng: Random, data: bytes) -> bytes:
    start, stop = _piece(rng, data)
    return data[:start] + data[stop:]


def _double(rng: Random, data: bytes) -> bytes:
    start, stop = _piece(rng, data)
    return data[:stop] + data[start:]


def _insert(rng: Random, data: bytes) -> bytes:
    at = rng.randrange(len(data) + 1)
    return data[:at] + rng.randbytes(rng.choice((1, 1, 1, 2, 5, 30))) + data[at:]


def _splice(rng: Random, data: bytes) -> bytes:
    at = rng.randrange(len(data) + 1)
    return data[:at] + frame(rng) + data[at:]


def _replace(rng: Random, data: bytes) -> bytes:
    new = frame(rng)
    at = rng.randrange(len(data) + 1)
    return data[:at] + new + data[at + len(new) :]


def _append(rng: Random, data: bytes) -> bytes:
    return data + frame(rng)


def _cut(rng: Random, data: bytes) -> bytes:
    return data[: rng.randrange(len(data) + 1)]


def _header(rng: Random, data: bytes) -> bytes:
    """Change the header of the first frame or of a later one."""
    at = 0
    while len(data) - at >= HEADER_SIZE and rng.random() < 0.7:
        packet = data[at + 4] & DATA_FLAG
        at += HEADER_SIZE + ((data[at + 2] | data[at + 3] << 8) if packet else 0)
    if len(data) - at < HEADER_SIZE:
        at = 0
    if len(data) < HEADER_SIZE:
        return data
    header = bytearray(data[at : at + HEADER_SIZE])
    kind = rng.randrange(4)
    if kind == 0:
        header[4] ^= DATA_FLAG
    elif kind == 1:
        header[2:4] = rng.choice((0, 1, 5, 6, 14, 200, 255, 256, 0xFFFF)).to_bytes(2, "little")
    elif kind == 2:
        header[4], header[5] = header[5] | header[4] & DATA_FLAG, header[4] & ~DATA_FLAG
    else:
        header[:2] = rng.choice(LAYOUTS).id.to_bytes(2, "little")
    return data[:at] + bytes(header) + data[at + HEADER_SIZE :]


_MUTATIONS: tuple[Callable[[Random, bytes], bytes], ...] = (
    _flip, _overwrite, _lose, _double, _insert, _splice, _replace, _append, _cut, _header, _header,
)  # fmt: skip
