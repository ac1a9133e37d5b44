"""The operations of the testee on one protocol: decode, encode and stream, with JSON values.

There is one codec for each framing, in a module named like ``framing.kind`` in ``protocol.yaml``. The class
of a protocol determines its codec.
"""

from __future__ import annotations

from functools import cache

from stagewire.errors import UnsupportedError
from stagewire.framing import Event
from stagewire.protocols import CommandProtocol, FramedProtocol, PacketProtocol, Protocol
from stagewire_conformance.framings.base import ENDS, EVENTS, Codec
from stagewire_conformance.framings.header import FramedCodec
from stagewire_conformance.framings.packet import PacketCodec
from stagewire_conformance.framings.slots import CommandCodec

__all__ = ["ENDS", "EVENT_NAMES", "KEYS", "Codec", "codec_of"]

_CODECS: dict[type[Protocol], type[Codec]] = {
    FramedProtocol: FramedCodec,
    CommandProtocol: CommandCodec,
    PacketProtocol: PacketCodec,
}

EVENT_NAMES: dict[type[Event], str] = EVENTS | {
    event: name for codec in _CODECS.values() for event, name in codec.events.items()
}
"""The events of all framers, with their names in the testee protocol and in captures."""

KEYS = {
    operation: {
        key: kind for codec in _CODECS.values() for key, kind in codec.keys[operation].items()
    }
    for operation in FramedCodec.keys
}
"""The optional keys of a request, for any protocol."""


@cache
def codec_of(protocol: Protocol) -> Codec:
    """Return the codec for a protocol.

    Raises :class:`~stagewire.errors.UnsupportedError` for a protocol with an unknown framing.
    """
    for cls, codec in _CODECS.items():
        if isinstance(protocol, cls):
            return codec(protocol)
    raise UnsupportedError(f"no codec supports {protocol!r}, a {type(protocol).__name__}")
