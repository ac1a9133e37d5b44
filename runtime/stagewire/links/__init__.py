"""Lines to controllers: bytes in, bytes out, for threads and for asyncio.

A line knows nothing of frames, messages or controllers. ``docs/links.md`` says which URLs there are.
"""

from __future__ import annotations

from stagewire.links.link import AsyncLink, Link
from stagewire.links.opening import open_async_link, open_link
from stagewire.links.settings import LineSettings

__all__ = ["AsyncLink", "LineSettings", "Link", "open_async_link", "open_link"]
