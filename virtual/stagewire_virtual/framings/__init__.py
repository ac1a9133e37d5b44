"""Framings, as virtual controllers see them: one module each, named as ``framing.kind`` in ``protocol.yaml``.

All that a virtual controller, its faults and its recordings ask of a framing is in
:class:`~stagewire_virtual.framings.framing.Framing`.
"""

from __future__ import annotations

from typing import Final

from stagewire.protocols import CommandProtocol, FramedProtocol, PacketProtocol, Protocol
from stagewire_virtual.framings.framing import Framing
from stagewire_virtual.framings.header import HeaderFraming
from stagewire_virtual.framings.packet import PacketFraming
from stagewire_virtual.framings.slots import SlotsFraming

FRAMINGS: Final[dict[type[Protocol], type[Framing]]] = {
    FramedProtocol: HeaderFraming,
    CommandProtocol: SlotsFraming,
    PacketProtocol: PacketFraming,
}


def framing_of(protocol: Protocol) -> Framing:
    """Return the framing of a protocol; one without frames where it is framed in no known way."""
    for kind, framing in FRAMINGS.items():
        if isinstance(protocol, kind):
            return framing(protocol)
    return Framing(protocol)
