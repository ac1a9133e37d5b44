"""Links for asyncio: on a POSIX descriptor that the event loop can watch, and TCP.

TCP uses asyncio's own transports, which all event loops on all platforms have.
"""

from __future__ import annotations

import asyncio
import contextlib
import socket
from collections.abc import Awaitable, Callable
from typing import cast

from stagewire._links.descriptor import CHUNK, has_input
from stagewire._links.link import CLOSED, FLUSH, AsyncLink, LinkSettings, because, lost, stalled
from stagewire._links.tcp import (
    HUNG_UP,
    Beginning,
    address_of,
    connect_refusal,
    set_options,
    stop_sending,
    unknown_host,
)
from stagewire.errors import TransportLostError


class AsyncDescriptorLink(AsyncLink):
    """A link on a non-blocking descriptor, without a thread and without polling.

    :param url: the link, for people.
    :param descriptor: the descriptor that the loop watches.
    :param take: reads at most this many bytes; ``b""`` means that the other end has closed the link.
    :param give: writes as much as possible without waiting, and returns how much.
    :param shut: closes the descriptor; called once.
    :param gone: the meaning of ``b""``, in words.
    :param stall_timeout: seconds without progress in writing after which the link is lost.
    """

    def __init__(
        self,
        url: str,
        descriptor: int,
        take: Callable[[int], bytes],
        give: Callable[[bytes], int],
        shut: Callable[[], Awaitable[None]],
        gone: str,
        stall_timeout: float,
    ) -> None:
        self.url = url
        self._descriptor = descriptor
        self._take = take
        self._give = give
        self._shut = shut
        self._gone = gone
        self._stall_timeout = stall_timeout
        self._loop = asyncio.get_running_loop()
        self._kept = bytearray()  # not accepted by the system yet
        self._empty: asyncio.Future[None] | None = None  # done when nothing is kept
        self._stall: asyncio.TimerHandle | None = None
        self._why = ""
        self._received: Callable[[bytes], None] | None = None
        self._lost: Callable[[TransportLostError], None] | None = None

    def start(
        self, received: Callable[[bytes], None], lost: Callable[[TransportLostError], None]
    ) -> None:
        """Start the callbacks; see :meth:`.AsyncLink.start`."""
        self._received, self._lost = received, lost
        if self._why:
            self._loop.call_soon(self._say_lost)
        else:
            self._loop.add_reader(self._descriptor, self._readable)

    def write(self, data: bytes) -> None:
        """Send bytes; see :meth:`.AsyncLink.write`."""
        if self._why:
            raise lost(self.url, self._why)
        if self._kept:
            self._kept += data
            return
        sent = self._write_some(data)
        if self._why:
            raise lost(self.url, self._why)
        if sent < len(data):
            self._kept += data[sent:]
            self._loop.add_writer(self._descriptor, self._writable)
            self._watch()

    def write_now(self, data: bytes) -> None:
        """Send as much as possible without waiting; see :meth:`.AsyncLink.write_now`."""
        if not self._why and not self._kept:
            with contextlib.suppress(OSError):
                self._give(data)

    def has_unread(self) -> bool:
        """Return whether there are bytes that were not passed on; see :meth:`.AsyncLink.has_unread`."""
        return not self._why and has_input(self._descriptor)

    async def close(self) -> None:
        """Send the kept bytes and close the port; see :meth:`.AsyncLink.close`."""
        if self._why == CLOSED:
            return
        self._lost = None
        try:
            if self._kept:
                self._empty = self._loop.create_future()
                await asyncio.wait((self._empty,), timeout=FLUSH)
        finally:
            self._end(CLOSED)
            await self._shut()

    # Called by the loop

    def _readable(self) -> None:
        try:
            data = self._take(CHUNK)
        except BlockingIOError:
            return
        except OSError as error:
            self._end(because(error))
            return
        if not data:
            self._end(self._gone)
        elif self._received is not None:
            self._received(data)

    def _writable(self) -> None:
        sent = self._write_some(bytes(self._kept))
        if not sent:
            return
        del self._kept[:sent]
        if self._kept:
            self._watch()
        else:
            self._wrote_all()

    def _write_some(self, data: bytes) -> int:
        try:
            return self._give(data)
        except BlockingIOError:
            return 0
        except OSError as error:
            self._end(because(error))
            return 0

    def _watch(self) -> None:
        """Restart the stall timeout after progress in writing."""
        if self._stall is not None:
            self._stall.cancel()
        self._stall = self._loop.call_later(
            self._stall_timeout, self._end, stalled(self._stall_timeout)
        )

    def _wrote_all(self) -> None:
        self._loop.remove_writer(self._descriptor)
        if self._stall is not None:
            self._stall.cancel()
            self._stall = None
        if self._empty is not None and not self._empty.done():
            self._empty.set_result(None)

    def _end(self, why: str) -> None:
        """Stop using the descriptor, and report the loss unless this side closed the link."""
        if self._why and why != CLOSED:
            return
        if not self._why:
            self._loop.remove_reader(self._descriptor)
            self._kept.clear()
            self._wrote_all()
            self._loop.call_soon(self._say_lost)
        self._why = why

    def _say_lost(self) -> None:
        if self._lost is not None:
            say, self._lost = self._lost, None
            say(lost(self.url, self._why))


