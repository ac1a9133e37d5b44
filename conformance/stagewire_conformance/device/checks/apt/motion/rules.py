"""Rules that several kinds of moves hold a controller to."""

from __future__ import annotations

from typing import Final

MOTION_BITS: Final = ("status-bits-motion", "dc-status-bits-motion")
"""What the status says of a motor that moves, and of one that does not."""

COMPLETION: Final = (
    "move-no-response",
    "move-completed",
    "move-completed-status",
    "move-complete-when-settled",
    "settled-at-rest",
    "status-position",
    "dc-status-position",
    "dc-status-velocity",
    *MOTION_BITS,
)
"""What holds for every move to a target."""

APART: Final = (
    "slot-addressed-by-destination",
    "slot-source",
    "reply-addresses-swapped",
    "bays-are-single-channel",
    "module-channels",
    "dual-channel-idents",
)
"""What holds where several motors move."""
