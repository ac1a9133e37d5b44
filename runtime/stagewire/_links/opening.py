"""From a URL to an open link: the kind of link for each scheme.

=========================  ==================================================================================
``socket://HOST:PORT``     TCP: :mod:`stagewire._links.tcp`
``usb://SERIAL_NUMBER``    the port of the controller with this number: :mod:`stagewire._links.usb`
a scheme of another        the module that the package registers under the entry point group
package                    ``stagewire.links``, with ``open_link(url, settings)`` and
                           ``async open_async_link(url, settings)``
everything else            pyserial: ports by name, ``rfc2217://``, ``loop://``, ``spy://`` …
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
    """Open a link for threads.

    :param url: a port such as ``/dev/ttyUSB0`` or ``COM3``, or a URL such as ``socket://127.0.0.1:4001``. A
        :class:`.Link` object is returned unchanged.
    :param options: the settings of :class:`.LinkSettings`.

    Raises :class:`~stagewire.errors.LinkOpenError`, with the reason and what to do, and the errors of
    :class:`.LinkSettings`.
    """
    settings = LinkSettings.of(options)
    if isinstance(url, Link):
        return url
    scheme = _scheme_of(url, AsyncLink)
    if scheme == "usb":
        url, scheme = _port_of(url), ""
    if scheme == "socket":
        from stagewire._links.tcp import open_tcp

        return open_tcp(url, settings)
    if scheme and (module := _module_for(scheme, url)) is not None:
        link: Link = module.open_link(url, settings)
        return link
    from stagewire._links.serial_link import open_serial

    return open_serial(url, settings)


async def open_async_link(url: str | AsyncLink, **options: object) -> AsyncLink:
    """Open a link for the running event loop; see :func:`open_link`."""
    settings = LinkSettings.of(options)
    if isinstance(url, AsyncLink):
        return url
    scheme = _scheme_of(url, Link)
    if scheme == "usb":
        url, scheme = _port_of(url), ""
    if scheme == "socket":
        from stagewire._links.async_descriptor import open_async_tcp

        return await open_async_tcp(url, settings)
    if scheme and (module := _module_for(scheme, url)) is not None:
        link: AsyncLink = await module.open_async_link(url, settings)
        return link
    from stagewire._links.serial_link import open_async_serial

    return await open_async_serial(url, settings)


def _port_of(url: str) -> str:
    """Return the name of the port of a ``usb://`` URL."""
    from stagewire._links.usb import number_in, port_with

    name: str = port_with(number_in(url) or "").device
    return name


def _scheme_of(url: object, other: type) -> str:
    """Return the scheme in lower case; an empty string for the name of a port."""
    if isinstance(url, other):
        theirs, ours = ("asyncio", "threads") if other is AsyncLink else ("threads", "asyncio")
        raise BadValueError(f"{url!r} is a link for {theirs}; expected a link for {ours}")
    if not isinstance(url, str):
        raise BadValueError(
            f"a link is opened by a URL or the name of a port, a string, not {url!r}"
        )
    if not url.strip():
        raise LinkOpenError(
            "the URL is empty; give a port such as /dev/ttyUSB0 or COM3, "
            "or a URL such as socket://127.0.0.1:4001"
        )
    found = _SCHEME.match(url)
    return found[1].lower() if found else ""


def _module_for(scheme: str, url: str) -> ModuleType | None:
    """Return the module that opens links of a scheme; None if no installed package has one."""
    from importlib import metadata  # slow to import and not needed for ports and TCP

    entries = tuple(metadata.entry_points(group=_ENTRY_POINTS, name=scheme))
    if not entries:
        return None
    if len({entry.value for entry in entries}) > 1:
        brought = ", ".join(sorted({entry.value for entry in entries}))
        raise LinkOpenError(
            f"{url} cannot be opened: several packages provide {scheme}:// links: {brought}; "
            "uninstall all but one"
        )
    try:
        module: ModuleType = entries[0].load()
    except Exception as error:  # importing a third-party package may raise anything
        raise LinkOpenError(
            f"{url} cannot be opened: {scheme}:// links are provided by {entries[0].value}, "
            f"which cannot be imported: {error}"
        ) from error
    return module
