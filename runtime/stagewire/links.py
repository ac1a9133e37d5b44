"""Links to controllers: bytes in, bytes out, for threads and for asyncio.

A link does not interpret the bytes. ``docs/reference/links.md`` lists the URLs.
"""

from __future__ import annotations

from stagewire._lazy import lazy

TYPE_CHECKING: bool = False
if TYPE_CHECKING:
    from stagewire._links.link import AsyncClosing, AsyncLink, Closing, Link, LinkSettings
    from stagewire._links.opening import open_async_link, open_link

    LineSettings = LinkSettings  # the name of 0.1

__all__ = [
    "AsyncClosing",
    "AsyncLink",
    "Closing",
    "Link",
    "LinkSettings",
    "open_async_link",
    "open_link",
]

__path__: list[str] = []  # modules of 0.1 below this name; see stagewire._deprecated

if not TYPE_CHECKING:  # otherwise type checkers would accept any name
    __getattr__, __dir__ = lazy(
        __name__,
        {
            "_links.link": "AsyncClosing AsyncLink Closing Link LinkSettings LinkSettings=LineSettings",
            "_links.opening": "open_async_link open_link",
        },
    )
