"""Protocols, their messages, and what carries a message: frames, commands and packets.

A generated package has one :class:`Protocol` of its framing (:class:`FramedProtocol`,
:class:`CommandProtocol` or :class:`PacketProtocol`); :func:`load_protocol` finds those that are installed.
"""

from __future__ import annotations

from stagewire._lazy import lazy

TYPE_CHECKING = False
if TYPE_CHECKING:
    from stagewire._codec.flags import Bit as Bit
    from stagewire._codec.flags import Enumeration as Enumeration
    from stagewire._codec.flags import Flags as Flags
    from stagewire._codec.message import Direction as Direction
    from stagewire._codec.message import Layout as Layout
    from stagewire._codec.message import Message as Message
    from stagewire._codec.protocol import Protocol as Protocol
    from stagewire._codec.protocol import available_protocols as available_protocols
    from stagewire._codec.protocol import load_protocol as load_protocol
    from stagewire._codec.protocol import usable_protocols as usable_protocols
    from stagewire._framings.header.frame import Frame as Frame
    from stagewire._framings.header.message import DATA_FLAG as DATA_FLAG
    from stagewire._framings.header.message import HEADER_SIZE as HEADER_SIZE
    from stagewire._framings.header.message import MAXIMUM_PACKET as MAXIMUM_PACKET
    from stagewire._framings.header.message import FramedMessage as FramedMessage
    from stagewire._framings.header.message import UndecidedMessage as UndecidedMessage
    from stagewire._framings.header.message import UndocumentedMessage as UndocumentedMessage
    from stagewire._framings.header.protocol import FramedProtocol as FramedProtocol
    from stagewire._framings.packet.packet import Packet as Packet
    from stagewire._framings.packet.packet import PacketMessage as PacketMessage
    from stagewire._framings.packet.protocol import PacketProtocol as PacketProtocol
    from stagewire._framings.packet.shape import PARTS as PARTS
    from stagewire._framings.packet.shape import Check as Check
    from stagewire._framings.packet.shape import Crc as Crc
    from stagewire._framings.packet.shape import Shape as Shape
    from stagewire._framings.packet.shape import Sum as Sum
    from stagewire._framings.packet.shape import Xor as Xor
    from stagewire._framings.slots.command import SLOTS as SLOTS
    from stagewire._framings.slots.command import Command as Command
    from stagewire._framings.slots.command import Reply as Reply
    from stagewire._framings.slots.command import SetupCommand as SetupCommand
    from stagewire._framings.slots.frame import FORMS as FORMS
    from stagewire._framings.slots.frame import CommandFrame as CommandFrame
    from stagewire._framings.slots.protocol import CommandProtocol as CommandProtocol

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

if not TYPE_CHECKING:  # else any name would be taken for one of these
    __getattr__ = lazy(
        __name__,
        {
            "_codec.protocol": "Protocol available_protocols load_protocol usable_protocols",
            "_codec.message": "Direction Layout Message",
            "_codec.flags": "Bit Enumeration Flags",
            "_framings.header.message": (
                "DATA_FLAG HEADER_SIZE MAXIMUM_PACKET FramedMessage UndecidedMessage "
                "UndocumentedMessage"
            ),
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