async def open_async_tcp(url: str, settings: LinkSettings) -> AsyncTcpLink:
    """Connect to ``socket://HOST:PORT``.

    Raises :class:`~stagewire.errors.LinkOpenError`.
    """
    host, port = address_of(url)
    try:
        async with asyncio.timeout(settings.open_timeout):
            connection = await _connect(host, port)
        try:
            set_options(connection, settings.stall_timeout)
        except OSError:  # macOS refuses options if the other end has hung up
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
    """Return a connected, non-blocking socket; raise the error of the last address."""
    loop = asyncio.get_running_loop()
    try:  # a numeric address needs no lookup, hence no thread
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
    """A TCP connection, which is also its asyncio protocol.

    :param connection: its socket, which the transport owns.
    :param stall_timeout: seconds without progress in writing after which the link is lost.
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
        self._lost: Callable[[TransportLostError], None] | None = None
        self._transport: asyncio.Transport

    def start(
        self, received: Callable[[bytes], None], lost: Callable[[TransportLostError], None]
    ) -> None:
        """Start the callbacks; see :meth:`.AsyncLink.start`."""
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
        """Send as much as possible without waiting; see :meth:`.AsyncLink.write_now`."""
        if not self._why and not self._transport.get_write_buffer_size():
            with contextlib.suppress(OSError, ValueError):
                self._socket.send(data)

    def has_unread(self) -> bool:
        """Return whether there are bytes that were not passed on; see :meth:`.AsyncLink.has_unread`."""
        return not self._why and has_input(self._socket.fileno())

    async def close(self) -> None:
        """Send the kept bytes and hang up; see :meth:`.AsyncLink.close`."""
        self._why, self._lost = CLOSED, None
        self._transport.close()
        try:
            await asyncio.wait((self._ended,), timeout=FLUSH)
        finally:
            if not self._ended.done():
                self._transport.abort()
        await self._ended  # set in the next iteration of the loop

    # Called by asyncio

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Pause reading until :meth:`start`, and ask to be called as soon as anything stays unsent."""
        self._transport = cast("asyncio.Transport", transport)
        self._transport.pause_reading()
        self._transport.set_write_buffer_limits(high=0)

    def data_received(self, data: bytes) -> None:
        """Pass on received bytes."""
        self._beginning.add(data)
        if self._received is not None and not self._why:
            self._received(data)

    def connection_lost(self, exc: Exception | None) -> None:
        """Report the loss, unless this side closed the link."""
        self.resume_writing()
        stop_sending(self._socket)  # asyncio closes it when this returns
        if not self._ended.done():
            self._ended.set_result(None)
        self._beginning.was_reset = isinstance(exc, ConnectionError)
        self._why = self._why or (because(exc) if exc else HUNG_UP)
        self._say_lost()

    def pause_writing(self) -> None:
        """Start watching whether the amount of kept bytes decreases."""
        self._watch(self._transport.get_write_buffer_size())

    def resume_writing(self) -> None:
        """Stop watching: everything was sent."""
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
