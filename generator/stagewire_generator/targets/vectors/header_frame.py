"""The bytes of a frame that begins with a header."""

from __future__ import annotations

from typing import Final

from stagewire_generator.model import Message, Protocol
from stagewire_generator.targets.vectors.wire import greatest_but

__all__ = [
    "ANNOUNCED",
    "MOST",
    "SIZE",
    "addresses",
    "data_frame",
    "header_frame",
    "id_of",
    "unknown_id",
]

SIZE: Final = 6  # bytes of the header
MOST: Final = 255  # bytes of the longest packet
ANNOUNCED: Final = 0x80  # the bit of the destination that says that a packet follows


def header_frame(id: int, param1: int, param2: int, dest: int, source: int) -> bytes:
    """Return a header that no packet follows."""
    return id.to_bytes(2, "little") + bytes((param1, param2, dest, source))


def data_frame(
    id: int, packet: bytes, dest: int, source: int, declared: int | None = None
) -> bytes:
    """Return a header and its packet; ``declared`` is said of the packet in the place of its length."""
    length = len(packet) if declared is None else declared
    head = id.to_bytes(2, "little") + length.to_bytes(2, "little")
    return head + bytes((dest | ANNOUNCED, source)) + packet


def id_of(message: Message) -> int:
    """Return the id of a message that has one."""
    assert message.id is not None
    return message.id


def unknown_id(protocol: Protocol) -> int:
    """Return an id that no message has."""
    unknown = greatest_but((message.id for message in protocol.messages), 2)
    assert unknown is not None  # no document names 65536 messages
    return unknown


def addresses(protocol: Protocol, message: Message) -> tuple[int, int]:
    """Return destination and source of a message on its way between the host and the last of the devices."""
    host, device = protocol.framing["host"], protocol.framing["devices"][-1]
    return (host, device) if message.direction == "to_host" else (device, host)
