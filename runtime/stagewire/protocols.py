"""Protocols, their messages, and the frames, commands and packets that carry messages.

A generated package has one :class:`Protocol`, which is a :class:`FramedProtocol`, a :class:`CommandProtocol`
or a :class:`PacketProtocol`, depending on its framing. :func:`load_protocol` loads an installed protocol by
name.
"""

from __future__ import annotations

from stagewire._lazy import lazy

TYPE_CHECKING: bool = False
if TYPE_CHECKING:
    from stagewire._codec.flags import Bit, Enumeration, Flags
    from stagewire._codec.message import Direction, Layout, Message
    from stagewire._codec.protocol import (
        Protocol,
        available_protocols,
        load_protocol,
        usable_protocols,
    )
    from stagewire._framings.header.counted import Counted, CountedMessage
    from stagewire._framings.header.frame import Frame
    from stagewire._framings.header.message import (
        DATA_FLAG,
        HEADER_SIZE,
        MAXIMUM_PACKET,
        FramedMessage,
        UndecidedMessage,
        UndocumentedMessage,
    )
    from stagewire._framings.header.protocol import FramedProtocol
    from stagewire._framings.packet.packet import Packet, PacketMessage
    from stagewire._framings.packet.protocol import PacketProtocol
    from stagewire._framings.packet.shape import PARTS, Check, Crc, Shape, Sum, Xor
    from stagewire._framings.slots.command import SLOTS, Command, Reply, SetupCommand
    from stagewire._framings.slots.frame import FORMS, CommandFrame
    from stagewire._framings.slots.protocol import CommandProtocol

__all__ = [
    "DATA_FLAG",
    "FORMS",
    "HEADER_SIZE",
    "MAXIMUM_PACKET",
    "PARTS",
    "SLOTS",
    "Bit",
    "Check",
    "Command",
    "CommandFrame",
    "CommandProtocol",
    "Counted",
    "CountedMessage",
    "Crc",
    "Direction",
    "Enumeration",
    "Flags",
    "Frame",
    "FramedMessage",
    "FramedProtocol",
    "Layout",
    "Message",
    "Packet",
    "PacketMessage",
    "PacketProtocol",
    "Protocol",
    "Reply",
    "SetupCommand",
    "Shape",
    "Sum",
    "UndecidedMessage",
    "UndocumentedMessage",
    "Xor",
    "available_protocols",
    "load_protocol",
    "usable_protocols",
]

if not TYPE_CHECKING:  # otherwise type checkers would accept any name
    __getattr__, __dir__ = lazy(
        __name__,
        {
            "_codec.protocol": "Protocol available_protocols load_protocol usable_protocols",
            "_codec.message": "Direction Layout Message",
            "_codec.flags": "Bit Enumeration Flags",
            "_framings.header.message": (
                "DATA_FLAG HEADER_SIZE MAXIMUM_PACKET FramedMessage UndecidedMessage "
                "UndocumentedMessage"
            ),
            "_framings.header.counted": "Counted CountedMessage",
            "_framings.header.frame": "Frame",
            "_framings.header.protocol": "FramedProtocol",
            "_framings.slots.command": "SLOTS Command Reply SetupCommand",
            "_framings.slots.frame": "FORMS CommandFrame",
            "_framings.slots.protocol": "CommandProtocol",
            "_framings.packet.shape": "PARTS Check Crc Shape Sum Xor",
            "_framings.packet.packet": "Packet PacketMessage",
            "_framings.packet.protocol": "PacketProtocol",
        },
    )
