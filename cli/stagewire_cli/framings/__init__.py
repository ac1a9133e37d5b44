"""Framings for the command: one module for each ``framing.kind`` in ``protocol.yaml``.

A module has the task of ``stagewire decode`` with its hints, and the parts that ``stagewire encode`` adds to
the fields.
"""

from __future__ import annotations

from typing import Final

from stagewire.protocols import CommandProtocol, FramedProtocol, PacketProtocol, Protocol
from stagewire_cli.framings.framing import Framing
from stagewire_cli.framings.header import HeaderFraming
from stagewire_cli.framings.packet import PacketFraming
from stagewire_cli.framings.slots import SlotsFraming

FRAMINGS: Final[dict[type[Protocol], type[Framing]]] = {
    FramedProtocol: HeaderFraming,
    CommandProtocol: SlotsFraming,
    PacketProtocol: PacketFraming,
}


def framing_of(protocol: Protocol) -> Framing | None:
    """Return the framing of a protocol; None if the command does not support it."""
    for kind, framing in FRAMINGS.items():
        if isinstance(protocol, kind):
            return framing(protocol)
    return None
