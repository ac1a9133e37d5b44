"""From a URL to an open link: which kind of link opens it.

=========================  ==================================================================================
``socket://HOST:PORT``     TCP, of our own: :mod:`stagewire._links.tcp`
a scheme of other          what a package names under the entry point group ``stagewire.links``: a module with
packages                   ``open_link(url, settings)`` and ``async open_async_link(url, settings)``
everything else            pyserial: ports by their name, ``rfc2217://``, ``loop://``, ``spy://`` …
=========================  ==================================================================================
"""

from __future__ import annotations

import re
from types import ModuleType

from stagewire._links.link import AsyncLink, Link, LinkSettings
from stagewire.errors import BadValueError, LinkOpenError

_ENTRY_POINTS = "stagewire.links"
_SCHEME = re.compile(r"([A-Za-z][A-Za-z0-9+.-]*)://")


def open_link(url: str | Link, **options: object) -> Link:
    """Open a line for threads.

    :param url: a port such as ``/dev/ttyUSB0`` or ``COM3``, or a URL such as ``socket://127.0.0.1:4001``. A
        line that was made already is returned as it is.
    :param options: those of :class:`.LinkSettings`.

    Raises :class:`~stagewire.errors.LinkOpenError`, which says why and what to do, and what
    :class:`.LinkSettings` raises.
    """
    settings = LinkSettings.of(options)
    if isinstance(url, Link):
        return url
    scheme = _scheme_of(url, AsyncLink)
    if scheme == "socket":
        from stagewire._links.tcp import open_tcp

        return open_tcp(url, settings)
    if scheme and (module := _module_for(scheme, url)) is not None:
        link: Link = module.open_link(url, settings)
        return link
    from stagewire._links.serial_link import open_serial

    return open_serial(url, settings)


async def open_async_link(url: str | AsyncLink, **options: object) -> AsyncLink:
    """Open a line for the event loop that is running; see :func:`open_link`."""
    settings = LinkSettings.of(options)
    if isinstance(url, AsyncLink):
        return url
    scheme = _scheme_of(url, Link)
    if scheme == "socket":
        from stagewire._links.async_descriptor import open_async_tcp

        return await open_async_tcp(url, settings)
    if scheme and (module := _module_for(scheme, url)) is not None:
        link: AsyncLink = await module.open_async_link(url, settings)
        return link
    from stagewire._links.serial_link import open_async_serial

    return await open_async_serial(url, settings)


def _scheme_of(url: object, other: type) -> str:
    """Return the scheme in small letters; nothing for the name of a port."""
    if isinstance(url, other):
        theirs, ours = ("asyncio", "threads") if other is AsyncLink else ("threads", "asyncio")
        raise BadValueError(f"{url!r} is a line for {theirs}; a line for {ours} is needed here")
    if not isinstance(url, str):
        raise BadValueError(
            f"a line is opened by a URL or the name of a port, as text, not {url!r}"
        )
    if not url.strip():
        raise LinkOpenError(
            "an empty text names no line; give a port such as /dev/ttyUSB0 or COM3, "
            "or a URL such as socket://127.0.0.1:4001"
        )
    found = _SCHEME.match(url)
    return found[1].lower() if found else ""


def _module_for(scheme: str, url: str) -> ModuleType | None:
    """Return the module that opens lines of a scheme, or None if no installed package has one."""
    from importlib import metadata  # slow to import, and not needed for ports and TCP

    entries = tuple(metadata.entry_points(group=_ENTRY_POINTS, name=scheme))
    if not entries:
        return None
    if len({entry.value for entry in entries}) > 1:
        brought = ", ".join(sorted({entry.value for entry in entries}))
        raise LinkOpenError(
            f"{url} cannot be opened: several packages bring lines {scheme}://: {brought}; "
            "uninstall all but one"
        )
    try:
        module: ModuleType = entries[0].load()
    except Exception as error:  # whatever the import of another package may raise
        raise LinkOpenError(
            f"{url} cannot be opened: lines {scheme}:// are brought by {entries[0].value}, "
            f"which cannot be imported: {error}"
        ) from error
    return module
