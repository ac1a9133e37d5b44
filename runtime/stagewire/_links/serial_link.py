"""Links through pyserial. This module, and with it pyserial, is imported when the first one is opened."""

from __future__ import annotations

import asyncio
import os
from functools import partial

from stagewire._links.async_descriptor import AsyncDescriptorLink
from stagewire._links.descriptor import DescriptorLink
from stagewire._links.link import HUNG_UP, AsyncLink, Link, LinkSettings
from stagewire._links.serial_port import (
    Port,
    at_once,
    forgetting,
    has_descriptor,
    in_loop,
    opening,
)


def open_serial(url: str, settings: LinkSettings) -> Link:
    """Open a port, or a URL of pyserial, for threads.

    Raises :class:`~stagewire.errors.LinkOpenError`.
    """
    port = at_once(opening(url, settings))
    if not has_descriptor(port):
        from stagewire._links.pumped import PumpedLink

        return PumpedLink(url, port)
    descriptor = port.fileno()
    return DescriptorLink(
        url,
        descriptor,
        partial(os.read, descriptor),
        partial(os.write, descriptor),
        lambda: at_once(forgetting(port)),
        HUNG_UP,
        settings.stall_timeout,
    )


async def open_async_serial(url: str, settings: LinkSettings) -> AsyncLink:
    """Open a port, or a URL of pyserial, for the running event loop.

    Raises :class:`~stagewire.errors.LinkOpenError`.
    """
    if "://" in url:  # over a network, opening waits for the other end
        from stagewire._links.pumped import AsyncPumpedLink

        return AsyncPumpedLink(url, await _opened_in_thread(url, settings))
    port = await in_loop(opening(url, settings))
    if not has_descriptor(port):
        from stagewire._links.pumped import AsyncPumpedLink

        return AsyncPumpedLink(url, port)
    descriptor = port.fileno()
    return AsyncDescriptorLink(
        url,
        descriptor,
        partial(os.read, descriptor),
        partial(os.write, descriptor),
        lambda: in_loop(forgetting(port)),
        HUNG_UP,
        settings.stall_timeout,
    )


async def _opened_in_thread(url: str, settings: LinkSettings) -> Port:
    thread = asyncio.get_running_loop().run_in_executor(None, at_once, opening(url, settings))
    try:
        return await asyncio.shield(thread)
    except asyncio.CancelledError:
        thread.add_done_callback(_close_unwanted)
        raise


def _close_unwanted(thread: asyncio.Future[Port]) -> None:
    """Close a port that was opened after the caller was cancelled."""
    if not thread.cancelled() and thread.exception() is None:
        thread.result().close()
