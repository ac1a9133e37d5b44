"""Framers: bytes in, events out, without any input or output.

There is one framer for each kind of framing: :class:`Framer` for frames with a header of six bytes,
:class:`CommandFramer` and :class:`ReplyDecoder` for commands without a header, and :class:`PacketFramer` for
packets. A protocol makes the framer that it needs. Streams are compared after :func:`join_garbage`.
``docs/framing.md`` has the rules and their reasons.
"""

from __future__ import annotations

from stagewire._lazy import lazy

TYPE_CHECKING = False
if TYPE_CHECKING:
    from stagewire._codec.events import Event as Event
    from stagewire._codec.events import Garbage as Garbage
    from stagewire._codec.events import join_garbage as join_garbage
    from stagewire._framings.header.frame import BadLength as BadLength
    from stagewire._framings.header.frame import DecodableEvent as DecodableEvent
    from stagewire._framings.header.frame import FrameEvent as FrameEvent
    from stagewire._framings.header.frame import Received as Received
    from stagewire._framings.header.frame import Undocumented as Undocumented
    from stagewire._framings.header.frame import Unknown as Unknown
    from stagewire._framings.header.framer import Framer as Framer
    from stagewire._framings.header.table import End as End
    from stagewire._framings.header.table import Forms as Forms
    from stagewire._framings.header.table import FramingTable as FramingTable
    from stagewire._framings.packet.framer import PacketFramer as PacketFramer
    from stagewire._framings.packet.packet import BadPacketLength as BadPacketLength
    from stagewire._framings.packet.packet import PacketReceived as PacketReceived
    from stagewire._framings.packet.packet import UnknownPacket as UnknownPacket
    from stagewire._framings.slots.frame import BadCommandLength as BadCommandLength
    from stagewire._framings.slots.frame import CommandReceived as CommandReceived
    from stagewire._framings.slots.frame import TextReceived as TextReceived
    from stagewire._framings.slots.frame import UnknownCommand as UnknownCommand
    from stagewire._framings.slots.framer import CommandFramer as CommandFramer
    from stagewire._framings.slots.replies import ReplyDecoder as ReplyDecoder
    from stagewire._framings.slots.replies import ReplyReceived as ReplyReceived
    from stagewire._framings.slots.streams import HostListener as HostListener
    from stagewire._framings.slots.streams import ReplyListener as ReplyListener
    from stagewire._framings.slots.streams import host_framer as host_framer

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
    "host_framer",
    "join_garbage",
]

__path__: list[str] = []  # modules of 0.1 below this name; see stagewire._deprecated

if not TYPE_CHECKING:  # else any name would be taken for one of these
    __getattr__ = lazy(
        __name__,
        {
            "_codec.events": "Event Garbage join_garbage",
            "_framings.header.table": "End Forms FramingTable",
            "_framings.header.frame": (
                "BadLength DecodableEvent FrameEvent Received Undocumented Unknown"
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
