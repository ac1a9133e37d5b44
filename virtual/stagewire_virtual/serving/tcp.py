"""A virtual controller on a TCP port."""

from __future__ import annotations

import asyncio
import os
from typing import cast

from stagewire_virtual.errors import ServingError
from stagewire_virtual.serving.link import FarEnd, Observer, Run, ServedLink


class TcpLink(ServedLink):
    """A link on a TCP port, like a controller on a serial-to-network adapter.

    A serial line has one host: a second one is turned away immediately, with a note. The next host finds the
    controller as the previous one left it.

    :param host: the address to listen on, as a number or a name.
    :param port: the port; 0 for a free one, which :attr:`url` contains.
    """

    def __init__(
        self,
        far_end: FarEnd,
        host: str,
        port: int,
        *,
        label: str = "",
        observer: Observer | None = None,
    ) -> None:
        super().__init__(far_end, label=label, observer=observer)
        self.host = host
        self.port = port
        self._server: asyncio.Server | None = None
        self._connection: _Connection | None = None

    @property
    def url(self) -> str:
        """The URL of the port, such as ``socket://127.0.0.1:4001``."""
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"socket://{host}:{self.port}"

    @property
    def connected(self) -> bool:
        """Whether a host is connected."""
        return self._connection is not None

    async def open(self, run: Run) -> None:
        """Start listening; see :meth:`ServedLink.open`."""
        self._run = run
        loop = asyncio.get_running_loop()
        try:
            # asyncio sets TCP_NODELAY, so each frame is sent immediately.
            self._server = await loop.create_server(lambda: _Connection(self), self.host, self.port)
        except (OSError, OverflowError) as error:
            raise ServingError(
                f"cannot listen on {self.host}:{self.port}: {_reason(error)}; "
                "choose an address of this machine and a free port (0 finds one)"
            ) from error
        self.port = self._server.sockets[0].getsockname()[1]

    async def close(self) -> None:
        """Close the port and the connection."""
        if self._server is not None:
            self._server.close()
            self._server = None
        self.disconnect()

    def disconnect(self) -> None:
        """Break the connection; the host may connect again.

        Bytes that the system has accepted still arrive; bytes that are still buffered here are lost.
        """
        if self._connection is not None:
            self._connection.transport.abort()
            self._connection = None

    def _backlog(self) -> int:
        return self._connection.transport.get_write_buffer_size() if self._connection else 0

    def _put(self, data: bytes) -> None:
        if self._connection is not None:
            self._connection.transport.write(data)


class _Connection(asyncio.Protocol):
    """The connection of a host."""

    transport: asyncio.Transport

    def __init__(self, link: TcpLink) -> None:
        self._link = link

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self.transport = cast(asyncio.Transport, transport)
        if self._link._server is None:  # the port was closed in the meantime
            self.transport.abort()
            return
        if self._link._connection is not None:
            self._link.note(
                f"{self._peer()} turned away: a line has one host, and "
                f"{self._link._connection._peer()} is connected"
            )
            self.transport.abort()
            return
        self._link._connection = self
        self._link.note(f"{self._peer()} connected")
        self._link._greet()

    def data_received(self, data: bytes) -> None:
        if self._link._connection is self:
            self._link._take(data)

    def eof_received(self) -> None:
        self._leave()

    def connection_lost(self, error: Exception | None) -> None:
        self._leave()

    def _leave(self) -> None:
        if self._link._connection is self:
            self._link._connection = None
            self._link.note(f"{self._peer()} left")

    def _peer(self) -> str:
        peer = self.transport.get_extra_info("peername")
        return f"{peer[0]}:{peer[1]}" if peer else "a host"


def _reason(error: OSError | OverflowError) -> str:
    """Return the system's reason without the error number and the address, which the message already has."""
    if not isinstance(error, OSError) or error.errno is None:
        return str(error)
    # The error number of an unknown host name is negative and not one of the system's.
    known = os.strerror(error.errno) if error.errno > 0 else error.strerror or str(error)
    return known.lower()
