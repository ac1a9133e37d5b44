"""Stagewire: the runtime of generated protocol packages.

The runtime knows no message of any protocol. Public are the names here and those of the modules
:mod:`~stagewire.protocols`, :mod:`~stagewire.framing`, :mod:`~stagewire.links`, :mod:`~stagewire.sessions`,
:mod:`~stagewire.devices`, :mod:`~stagewire.discovery`, :mod:`~stagewire.columns`, :mod:`~stagewire.capture`,
:mod:`~stagewire.quantities`, :mod:`~stagewire.errors` and, for generated code, :mod:`~stagewire.support`.
All others begin with an underscore, and may change in any release (``docs/reference/versioning.md``).
"""

from __future__ import annotations

from stagewire import _deprecated
from stagewire._codec.flags import Bit, Flags
from stagewire._codec.message import Message
from stagewire._codec.protocol import Protocol, available_protocols, load_protocol
from stagewire._framings.header.frame import Frame
from stagewire._framings.header.framer import Framer
from stagewire._framings.header.message import FramedMessage
from stagewire._framings.header.protocol import FramedProtocol
from stagewire._framings.header.table import End
from stagewire._lazy import lazy
from stagewire.errors import StagewireError

TYPE_CHECKING = False  # typing would take half of the time of an import
if TYPE_CHECKING:
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

if not TYPE_CHECKING:  # else any name would be taken for one of these
    __getattr__ = lazy(
        __name__, {"quantities": "Scale Stage UnknownScale", "discovery": "discover open"}
    )

_deprecated.install()
