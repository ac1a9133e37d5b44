"""A server that shares the line of a controller: one client writes, any number listen.

Only whole frames of a client reach the line, so a client that dies cannot leave half a frame there, and a
stop never lands inside a frame. The registry states which messages stop, start motions or keep a controller
alive.
"""

from __future__ import annotations

import asyncio
import sys
import time
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from typing import Any, Final, NamedTuple, cast

from stagewire.capture import Heading
from stagewire.devices import link_options
from stagewire.errors import TransportLostError
from stagewire.framing import Event
from stagewire.links import AsyncLink, LinkSettings, open_async_link
from stagewire.protocols import Direction, Protocol
from stagewire_cli.output import printable
from stagewire_cli.selection import Selection
from stagewire_cli.signals import signals
from stagewire_conformance.answers import message_of
from stagewire_conformance.framings import EVENT_NAMES

_ALIVE_EVERY: Final = 0.5  # seconds, as in sessions of the library
_BACKLOG: Final = 1 << 20  # unsent bytes of a listener that is too slow
_BROKEN: Final = ("garbage", "bad_length", "text")
_BITS_PER_BYTE: Final = 10  # on a serial line


class ClientFrame(NamedTuple):
    """A frame of a client.

    :param name: name of its message; empty if the registry does not have it.
    :param dest: address that it is for; None on a line with one controller.
    """

    raw: bytes
    name: str
    dest: int | None

    def __str__(self) -> str:
        return self.name or f"the unknown message {self.raw[:8].hex(' ')}"


class LineServer:
    """The line, its queue of frames, and its clients.

    :param link: the line, not started.
    :param protocol: its protocol.
    :param unit: name of the controller.
    :param keep_alive: returns the frame that keeps the controller at an address alive; None if it needs none.
    :param baudrate: bits per second of a serial line; 0 for lines that need no pacing.
    :param say: is given each line of the log.
    """

    def __init__(
        self,
        link: AsyncLink,
        protocol: Protocol,
        unit: str,
        keep_alive: Callable[[int], bytes] | None,
        baudrate: int,
        say: Callable[[str], object],
    ) -> None:
        self.say = say
        self.lost: asyncio.Future[TransportLostError] = asyncio.get_running_loop().create_future()
        """The reason why the line was lost."""
        self._link = link
        self._heading = Heading(protocol.name, unit)
        self._keep_alive = keep_alive
        self._baudrate = baudrate
        exchanges = {
            message["name"]: message["exchange"] for message in protocol.registry()["messages"]
        }
        self.motions = {name for name, exchange in exchanges.items() if exchange.get("halted_by")}
        self.stops = {stop for name in self.motions for stop in exchanges[name]["halted_by"]}
        self.alive = {name for name, exchange in exchanges.items() if exchange.get("keeps_alive")}
        self.updates = {name for name, exchange in exchanges.items() if exchange.get("starts")}
        self._queue: deque[ClientFrame] = deque()
        self._filled = asyncio.Event()
        self._clients: set[_Client] = set()
        self._holder: _Client | None = None
        self._kept_alive: set[int] = set()
        self._server: asyncio.Server | None = None

    async def run(self, host: str, port: int, listening: Callable[[int], object]) -> None:
        """Serve until the task is cancelled or the line is lost.

        :param listening: is called with the port, once clients can connect.

        Raises :class:`OSError` for an address that cannot be used.
        """
        loop = asyncio.get_running_loop()
        self._link.start(self._received, self.lost.set_result)
        self._server = await loop.create_server(lambda: _Client(self), host, port)
        listening(self._server.sockets[0].getsockname()[1])
        tasks = [asyncio.create_task(work) for work in (self._write(), self._stay_alive())]
        try:
            ends: list[asyncio.Future[Any]] = [self.lost, *tasks]
            await asyncio.wait(ends, return_when=asyncio.FIRST_COMPLETED)
            for task in tasks:
                if not task.done():
                    continue
                error = task.exception()
                if not isinstance(error, TransportLostError):
                    task.result()
                elif not self.lost.done():
                    self.lost.set_result(error)
        finally:
            self._server.close()
            with suppress(TransportLostError):
                for frame in self._queue:
                    if frame.name in self.stops:  # it must not wait for the pace of the line
                        self._link.write(frame.raw)
            for task in tasks:
                task.cancel()
            for client in tuple(self._clients):
                client.transport.close()

    # Lines of clients

    def reader(self) -> Any:
        """Return what cuts the bytes of a client into frames."""
        task = Selection(recorded=self._heading).task()
        reader = task.readers()[Direction.TO_CONTROLLER]

        def tell(event: Event) -> ClientFrame | None:
            if EVENT_NAMES[type(event)] in _BROKEN:
                return None
            decoded = task.found(event)
            name = "" if decoded is None else message_of(decoded).layout.message
            return ClientFrame(bytes(event.raw), name, getattr(decoded, "dest", None))

        return lambda data: [tell(event) for event in reader.feed(data)]

    def connected(self, client: _Client) -> None:
        """Note a new client, which listens until it sends."""
        self._clients.add(client)
        self.say(f"{client.name} connected")

    def left(self, client: _Client) -> None:
        """Forget a client; the line is free if it held it."""
        if client in self._clients:
            self._clients.remove(client)
            self.say(f"{client.name} left")
        if client is self._holder:
            self._holder = None
            self.say("the line is free; a motion that was started continues")

    def take(self, client: _Client, frame: ClientFrame) -> None:
        """Take a frame of a client, or refuse the client."""
        if frame.name in self.alive:
            self._keep(frame)
            return
        if frame.name in self.stops:
            self._stop(client, frame)
            return
        if self._holder is None:
            self._holder = client
            self.say(f"{client.name} holds the line")
        if client is not self._holder:
            self.refuse(client, f"it sent {frame}, but {self._holder.name} holds the line")
            return
        if frame.name in self.updates:
            self._keep(frame)
        self._queue.append(frame)
        self._filled.set()

    def _keep(self, frame: ClientFrame) -> None:
        if frame.dest is not None:
            self._kept_alive.add(frame.dest)

    def refuse(self, client: _Client, why: str) -> None:
        """Close the connection of a client, and drop its motions that wait."""
        if client is self._holder:
            self._queue = deque(frame for frame in self._queue if frame.name not in self.motions)
        self._clients.discard(client)
        self.say(f"{client.name} was disconnected: {why}")
        client.transport.abort()
        self.left(client)

    def _stop(self, client: _Client, frame: ClientFrame) -> None:
        """Let a stop overtake the frames that wait, and drop motions among them."""
        dropped = [waiting for waiting in self._queue if waiting.name in self.motions]
        kept = [waiting for waiting in self._queue if waiting.name not in self.motions]
        self._queue = deque([frame, *kept])
        self._filled.set()
        self.say(f"{client.name} stops: {frame}")
        for each in dropped:
            self.say(f"not sent, because of the stop: {each}")

    # The line

    def _received(self, data: bytes) -> None:
        for client in tuple(self._clients):
            if client.transport.get_write_buffer_size() > _BACKLOG:
                self.refuse(client, f"it has not read the last {_BACKLOG >> 20} MiB")
            else:
                client.transport.write(data)

    async def _write(self) -> None:
        while True:
            await self._filled.wait()
            while self._queue:
                raw = self._queue.popleft().raw
                self._link.write(raw)
                if self._baudrate:  # bytes in the buffer of the system could not be overtaken
                    await asyncio.sleep(len(raw) * _BITS_PER_BYTE / self._baudrate)
            self._filled.clear()

    async def _stay_alive(self) -> None:
        while True:
            await asyncio.sleep(_ALIVE_EVERY)
            if self._keep_alive is not None and self._clients:
                for address in sorted(self._kept_alive):
                    self._link.write(self._keep_alive(address))


