"""Stagewire: what generated protocol packages stand on.

The runtime knows no message of any protocol. It cuts streams into frames (:mod:`stagewire.framing`),
carries messages (:mod:`stagewire.message`, :mod:`stagewire.frame`), reads commands that have no
header (:mod:`stagewire.commands`) and packets in a shape of their own (:mod:`stagewire.packets`), finds
protocols (:mod:`stagewire.protocol`) and controllers (:mod:`stagewire.discovery`), converts units exactly
(:mod:`stagewire.quantities`) and says what went wrong (:mod:`stagewire.errors`).
"""

from __future__ import annotations

from stagewire.errors import StagewireError
from stagewire.flags import Bit, Flags
from stagewire.frame import Frame
from stagewire.framed import FramedProtocol
from stagewire.framed_message import FramedMessage
from stagewire.framing import End, Framer
from stagewire.message import Message
from stagewire.protocol import Protocol, available_protocols, load_protocol

TYPE_CHECKING = False  # typing would take half of the time of an import
if TYPE_CHECKING:
    from typing import Any

    from stagewire.discovery import discover as discover
    from stagewire.discovery import open as open
    from stagewire.quantities import Scale, Stage, UnknownScale

__all__ = [
    "Bit",
    "End",
    "Flags",
    "Frame",
    "FramedMessage",
    "FramedProtocol",
    "Framer",
    "Message",
    "Protocol",
    "Scale",
    "Stage",
    "StagewireError",
    "UnknownScale",
    "available_protocols",
    "discover",
    "load_protocol",
    "open",
]

__version__ = "0.1.0"


def __getattr__(name: str) -> Any:
    """Import the exact fractions of quantities, and what finds controllers, when they are asked for."""
    if name in ("Scale", "Stage", "UnknownScale"):
        from stagewire import quantities

        return getattr(quantities, name)
    if name in ("discover", "open"):
        from stagewire import discovery

        return getattr(discovery, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
