"""The operations of the testee on one protocol: decode, encode and stream, from and to JSON values.

There is one codec for each framing, in a module that is named as ``framing.kind`` in ``protocol.yaml``. Which
one serves a protocol follows from its class.
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
"""The name that the testee protocol and captures have for every event of every framer."""

KEYS = {
    operation: {
        key: kind for codec in _CODECS.values() for key, kind in codec.keys[operation].items()
    }
    for operation in FramedCodec.keys
}
"""What a request may say beside what every protocol needs, whichever the protocol is."""


@cache
def codec_of(protocol: Protocol) -> Codec:
    """Return the codec for a protocol.

    Raises :class:`~stagewire.errors.UnsupportedError` for a protocol that is framed in no known way.
    """
    for cls, codec in _CODECS.items():
        if isinstance(protocol, cls):
            return codec(protocol)
    raise UnsupportedError(f"there is no codec for {protocol!r}, a {type(protocol).__name__}")
