"""A second implementation of the framing rules for commands and packets: the generator's, for the vectors.

The generator imports nothing from the runtime. Its readers are simple: they look at every position anew and
remember nothing. The tests compare the framers with them.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from types import SimpleNamespace
from typing import Any, NamedTuple

from invented_packets import framing_of
from stagewire.framing import (
    BadCommandLength,
    BadPacketLength,
    CommandReceived,
    Garbage,
    PacketReceived,
    UnknownCommand,
    UnknownPacket,
    join_garbage,
)
from stagewire.protocols import Check, Shape
from stagewire_generator.framings.packet.vectors_streams import PacketReader, Packets
from stagewire_generator.framings.slots.vectors_streams import SlotsReader

KINDS = {
    CommandReceived: "message",
    PacketReceived: "message",
    UnknownCommand: "unknown",
    UnknownPacket: "unknown",
    BadCommandLength: "bad_length",
    BadPacketLength: "bad_length",
    Garbage: "garbage",
}


class Piece(NamedTuple):
    """The kind of some bytes: ``message``, ``unknown``, ``bad_length``, ``garbage`` or ``pending``."""

    kind: str
    raw: bytes


def pieces(framer: Any, chunks: Iterable[bytes], longest: int) -> list[Piece]:
    """Feed a stream to a framer in chunks, and return its events as the references describe them.

    :param longest: a size that pending bytes may never reach.
    """
    events = []
    for chunk in chunks:
        events += framer.feed(chunk)
        assert len(framer.pending) < longest
    found = [Piece(KINDS[type(event)], event.raw) for event in join_garbage(events)]
    return found + ([Piece("pending", framer.pending)] if framer.pending else [])


def command_reference(
    prefix: int, terminator: int, setup: Iterable[int], commands: Mapping[int, tuple[int, int]]
) -> SlotsReader:
    """Return the rule of commands for one protocol.

    :param commands: command byte -> bytes of data, and the number in the size slot.
    """
    messages = [SimpleNamespace(kind="setup", id=byte, name="") for byte in setup]
    messages += [
        SimpleNamespace(
            kind="command",
            id=byte,
            size=size,
            layouts=[SimpleNamespace(form="request", length=length)],
        )
        for byte, (length, size) in commands.items()
    ]
    axes = SimpleNamespace(name="axes", values=[SimpleNamespace(value=0)])
    framing = {"prefix": prefix, "terminator": terminator, "axes": "axes"}
    return SlotsReader(SimpleNamespace(framing=framing, messages=messages, enumerations=[axes]))


def packet_reference(shape: Shape, lengths: Mapping[int, Iterable[int]]) -> PacketReader:
    """Return the rule of packets for one protocol.

    :param lengths: id -> the lengths of the layouts of its message.
    """
    messages = [
        SimpleNamespace(id=id, layouts=[SimpleNamespace(length=length) for length in layouts])
        for id, layouts in lengths.items()
    ]
    return PacketReader(SimpleNamespace(framing=framing_of(shape), messages=messages))


def reference_check(check: Check, data: bytes) -> int:
    """Return the check of some bytes, computed for a packet that has them as its payload."""
    shape = Shape(
        order=("start", "length", "id", "payload", "check"), start=b"\0", length=1, id=1,
        counts=("payload",), maximum=0xFF, check=check, covers=("payload",),
    )  # fmt: skip
    packet = Packets(SimpleNamespace(framing=framing_of(shape))).pack(0, 0, data)
    return int.from_bytes(packet[-check.size :], "little")
