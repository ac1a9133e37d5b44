"""The documents of two registries beside that of the protocol itself: the overlays."""

from __future__ import annotations

from stagewire_generator.change.comparison import NOWHERE, Comparison
from stagewire_generator.model import Protocol

__all__ = ["compare_overlays"]


def compare_overlays(comparison: Comparison, old: Protocol, new: Protocol) -> None:
    """Compare which overlays there are, and what each says of its document.

    What an overlay adds or replaces is reported where it shows.
    """
    names = ([overlay.name for overlay in protocol.overlays] for protocol in (old, new))
    comparison.attribute(NOWHERE, "overlays", "document", *names)
    before = {overlay.name: overlay for overlay in old.overlays}
    for overlay in new.overlays:
        if overlay.name in before:
            where = {"overlay": overlay.name}
            comparison.attributes(where, before[overlay.name], overlay)
