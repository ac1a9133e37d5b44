"""Framers: bytes in, events out, without I/O.

There is one framer per kind of framing: :class:`Framer` for frames with a header of six bytes,
:class:`CommandFramer` and :class:`ReplyDecoder` for commands without a header, and :class:`PacketFramer` for
packets. A protocol object makes the framer it needs. Compare streams after :func:`join_garbage`.
``docs/explanation/framing.md`` explains the rules.
"""

from __future__ import annotations

from stagewire._lazy import lazy

TYPE_CHECKING: bool = False
if TYPE_CHECKING:
    from stagewire._codec.events import Event, Garbage, join_garbage
    from stagewire._framings.header.frame import (
        BadLength,
        DecodableEvent,
        FrameEvent,
        Received,
        Undocumented,
        Unknown,
        UnknownSubMessage,
    )
    from stagewire._framings.header.framer import Framer
    from stagewire._framings.header.table import End, Forms, FramingTable
    from stagewire._framings.packet.framer import PacketFramer
    from stagewire._framings.packet.packet import BadPacketLength, PacketReceived, UnknownPacket
    from stagewire._framings.slots.frame import (
        BadCommandLength,
        CommandReceived,
        TextReceived,
        UnknownCommand,
    )
    from stagewire._framings.slots.framer import CommandFramer
    from stagewire._framings.slots.replies import ReplyDecoder, ReplyReceived
    from stagewire._framings.slots.streams import HostListener, ReplyListener, host_framer

__all__ = [
    "BadCommandLength",
    "BadLength",
    "BadPacketLength",
    "CommandFramer",
    "CommandReceived",
    "DecodableEvent",
    "End",
    "Event",
    "Forms",
    "FrameEvent",
    "Framer",
    "FramingTable",
    "Garbage",
    "HostListener",
    "PacketFramer",
    "PacketReceived",
    "Received",
    "ReplyDecoder",
    "ReplyListener",
    "ReplyReceived",
    "TextReceived",
    "Undocumented",
    "Unknown",
    "UnknownCommand",
    "UnknownPacket",
    "UnknownSubMessage",
    "host_framer",
    "join_garbage",
]

__path__: list[str] = []  # modules of 0.1 below this name; see stagewire._deprecated

if not TYPE_CHECKING:  # otherwise type checkers would accept any name
    __getattr__, __dir__ = lazy(
        __name__,
        {
            "_codec.events": "Event Garbage join_garbage",
            "_framings.header.table": "End Forms FramingTable",
            "_framings.header.frame": (
                "BadLength DecodableEvent FrameEvent Received Undocumented Unknown UnknownSubMessage"
            ),
            "_framings.header.framer": "Framer",
            "_framings.slots.frame": (
                "BadCommandLength CommandReceived TextReceived UnknownCommand"
            ),
            "_framings.slots.framer": "CommandFramer",
            "_framings.slots.replies": "ReplyDecoder ReplyReceived",
            "_framings.slots.streams": "HostListener ReplyListener host_framer",
            "_framings.packet.packet": "BadPacketLength PacketReceived UnknownPacket",
            "_framings.packet.framer": "PacketFramer",
        },
    )
