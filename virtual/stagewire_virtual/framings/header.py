"""Frames with a header that contains the message id."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Any

from stagewire.framing import End, Event
from stagewire.protocols import FramedProtocol
from stagewire_virtual.framings.framing import (
    Abandon,
    Framing,
    ReplyReader,
    Share,
    StreamFramer,
    decoded,
)
from stagewire_virtual.instrument import Unit


class HeaderFraming(Framing):
    """The framing of a protocol whose frames have a header."""

    protocol: FramedProtocol

    def request_framer(self) -> tuple[StreamFramer, Abandon | None]:
        """Return a framer for the bytes of the host."""
        framer = self.protocol.framer(End.DEVICE)
        return framer, framer.abandon

    def reply_framer(self) -> StreamFramer:
        """Return a framer for the bytes of the controller."""
        return self.protocol.framer(End.HOST)

    def reply_reader(self, statuses: Collection[str | None]) -> ReplyReader:
        """Return a reader that is configured with the expected status block."""
        return _FrameReader(self.protocol, statuses)

    def message_name(self, raw: bytes) -> str | None:
        """Return the name of the message of a frame."""
        frame = decoded(self.protocol.decode, raw)
        return None if frame is None else frame.message.layout.message

    def shares(self, requests: Sequence[bytes], data: bytes, unit: Unit) -> list[Share]:
        """Assign frames to requests, the last frame first.

        An answer comes from the address of the request, and its message is one that answers the request.
        """
        unanswered: dict[tuple[str, int], list[int]] = {}
        for index, request in enumerate(requests):
            if (asked := decoded(self.protocol.decode, request)) is not None:
                exchange = unit.message(asked.message.layout.message).get("exchange") or {}
                for name in exchange.get("answered_by", ()):
                    unanswered.setdefault((name, asked.dest), []).append(index)
        found: list[Share] = []
        for event in reversed(self.protocol.framer(End.HOST).feed(data)):
            owner = len(requests) - 1
            if (said := decoded(self.protocol.decode, event.raw)) is not None:
                waiting = unanswered.get((said.message.layout.message, said.source))
                owner = waiting.pop() if waiting else owner
            found.append((len(event.raw), owner))
        return found

    def status_frame(self, unit: Unit) -> bytes | None:
        """Return the frame of the first status message that the unit can send periodically."""
        own = unit.facts.get("address")
        name = next((name for name in _unsolicited(unit) if name in unit.messages), None)
        if name is None or own is None:
            return None
        addresses = unit.registry["addresses"]
        source = addresses[own]["value"] if own in addresses else addresses["bays"]["first"]
        layout = self.protocol.message_class(name).layout
        fields = {field: int(field == "chan_ident") for field in layout.fields}
        message: Any = self.protocol.build(name, fields)
        raw: bytes = message.pack(addresses["host"]["value"], source)
        return raw


class _FrameReader(ReplyReader):
    """Decodes frames by their headers, and statuses by the given status blocks."""

    def __init__(self, protocol: FramedProtocol, statuses: Collection[str | None]) -> None:
        self._framer = protocol.framer(End.HOST)
        deciding = {cls.layout.when.get("status") for cls in protocol.messages}
        # With some quirks a controller sends address 0, or the address of the host, as its own.
        sources = {*protocol.devices, protocol.host, 0}
        for status in sorted(filter(None, deciding.intersection(statuses))):
            for source in sources:
                self._framer.tell(source, status=status)

    def read(self, data: bytes) -> list[Event]:
        return self._framer.feed(data)


def _unsolicited(unit: Unit) -> list[str]:
    """Return the messages that the unit can send periodically."""
    found: list[str] = []
    for entry in unit.registry["messages"]:
        exchange = entry.get("exchange") or {}
        if entry["name"] in unit.messages and "periodic_ms" in exchange:
            found += exchange.get("starts", ())
    return found
