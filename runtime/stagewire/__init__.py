"""Stagewire: the runtime of generated protocol packages.

The runtime contains no protocol: generated packages define the messages. The public names are those here and
in the modules :mod:`~stagewire.protocols`, :mod:`~stagewire.framing`, :mod:`~stagewire.links`,
:mod:`~stagewire.sessions`, :mod:`~stagewire.devices`, :mod:`~stagewire.discovery`, :mod:`~stagewire.columns`,
:mod:`~stagewire.capture`, :mod:`~stagewire.quantities`, :mod:`~stagewire.errors` and, for generated code,
:mod:`~stagewire.support`. All other modules begin with an underscore and may change in any release
(``docs/reference/versioning.md``).
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

TYPE_CHECKING: bool = False  # importing typing would double the import time
if TYPE_CHECKING:
    from stagewire._devices.dataframes import dataframe as dataframe
    from stagewire.devices import read_stages
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
    "dataframe",
    "discover",
    "load_protocol",
    "open",
    "read_stages",
]

__version__ = "0.1.0"

if not TYPE_CHECKING:  # otherwise type checkers would accept any name
    __getattr__, __dir__ = lazy(
        __name__,
        {
            "quantities": "Scale Stage UnknownScale",
            "devices": "read_stages",
            "discovery": "discover open",
            "_devices.dataframes": "dataframe",
        },
        "capture columns devices discovery errors framing links protocols quantities sessions support",
    )

_deprecated.install()
