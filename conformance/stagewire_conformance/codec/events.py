"""The events of all framers by the names that the testee protocol has for them.

Text it does not know: what a testee cuts is in one format. Recorded sessions have it.
"""

from __future__ import annotations

from stagewire.framing import (
    BadCommandLength,
    BadLength,
    BadPacketLength,
    CommandReceived,
    Event,
    Garbage,
    PacketReceived,
    Received,
    ReplyReceived,
    TextReceived,
    Undocumented,
    Unknown,
    UnknownCommand,
    UnknownPacket,
)

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
