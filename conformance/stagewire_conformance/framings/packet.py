"""The codec of packet protocols, which may have an address but need no context."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, ClassVar

from stagewire.errors import MissingFieldError
from stagewire.framing import BadPacketLength, Event, PacketReceived, UnknownPacket
from stagewire.protocols import Layout, Packet, PacketProtocol
from stagewire_conformance.framings.base import Codec, Json, Part, Reader
from stagewire_conformance.notation import from_hex


class PacketCodec(Codec):
    """Codec for packets. The protocol determines whether packets have an address."""

    protocol: PacketProtocol
    keys: ClassVar[Mapping[str, Mapping[str, type]]] = {
        "decode": {},
        # the address is checked by the codec, like fields
        "encode": {"form": str, "fields": dict, "extra": str, "address": object},
        "stream": {"end": str},  # packets look alike at both ends
    }
    events: ClassVar[Mapping[type[Event], str]] = {
        PacketReceived: "message",
        UnknownPacket: "unknown",
        BadPacketLength: "bad_length",
    }

    def keys_of(self, operation: str) -> Mapping[str, type]:
        """Return the keys of an operation, without an address if packets have none."""
        keys = super().keys_of(operation)
        if self.protocol.shape.address:
            return keys
        return {key: kind for key, kind in keys.items() if key != "address"}

    def decoded(self, raw: bytes, request: Mapping[str, Any]) -> Packet:
        """Decode exactly one packet."""
        return self.protocol.decode(raw)

    def received(self, event: Event, request: Mapping[str, Any]) -> Packet | None:
        """Return the packet in an event."""
        return event.packet if isinstance(event, PacketReceived) else None

    def reader(self, request: Mapping[str, Any]) -> Reader:
        """Return a framer. It is the same for both ends of the line."""
        return self.protocol.framer()

    def encode(self, request: Mapping[str, Any]) -> bytes:
        """Encode a packet."""
        name, form = request["message"], request.get("form")
        layout = self.protocol.message_class(name, form).layout
        fields = self._from_json(layout, request.get("fields", {}))
        message: Any = self.protocol.build(name, fields, form)
        if self.protocol.shape.address and "address" not in request:
            raise MissingFieldError(f"{name} lacks address")
        extra = from_hex(request.get("extra") or "")
        return Packet(message, request.get("address"), extra).encode()

    def field_place(self, layout: Layout, offset: int, size: int) -> range:
        """Return the position of a field in a packet."""
        payload = self.protocol.shape.place("payload", 0).start
        return super().field_place(layout, payload + offset, size)

    def frame_parts(self, layout: Layout, raw: bytes) -> Iterator[Part]:
        """Yield the parts of a packet except its payload."""
        shape = self.protocol.shape
        for part in shape.order:
            if part != "payload":
                yield part, shape.place(part, len(raw) - shape.least)

    def reading(self, wanted: Mapping[str, Any]) -> Json:
        """Return an empty mapping: a packet needs no context."""
        return {}
