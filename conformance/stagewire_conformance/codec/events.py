"""The events of all framers by the names that the testee protocol has for them.

Text it does not know: what a testee cuts is in one format. Recorded sessions have it.
"""

from __future__ import annotations

from stagewire.commands import (
    BadCommandLength,
    CommandReceived,
    ReplyReceived,
    TextReceived,
    UnknownCommand,
)
from stagewire.framing import BadLength, Event, Garbage, Received, Undocumented, Unknown
from stagewire.packets import BadPacketLength, PacketReceived, UnknownPacket

__all__ = ["EVENT_NAMES"]

EVENT_NAMES: dict[type[Event], str] = {
    Received: "message",
    CommandReceived: "message",
    ReplyReceived: "message",
    PacketReceived: "message",
    Undocumented: "undocumented",
    Unknown: "unknown",
    UnknownCommand: "unknown",
    UnknownPacket: "unknown",
    BadLength: "bad_length",
    BadCommandLength: "bad_length",
    BadPacketLength: "bad_length",
    Garbage: "garbage",
    TextReceived: "text",
}
