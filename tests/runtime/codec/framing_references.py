"""The framing rules of commands and packets a second time: as the generator reads streams for the vectors.

The generator imports nothing of the runtime, and its readers are written to be simple: every position is
looked at anew, and nothing is remembered. The framers are compared with them.
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
    """What some bytes are: ``message``, ``unknown``, ``bad_length``, ``garbage`` or ``pending``."""

    kind: str
    raw: bytes


def pieces(framer: Any, chunks: Iterable[bytes], longest: int) -> list[Piece]:
    """Return what a framer makes of a stream in chunks, as the references say it.

    :param longest: more bytes than may ever be pending.
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

    :param lengths: id -> the lengths that the layouts of its message have.
    """
    messages = [
        SimpleNamespace(id=id, layouts=[SimpleNamespace(length=length) for length in layouts])
        for id, layouts in lengths.items()
    ]
    return PacketReader(SimpleNamespace(framing=framing_of(shape), messages=messages))


def reference_check(check: Check, data: bytes) -> int:
    """Return a check of some bytes: that of a packet in which they are the payload."""
    shape = Shape(
        order=("start", "length", "id", "payload", "check"), start=b"\0", length=1, id=1,
        counts=("payload",), maximum=0xFF, check=check, covers=("payload",),
    )  # fmt: skip
    packet = Packets(SimpleNamespace(framing=framing_of(shape))).pack(0, 0, data)
    return int.from_bytes(packet[-check.size :], "little")
