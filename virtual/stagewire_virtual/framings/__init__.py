"""Framings for virtual controllers: one module for each ``framing.kind`` in ``protocol.yaml``.

:class:`~stagewire_virtual.framings.framing.Framing` is the interface that virtual controllers, their faults
and their recordings use.
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
    """Return the framing of a protocol; the base class, without frames, for an unknown kind."""
    for kind, framing in FRAMINGS.items():
        if isinstance(protocol, kind):
            return framing(protocol)
    return Framing(protocol)
