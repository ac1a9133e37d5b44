"""Calls for threads: the shared coroutines, on a line whose calls return when they are done."""

from __future__ import annotations

import threading
from collections.abc import Callable, Coroutine
from contextlib import AbstractAsyncContextManager
from typing import Any, TypeVar, cast

from stagewire._codec.message import Message
from stagewire._codec.protocol import Protocol
from stagewire._devices.connection import Connection
from stagewire._devices.line import ClosedSession, OnDone, heard_from
from stagewire._devices.opening import link_options, session_options
from stagewire._devices.spot import CONTROLLER
from stagewire._links.link import Link
from stagewire._links.opening import open_link
from stagewire._sessions.exchange import Exchange
from stagewire._sessions.options import Ends
from stagewire._sessions.synchronous import CommandSession, FramedSession
from stagewire.errors import ReplyTimeoutError

__all__ = ["CommandLine", "FramedLine", "open_session", "run"]

S = TypeVar("S")
T = TypeVar("T")


def run(coroutine: Coroutine[Any, Any, T]) -> T:
    """Run a coroutine that waits for nothing, as a plain call."""
    try:
        coroutine.send(None)
    except StopIteration as end:
        result: T = end.value
        return result
    coroutine.close()
    raise RuntimeError("a call for threads has waited for an event loop")  # pragma: no cover


class _Held(AbstractAsyncContextManager[None]):
    """Keeps other threads out while it is entered."""

    def __init__(self, lock: threading.Lock, what: str, seconds: float) -> None:
        self._lock = lock
        self._what = what
        self._seconds = seconds

    async def __aenter__(self) -> None:
        if not self._lock.acquire(timeout=min(self._seconds, threading.TIMEOUT_MAX)):
            raise ReplyTimeoutError(
                f"{self._what} was not sent: another call of it has been under way for {self._seconds:.3g} s"
            )

    async def __aexit__(self, *error: object) -> None:
        self._lock.release()


class _Locks:
    """A lock for each key that was ever used."""

    def __init__(self) -> None:
        self._locks: dict[object, threading.Lock] = {}

    def lock(self, key: object, what: str, seconds: float) -> _Held:
        """Keep other threads out of what has the same key."""
        lock = self._locks.get(key) or self._locks.setdefault(key, threading.Lock())
        return _Held(lock, what, seconds)


class FramedLine(_Locks):
    """A session of frames for threads.

    :param session: that is open.
    :param telling: the messages that :meth:`heard` gives.
    :param guest: whether the line is another device's.
    """

    def __init__(
        self, session: FramedSession, telling: tuple[type[Message], ...], guest: bool = False
    ) -> None:
        super().__init__()
        self.session = session
        self._guest = guest
        self.now: Callable[[], float] = session.now
        self._heard = session.subscribe(telling, limit=64) if telling else None

    async def ask(self, message: Any, replies: Any, address: int, seconds: float) -> Message:
        """See :class:`~stagewire._devices.line.GuardedLink`; so are all others."""
        return self.session.ask(message, replies, address, seconds).message

    async def send(self, message: Any, address: int, seconds: float) -> None:
        self.session.send(message, address, seconds)

    async def begin(
        self, message: Any, ends: Ends, address: int, seconds: float, on_done: OnDone
    ) -> Exchange:
        return self.session.begin(message, ends, address, seconds, on_done)

    async def wait(self, exchange: Exchange, seconds: float | None) -> Message:
        message: Message = self.session.wait(exchange, seconds).message
        return message

    async def halt(
        self, message: Any, ends: Ends | None, address: int, seconds: float
    ) -> Message | None:
        frame = self.session.halt(message, ends, address, seconds)
        return None if frame is None else frame.message

    async def pause(self, seconds: float) -> None:
        self.session.pause(seconds)

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
            self.session.close()
            return
        if self._heard is not None:
            self._heard.close()
        self.session = cast(FramedSession, ClosedSession(self.session.url))


class CommandLine(_Locks):
    """A session of commands for threads; an address is an axis, None the controller itself.

    :param session: that is open.
    """

    def __init__(self, session: CommandSession) -> None:
        super().__init__()
        self.session = session
        self.now: Callable[[], float] = session.now

    async def ask(self, message: Any, replies: Any, address: int, seconds: float) -> Message:
        """See :class:`~stagewire._devices.line.GuardedLink`; so are all others."""
        return self.session.ask(message, address, seconds)

    async def send(self, message: Any, address: int, seconds: float) -> None:
        self.session.send(message, None if address == CONTROLLER else address, seconds)

    async def halt(
        self, message: Any, ends: Ends | None, address: int, seconds: float
    ) -> Message | None:
        self.session.halt(message, address, seconds)
        return None

    async def pause(self, seconds: float) -> None:
        self.session.pause(seconds)

    async def text(self, line: str, seconds: float) -> str:
        return self.session.text(line, seconds)

    def heard(self) -> list[tuple[int, Message]]:
        return []

    async def close(self) -> None:
        self.session.close()


def open_session(
    kind: Callable[..., S],
    protocol: Protocol,
    link: str | Link,
    connection: Connection,
    **more: object,
) -> S:
    """Open a line, and a session on it, as the user chose.

    Raises :class:`~stagewire.errors.LinkOpenError`, and what the session refuses.
    """
    choices, options = connection.choices, session_options(connection)
    opened = open_link(link, **link_options(connection))
    try:
        return kind(
            protocol,
            opened,
            options=options,
            background=choices.background,
            log=connection.next_log(),
            unit=connection.unit.name,
            **more,
        )
    except BaseException:
        opened.close()
        raise
