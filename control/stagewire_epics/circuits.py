"""Connections of Channel Access clients.

Events reach a client before the answer to the put that caused them. caproto sends both independently, and
collects events for up to a second under load. After its put has completed, a client would then
read a position from before the end of the motion.

A client that breaks the protocol, floods the server or does not read loses its connection, without an effect
on other clients. With caproto alone, some of these would end the server or leave the connection open.
"""

from __future__ import annotations

import asyncio
import logging
import socket
import sys
from collections import Counter, deque
from collections.abc import Awaitable, Callable, Iterator
from contextlib import suppress
from typing import Any, Final

from caproto import (
    ClearChannelRequest,
    CreateChanRequest,
    ErrorResponse,
    EventAddRequest,
    WriteNotifyRequest,
    WriteNotifyResponse,
)
from caproto.asyncio.server import Context, VirtualCircuit
from caproto.asyncio.utils import _TransportWrapper
from caproto.server.common import DisconnectedCircuit

_log = logging.getLogger("stagewire")
_BACKLOG: Final = 10_000
"""Events that may wait for a client."""
_BATCH: Final = 200
"""Events that are sent together."""
_PATIENCE: Final = 0.5
"""Seconds that an answer waits for the events before it."""
_READING: Final = 30.0
"""Seconds in which a client must read what is sent to it."""
_SILENCE: Final = 60
"""Seconds of silence after which the network is asked whether a client is still there."""
_LONGEST: Final = 65_536
"""Bytes of the longest command of a client; values of records are much shorter."""
_DATAGRAM: Final = 2_048
"""Bytes of the longest datagram with searches; those of clients fit into a packet of Ethernet."""
_PUTS: Final = 1_000
"""Puts of a client that may be unfinished."""
_CHANNELS: Final = 10_000
"""Channels that a client may open."""
_MONITORS: Final = 100
"""Monitors of the same record that a client may have."""
_WAITING: Final = 1_024
"""Connections that may wait until they are accepted."""
_ACCEPTED: Final = 10
"""Connections that are accepted before other clients have their turn."""
_SPARE: Final = 64
"""Files that are kept for lines and searches, so that clients cannot use them up."""


class _Events:
    """The events that wait to be sent to a client: weak references, because caproto forgets old ones."""

    def __init__(self) -> None:
        self._waiting: deque[Callable[[], Any]] = deque()
        self._some = asyncio.Event()
        self._none = asyncio.Event()
        self._none.set()

    async def put(self, event: Callable[[], Any]) -> None:
        """Add an event. Raise :class:`OverflowError` if the client does not read."""
        if len(self._waiting) >= _BACKLOG:
            raise OverflowError("the client does not read its events")
        self._waiting.append(event)
        self._none.clear()
        self._some.set()

    async def take(self) -> list[Any]:
        """Wait for events and return them; call :meth:`sent` afterwards."""
        await self._some.wait()
        found = [self._waiting.popleft() for _ in range(min(_BATCH, len(self._waiting)))]
        if not self._waiting:
            self._some.clear()
        return [event for reference in found if (event := reference()) is not None]

    def sent(self) -> None:
        """Note that what was taken has been sent."""
        if not self._waiting:
            self._none.set()

    async def all_sent(self) -> None:
        """Wait until all events have been sent."""
        await self._none.wait()


class Circuit(VirtualCircuit):  # type: ignore[misc]
    """The connection of a client."""

    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        self.subscription_queue = _Events()
        self._loops: list[asyncio.Task[None]] = []
        self._monitors: Counter[int] = Counter()

    async def run(self) -> None:
        """Begin to serve the client."""
        self.write_event.set()
        self.events_on.set()
        for step in (self._answer, self._send_events):
            self._loops.append(asyncio.create_task(self._repeat(step)))

    async def _repeat(self, step: Callable[[], Awaitable[None]]) -> None:
        """Repeat a step until the client is lost or breaks the protocol."""
        try:
            while self.connected:
                await step()
        except Exception as error:
            await self.end(error)

    async def _answer(self) -> None:
        """Answer a command. Other clients have their turn after each."""
        response = await self._command_queue_iteration(await self.command_queue.get())
        if response is not None:
            await self.send(*response)
        await asyncio.sleep(0)

    async def _send_events(self) -> None:
        """Send a batch of events, without a delay."""
        events = await self.subscription_queue.take()
        wanted = {sub.subscriptionid for subs in self.subscriptions.values() for sub in subs}
        events = [event for event in events if event.subscriptionid in wanted]
        if events:
            await self.send(*events)
        self.subscription_queue.sent()

    async def _process_command(self, command: Any) -> Any:
        if isinstance(command, ClearChannelRequest):  # caproto would keep the subscriptions
            await self._cull_subscriptions(None, lambda sub: sub.channel.sid == command.sid)
        elif (problem := self._excess(command)) is not None:
            await self.end(OverflowError(problem))
            return None
        return await super()._process_command(command)

    def _excess(self, command: Any) -> str | None:
        """Return why a client may not have what it asks for."""
        if isinstance(command, CreateChanRequest) and len(self.circuit.channels) > _CHANNELS:
            return f"more than {_CHANNELS} channels are open"
        if isinstance(command, EventAddRequest):
            record = id(self._get_db_entry_from_command(command)[1])
            self._monitors[record] += 1
            if self._monitors[record] > _MONITORS:
                return f"more than {_MONITORS} monitors of a record"
        return None

    async def _cull_subscriptions(self, db_entry: Any, func: Callable[[Any], bool]) -> Any:
        removed = await super()._cull_subscriptions(db_entry, func)
        self._monitors.subtract(id(sub_spec.db_entry) for sub_spec, _ in removed)
        return removed

    async def _start_write_task(self, handle_write: Callable[[], Awaitable[None]]) -> None:
        """Begin to carry out a put; it continues if the client is lost, because it may be a stop."""

        async def put() -> None:
            try:
                await handle_write()
            except Exception as error:  # the answer cannot be sent
                await self.end(error)

        if len(self.tasks.tasks) >= _PUTS:
            await self.end(OverflowError(f"more than {_PUTS} puts are unfinished"))
        else:
            self.tasks.create(put())

    async def recv(self) -> None:
        """Receive commands."""
        await super().recv()
        if len(self.circuit._data) > _LONGEST:
            error = DisconnectedCircuit(f"a command is longer than {_LONGEST} bytes")
            await self.end(error)
            raise error

    async def send(self, *commands: Any) -> None:
        """Send commands; an answer to a put waits for the events before it."""
        if not self.connected:
            return
        if any(isinstance(one, (WriteNotifyResponse, ErrorResponse)) for one in commands):
            with suppress(TimeoutError):
                async with asyncio.timeout(_PATIENCE):
                    await self.context.subscription_queue.join()
                    await self.subscription_queue.all_sent()
        async with asyncio.timeout(_READING):
            await super().send(*(one for command in commands for one in _answers(command)))

    async def end(self, error: Exception) -> None:
        """End the connection."""
        if self.connected and not isinstance(error, DisconnectedCircuit):
            _log.debug("Channel Access: %s lost: %r", self.circuit.address, error)
        await self._on_disconnect()

    async def _on_disconnect(self) -> None:
        if not self.connected:
            return
        self.connected: bool = False
        for sub_spec, subs in self.subscriptions.items():
            await self.context.forget(sub_spec, subs)
        self.subscriptions.clear()
        self.client.writer.transport.abort()  # a client that does not read would keep it open
        for task in self._loops:
            if task is not asyncio.current_task():
                task.cancel()
        self._loops.clear()  # otherwise the memory is not free before a garbage collection
        await self.context.circuit_disconnected(self)


