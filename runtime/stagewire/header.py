"""The header that every frame begins with: six bytes, and a bit that says that a packet follows.

Bytes 0 and 1 are the message id, 2 and 3 two parameters or the length of the packet, 4 the destination
and 5 the source.
"""

from __future__ import annotations

TYPE_CHECKING = False  # typing would take half of the time of an import
if TYPE_CHECKING:
    from typing import Final

__all__ = ["DATA_FLAG", "HEADER_SIZE", "MAXIMUM_PACKET"]

HEADER_SIZE: Final = 6
DATA_FLAG: Final = 0x80
"""The bit of the destination that announces a packet."""
MAXIMUM_PACKET: Final = 255
"""Bytes of the longest packet."""
