"""TCP for asyncio, by its own transports, which every event loop of every platform has."""

from __future__ import annotations

import asyncio
import contextlib
import socket
from collections.abc import Callable
from typing import cast

from stagewire.errors import TransportLost
from stagewire.links.link import FLUSH, AsyncLink
from stagewire.links.loss import CLOSED, because, stalled
from stagewire.links.readiness import has_input
from stagewire.links.settings import LineSettings
from stagewire.links.tcp_address import (
    HUNG_UP,
    Beginning,
    address_of,
    connect_refusal,
    set_options,
    stop_sending,
    unknown_host,
)

__all__ = ["AsyncTcpLink", "open_async_tcp"]


async def open_async_tcp(url: str, settings: LineSettings) -> AsyncTcpLink:
    """Connect to ``socket://HOST:PORT``.

    Raises :class:`~stagewire.errors.LinkOpenError`.
    """
    host, port = address_of(url)
    try:
        async with asyncio.timeout(settings.open_timeout):
            connection = await _connect(host, port)
        try:
            set_options(connection, settings.stall_timeout)
        except OSError:  # where the other end has hung up by now, macOS takes no options
            connection.close()
            raise
    except socket.gaierror as error:
        raise unknown_host(url, host, error) from error
    except OSError as error:
        raise connect_refusal(url, error, settings.open_timeout) from error
    link = AsyncTcpLink(url, connection, settings.stall_timeout)
    await asyncio.get_running_loop().create_connection(lambda: link, sock=connection)
    return link


async def _connect(host: str, port: int) -> socket.socket:
    """Return a socket that is connected, and does not block; raises what the last address raised."""
    loop = asyncio.get_running_loop()
    try:  # a number needs nobody to ask, and so no thread of the loop's
        numeric = socket.AI_NUMERICHOST
        found = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=numeric)
    except socket.gaierror:
        found = await loop.getaddrinfo(host, port, type=socket.SOCK_STREAM)
    failure: OSError = OSError(f"{host} has no address")
    for family, kind, protocol, _, address in found:
        connection = socket.socket(family, kind, protocol)
        connection.setblocking(False)
        try:
            await loop.sock_connect(connection, address)
        except OSError as error:
            connection.close()
            failure = error
        except BaseException:
            connection.close()
            raise
        else:
            return connection
    raise failure


class AsyncTcpLink(AsyncLink, asyncio.Protocol):
    """A connection; it is also what asyncio calls when something happens on it.

    :param connection: its socket, which the transport owns.
    :param stall_timeout: seconds after which a line that takes nothing is gone.
    """

    def __init__(self, url: str, connection: socket.socket, stall_timeout: float) -> None:
        self.url = url
        self._socket = connection
        self._stall_timeout = stall_timeout
        self._loop = asyncio.get_running_loop()
        self._ended: asyncio.Future[None] = self._loop.create_future()
        self._stall: asyncio.TimerHandle | None = None
        self._why = ""
        self._beginning = Beginning()
        self._received: Callable[[bytes], None] | None = None
        self._lost: Callable[[TransportLost], None] | None = None
        self._transport: asyncio.Transport

    def start(
        self, received: Callable[[bytes], None], lost: Callable[[TransportLost], None]
    ) -> None:
        """Call back from now on; see :meth:`.AsyncLink.start`."""
        self._received, self._lost = received, lost
        if self._why:
            self._loop.call_soon(self._say_lost)
        else:
            self._transport.resume_reading()

    def write(self, data: bytes) -> None:
        """Send bytes; see :meth:`.AsyncLink.write`."""
        if self._why:
            raise self._beginning.lost(self.url, self._why)
        self._transport.write(data)

    def write_now(self, data: bytes) -> None:
        """Send what is taken at once; see :meth:`.AsyncLink.write_now`."""
        if not self._why and not self._transport.get_write_buffer_size():
            with contextlib.suppress(OSError, ValueError):
                self._socket.send(data)

    def has_unread(self) -> bool:
        """Say whether something came that was not passed on; see :meth:`.AsyncLink.has_unread`."""
        return not self._why and has_input(self._socket.fileno())

    async def close(self) -> None:
        """Send what is kept, and hang up; see :meth:`.AsyncLink.close`."""
        self._why, self._lost = CLOSED, None
        self._transport.close()
        try:
            await asyncio.wait((self._ended,), timeout=FLUSH)
        finally:
            if not self._ended.done():
                self._transport.abort()
        await self._ended  # set in the next round of the loop

    # As asyncio sees it

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Keep what comes in the system until :meth:`start`, and hear at once when something is not taken."""
        self._transport = cast("asyncio.Transport", transport)
        self._transport.pause_reading()
        self._transport.set_write_buffer_limits(high=0)

    def data_received(self, data: bytes) -> None:
        """Pass on what came."""
        self._beginning.add(data)
        if self._received is not None and not self._why:
            self._received(data)

    def connection_lost(self, exc: Exception | None) -> None:
        """Say that the line is gone, unless it was closed by this side."""
        self.resume_writing()
        stop_sending(self._socket)  # which is closed when this returns
        if not self._ended.done():
            self._ended.set_result(None)
        self._beginning.was_reset = isinstance(exc, ConnectionError)
        self._why = self._why or (because(exc) if exc else HUNG_UP)
        self._say_lost()

    def pause_writing(self) -> None:
        """Watch whether what is kept becomes less."""
        self._watch(self._transport.get_write_buffer_size())

    def resume_writing(self) -> None:
        """Watch no more: everything was taken."""
        if self._stall is not None:
            self._stall.cancel()
            self._stall = None

    def _watch(self, kept: int) -> None:
        self._stall = self._loop.call_later(self._stall_timeout, self._look, kept)

    def _look(self, kept: int) -> None:
        now = self._transport.get_write_buffer_size()
        if now < kept:
            self._watch(now)
        else:
            self._why = self._why or stalled(self._stall_timeout)
            self._transport.abort()

    def _say_lost(self) -> None:
        if self._lost is not None:
            say, self._lost = self._lost, None
            say(self._beginning.lost(self.url, self._why))