def _answers(command: Any) -> Iterator[Any]:
    """Yield a command; after an error of a put with an answer, also the answer, as the IOC of EPICS.

    The error carries the reason, and some clients wait for the answer.
    """
    yield command
    if isinstance(command, ErrorResponse):
        request = command.original_request
        if request.command == WriteNotifyRequest.ID:
            yield WriteNotifyResponse(
                request.data_type, request.data_count, command.status, request.parameter2
            )


class Circuits(Context):  # type: ignore[misc]
    """The server of a set of channels."""

    CircuitClass = Circuit

    async def server_accept_loop(self, sock: socket.socket) -> None:
        """Accept clients."""

        def accept(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
            client = _TransportWrapper(reader, writer)
            address = client.getpeername()
            if address is None or len(self.circuits) >= most:
                writer.transport.abort()
                return
            _probe_when_silent(writer.get_extra_info("socket"))
            self.server_tasks.create(self.tcp_handler(client, address))

        most = _raise_limit_of_files() - _SPARE
        server = await asyncio.start_server(accept, sock=sock, backlog=_ACCEPTED)
        sock.listen(_WAITING)
        try:
            await asyncio.Event().wait()
        finally:
            server.close()
            for circuit in list(self.circuits):
                await circuit.end(DisconnectedCircuit())

    async def _broadcaster_recv_datagram(self, data: bytes, address: Any) -> None:
        if (
            len(data) <= _DATAGRAM and not self.command_bundle_queue.full()
        ):  # clients repeat searches
            await super()._broadcaster_recv_datagram(data, address)

    async def subscription_queue_loop(self) -> None:
        """Distribute events to the connections that subscribe to them."""
        while True:
            update = await self.subscription_queue.get()
            try:
                await self._distribute(*update)
            finally:
                self.subscription_queue.task_done()

    async def _distribute(
        self, sub_specs: Any, metadata: Any, values: Any, flags: Any, only: Any
    ) -> None:
        """Distribute an event; commands of clients, such as stops, have their turn meanwhile."""
        for sub_spec in sub_specs:
            subs = (only,) if only else tuple(self.subscriptions.get(sub_spec, ()))
            for number, sub in enumerate(subs):
                if number % _BATCH == _BATCH - 1:
                    await asyncio.sleep(0)
                if not sub.circuit.connected:
                    continue
                try:
                    await self._subscription_queue_send(sub_spec, sub, metadata, values, flags)
                except Exception as error:
                    await sub.circuit.end(error)

    async def forget(self, sub_spec: Any, subs: Any) -> None:
        """Forget subscriptions of a client that is lost."""
        remaining = self.subscriptions[sub_spec]
        for sub in subs:
            remaining.remove(sub)
            self.last_dead_band.pop(sub, None)
            self.last_sync_edge_update.pop(sub, None)
        if not remaining:
            del self.subscriptions[sub_spec]
            await sub_spec.db_entry.unsubscribe(self.subscription_queue, sub_spec)


def _probe_when_silent(connection: socket.socket) -> None:
    """Make the system notice that the computer of a client is lost."""
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    if hasattr(socket, "TCP_KEEPIDLE"):
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_KEEPIDLE, _SILENCE)


def _raise_limit_of_files() -> int:
    """Let this process open as many files as the system allows, and return how many."""
    try:
        import resource
    except ImportError:  # Windows has no such limit
        return sys.maxsize
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    with suppress(ValueError, OSError):
        resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))
        soft = hard
    return soft