class _Client(asyncio.Protocol):
    """The connection of a client."""

    transport: asyncio.Transport

    def __init__(self, server: LineServer) -> None:
        self._server = server
        self._cut = server.reader()
        self.name = ""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self.transport = cast(asyncio.Transport, transport)
        host, port, *_ = transport.get_extra_info("peername") or ("unknown", 0)
        self.name = f"[{host}]:{port}" if ":" in host else f"{host}:{port}"
        self._server.connected(self)

    def data_received(self, data: bytes) -> None:
        for frame in self._cut(data):
            if self.transport.is_closing():  # refused; a stop still gets through
                if frame is not None and frame.name in self._server.stops:
                    self._server.take(self, frame)
            elif frame is None:
                self._server.refuse(self, f"it sent invalid bytes: {data[:16].hex(' ')}")
            else:
                self._server.take(self, frame)

    def connection_lost(self, error: Exception | None) -> None:
        self._server.left(self)


def share(
    url: str, device: Any, host: str, port: int, baudrate: int | None
) -> TransportLostError | None:
    """Share the line at a URL until a signal, or until it is lost; return why it was lost.

    :param device: class of the controller.
    :param baudrate: of a serial line; None: the documented one.

    Raises :class:`~stagewire.errors.StagewireError` for a line that cannot be opened, and :class:`OSError`
    for an address that cannot be used.
    """
    return asyncio.run(_share(url, device, host, port, baudrate))


async def _share(
    url: str, device: Any, host: str, port: int, baudrate: int | None
) -> TransportLostError | None:
    unit, protocol = device.unit, device.facts.protocol
    options = link_options(protocol, baudrate=baudrate)

    def alive(address: int) -> bytes:
        raw: bytes = unit.keep_alive().pack(dest=address, source=protocol.host)
        return raw

    def listening(port: int) -> None:
        shown = f"[{host}]" if ":" in host else host
        _say(f"{unit.name} at {url} is shared on socket://{shown}:{port}; Ctrl-C ends")

    async with await open_async_link(url, **options) as link:
        is_serial = "://" not in url or url.startswith("usb://")
        server = LineServer(
            link,
            protocol,
            unit.name,
            alive if unit.keep_alive is not None else None,
            LinkSettings.of(options).baudrate if is_serial else 0,
            _say,
        )
        task = asyncio.create_task(server.run(host, port, listening))
        with signals(task.cancel), suppress(asyncio.CancelledError):
            await task
        return server.lost.result() if server.lost.done() else None


def _say(text: str) -> None:
    """Write a line of the log."""
    with suppress(OSError):
        print(f"{time.strftime('%H:%M:%S')}  {printable(text)}", file=sys.stderr, flush=True)
