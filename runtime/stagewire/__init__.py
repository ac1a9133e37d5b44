"""Stagewire: what generated protocol packages stand on.

The runtime knows no message of any protocol. It cuts streams into frames (:mod:`stagewire.framing`),
carries messages (:mod:`stagewire.message`, :mod:`stagewire.frame`), finds protocols
(:mod:`stagewire.protocol`), converts units exactly (:mod:`stagewire.quantities`) and says what went
wrong (:mod:`stagewire.errors`).
"""

from stagewire.errors import StagewireError
from stagewire.flags import Bit, Flags
from stagewire.frame import Frame
from stagewire.framing import End, Framer
from stagewire.message import Message
from stagewire.protocol import Protocol, available_protocols, load_protocol
from stagewire.quantities import Scale, Stage, UnknownScale

__all__ = [
    "Bit",
    "End",
    "Flags",
    "Frame",
    "Framer",
    "Message",
    "Protocol",
    "Scale",
    "Stage",
    "StagewireError",
    "UnknownScale",
    "available_protocols",
    "load_protocol",
]

__version__ = "0.1.0"
