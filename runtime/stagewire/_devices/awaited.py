"""Calls for asyncio: the lines that the shared coroutines wait for there."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Generator
from contextlib import AbstractAsyncContextManager
from typing import TYPE_CHECKING, Any, Generic, TypeVar, cast
from typing import Protocol as TypingProtocol

from stagewire._codec.message import Message
from stagewire._codec.protocol import Protocol
from stagewire._devices.connection import Connection
from stagewire._devices.line import ClosedSession, OnDone, heard_from
from stagewire._devices.opening import link_options, session_options
from stagewire._devices.spot import CONTROLLER
from stagewire._links.link import AsyncLink
from stagewire._links.opening import open_async_link
from stagewire._sessions.asynchronous import AsyncCommandSession, AsyncFramedSession
from stagewire._sessions.exchange import Exchange
from stagewire._sessions.options import Ends
from stagewire.errors import ReplyTimeoutError

__all__ = ["CommandLine", "FramedLine", "Opening", "open_session"]

S = TypeVar("S")


class _Held(AbstractAsyncContextManager[None]):
    """Keeps other tasks out while it is entered."""

    def __init__(self, lock: asyncio.Lock, what: str, seconds: float) -> None:
        self._lock = lock
        self._what = what
        self._seconds = seconds

    async def __aenter__(self) -> None:
        if not self._lock.locked():
            await self._lock.acquire()
            return
        try:
            async with asyncio.timeout(self._seconds):
                await self._lock.acquire()
        except TimeoutError:
            raise ReplyTimeoutError(
                f"{self._what} was not sent: another call of it has been under way for {self._seconds:.3g} s"
            ) from None

    async def __aexit__(self, *error: object) -> None:
        self._lock.release()


class _Locks:
    """A lock for each key that was ever used."""

    def __init__(self) -> None:
        self._locks: dict[object, asyncio.Lock] = {}

    def lock(self, key: object, what: str, seconds: float) -> _Held:
        """Keep other tasks out of what has the same key."""
        return _Held(self._locks.setdefault(key, asyncio.Lock()), what, seconds)


class FramedLine(_Locks):
    """A session of frames for asyncio.

    :param session: that is open.
    :param telling: the messages that :meth:`heard` gives.
    :param guest: whether the line is another device's.
    """

    def __init__(
        self, session: AsyncFramedSession, telling: tuple[type[Message], ...], guest: bool = False
    ) -> None:
        super().__init__()
        self.session = session
        self._guest = guest
        self.now: Callable[[], float] = session.now
        self._heard = session.subscribe(telling, limit=64) if telling else None

    async def ask(self, message: Any, replies: Any, address: int, seconds: float) -> Message:
        """See :class:`~stagewire._devices.line.GuardedLink`; so are all others."""
        return (await self.session.ask(message, replies, address, seconds)).message

    async def send(self, message: Any, address: int, seconds: float) -> None:
        await self.session.send(message, address, seconds)

    async def begin(
        self, message: Any, ends: Ends, address: int, seconds: float, on_done: OnDone
    ) -> Exchange:
        return await self.session.begin(message, ends, address, seconds, on_done)

    async def wait(self, exchange: Exchange, seconds: float | None) -> Message:
        message: Message = (await self.session.wait(exchange, seconds)).message
        return message

    async def halt(
        self, message: Any, ends: Ends | None, address: int, seconds: float
    ) -> Message | None:
        frame = await self.session.halt(message, ends, address, seconds)
        return None if frame is None else frame.message

    async def pause(self, seconds: float) -> None:
        await self.session.pause(seconds)

    async def settled(self, address: int, channel: int | None) -> None:
        self.session.settled(address, channel)

    async def keep_alive(self, message: Any, addresses: tuple[int, ...]) -> None:
        self.session.keep_alive(message, addresses)

    async def tell(self, address: int, **context: str) -> None:
        self.session.tell(address, **context)

    def heard(self) -> list[tuple[int, Message]]:
        return heard_from(self._heard)

    async def close(self) -> None:
        if not self._guest:
            await self.session.close()
            return
        if self._heard is not None:
            self._heard.close()
        self.session = cast(AsyncFramedSession, ClosedSession(self.session.url))


class CommandLine(_Locks):
    """A session of commands for asyncio; an address is an axis, or the controller itself.

    :param session: that is open.
    """

    def __init__(self, session: AsyncCommandSession) -> None:
        super().__init__()
        self.session = session
        self.now: Callable[[], float] = session.now

    async def ask(self, message: Any, replies: Any, address: int, seconds: float) -> Message:
        """See :class:`~stagewire._devices.line.GuardedLink`; so are all others."""
        return await self.session.ask(message, address, seconds)

    async def send(self, message: Any, address: int, seconds: float) -> None:
        await self.session.send(message, None if address == CONTROLLER else address, seconds)

    async def halt(
        self, message: Any, ends: Ends | None, address: int, seconds: float
    ) -> Message | None:
        await self.session.halt(message, address, seconds)
        return None

    async def pause(self, seconds: float) -> None:
        await self.session.pause(seconds)

    async def text(self, line: str, seconds: float) -> str:
        return await self.session.text(line, seconds)

    def heard(self) -> list[tuple[int, Message]]:
        return []

    async def close(self) -> None:
        await self.session.close()


async def open_session(
    kind: Callable[..., S],
    protocol: Protocol,
    link: str | AsyncLink,
    connection: Connection,
    **more: object,
) -> S:
    """Open a line, and a session on it, as the user chose.

    Raises :class:`~stagewire.errors.LinkOpenError`, and what the session refuses.
    """
    options = session_options(connection)
    opened = await open_async_link(link, **link_options(connection))
    try:
        return kind(
            protocol,
            opened,
            options=options,
            log=connection.next_log(),
            unit=connection.unit.name,
            **more,
        )
    except BaseException:
        await opened.close()
        raise


class _Opened(TypingProtocol):
    """A device that is not open yet."""

    async def _connect(self) -> None: ...

    async def close(self) -> None:
        """Close it."""


D = TypeVar("D", bound=_Opened)


class Opening(Generic[D]):
    """A controller that is about to be opened: await it, or enter it by ``async with``.

    :param device: not open yet.
    """

    def __init__(self, device: D) -> None:
        self._device = device

    if not TYPE_CHECKING:  # which knows it already

        def __getattr__(self, name: str) -> Any:
            raise AttributeError(
                f"it is not open yet and has no {name}: await it, as in `tdc = await TDC001.open(...)`, or "
                "enter it by `async with`"
            )

        def __enter__(self) -> D:
            raise TypeError(
                "it is opened by `async with`, or by `await`; `with` is for the classes outside aio"
            )

        def __exit__(self, *error: object) -> None:
            raise NotImplementedError  # nothing was entered

    async def _open(self) -> D:
        await self._device._connect()
        return self._device

    def __await__(self) -> Generator[Any, Any, D]:
        return self._open().__await__()

    async def __aenter__(self) -> D:
        return await self._open()

    async def __aexit__(self, *error: object) -> None:
        await self._device.close()
