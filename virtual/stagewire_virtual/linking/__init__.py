"""``virtual://``: lines to controllers in this process, in memory and in real time.

:func:`stagewire.links.open_link` opens ``virtual://TDC001?stage=Z8&seed=1`` here, by the entry point
``virtual`` of ``stagewire.links``; :mod:`stagewire_virtual.linking.urls` says what a URL may hold. Each
opening makes a new controller, which ends with its line.

A controller here lives when somebody looks: what it did meanwhile, it has done at the right times.
"""

from __future__ import annotations

from stagewire.links import LineSettings
from stagewire_virtual.linking.asynchronous import AsyncVirtualLink
from stagewire_virtual.linking.stepped import SteppedLink
from stagewire_virtual.linking.synchronous import VirtualLink
from stagewire_virtual.linking.urls import blueprint_of

__all__ = ["AsyncVirtualLink", "SteppedLink", "VirtualLink", "open_async_link", "open_link"]


def open_link(url: str, settings: LineSettings) -> VirtualLink:
    """Make the controller of a URL, and a line to it; ``settings`` are those of wires, and not looked at.

    Raises :class:`~stagewire.errors.LinkOpenError` with all that is wrong with the URL.
    """
    return VirtualLink(url, blueprint_of(url).make)


async def open_async_link(url: str, settings: LineSettings) -> AsyncVirtualLink:
    """Do as :func:`open_link` does, for the event loop that is running."""
    return await AsyncVirtualLink.open(url, blueprint_of(url).make)
