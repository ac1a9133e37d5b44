# Generated from _devices/asynchronous/transport.py by `python tools/unasync.py`; do not edit.

"""Transports of devices for threads: a session of frames or of commands, as calls use it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeAlias, TypeVar, cast

from stagewire._codec.message import Message
from stagewire._codec.protocol import Protocol
from stagewire._devices import endpoint as endpoints
from stagewire._devices.connection import Connection
from stagewire._devices.endpoint import CONTROLLER
from stagewire._devices.locks import Locks
from stagewire._links.link import Link
from stagewire._links.opening import open_link
from stagewire._sessions.exchange import Exchange
from stagewire._sessions.options import Ends
from stagewire._sessions.synchronous import CommandSession, FramedSession
from stagewire.errors import SessionClosedError

S = TypeVar("S")


class FramedTransport(Locks):
    """A session of frames, and the locks of its calls.

    :param session: an open session.
    :param telling: classes of the messages that :meth:`heard` returns.
    :param guest: whether the link belongs to another device.
    """

    def __init__(
        self, session: FramedSession, telling: tuple[type[Message], ...], guest: bool = False
    ) -> None:
        super().__init__()
        self.session = session
        self._guest = guest
        self.now: Callable[[], float] = session.now
        self._heard = session.subscribe(telling, limit=64) if telling else None

    def ask(self, message: Any, replies: Any, address: int, seconds: float) -> Message:
        """Send a request and return its reply."""
        return (self.session.ask(message, replies, address, seconds)).message

    def send(self, message: Any, address: int, seconds: float) -> None:
        """Send a message that has no reply."""
        self.session.send(message, address, seconds)

    def begin(
        self,
        message: Any,
        ends: Ends,
        address: int,
        seconds: float,
        on_done: Callable[[Exchange], object],
    ) -> Exchange:
        """Start a motion."""
        return self.session.begin(message, ends, address, seconds, on_done)

    def wait(self, exchange: Exchange, seconds: float | None) -> Message:
        """Wait for the end of a motion."""
        message: Message = (self.session.wait(exchange, seconds)).message
        return message

    def halt(self, message: Any, ends: Ends | None, address: int, seconds: float) -> Message | None:
        """Stop a motion; the stop is sent before all waiting messages."""
        frame = self.session.halt(message, ends, address, seconds)
        return None if frame is None else frame.message

    def pause(self, seconds: float) -> None:
        """Wait for some seconds."""
        self.session.pause(seconds)

    def settled(self, address: int, channel: int | None) -> None:
        """Record that nothing moves on a channel."""
        self.session.settled(address, channel)

    def keep_alive(self, message: Any, addresses: tuple[int, ...]) -> None:
        """Send a keep-alive message regularly; None stops it."""
        self.session.keep_alive(message, addresses)

    def tell(self, address: int, **context: str) -> None:
        """Set the context that selects the layout of messages from an address."""
        self.session.tell(address, **context)

    def heard(self) -> list[tuple[int, Message]]:
        """Return the unsolicited messages since the last call, with their source addresses; never wait."""
        found: list[tuple[int, Message]] = []
        while self._heard is not None and (event := self._heard.take()) is not None:
            frame = cast(Any, event).frame
            found.append((frame.source, frame.message))
        return found

    def close(self) -> None:
        """Send the last messages and close the link; a guest leaves the link open."""
        if not self._guest:
            self.session.close()
            return
        if self._heard is not None:
            self._heard.close()
        self.session = cast(FramedSession, _ClosedSession(self.session.url))


class CommandTransport(Locks):
    """A session of commands, and the locks of its calls; an address is an axis, or the controller itself.

    :param session: an open session.
    """

    def __init__(self, session: CommandSession) -> None:
        super().__init__()
        self.session = session
        self.now: Callable[[], float] = session.now

    def ask(self, message: Any, replies: Any, address: int, seconds: float) -> Message:
        """Send a command and return its reply."""
        return self.session.ask(message, address, seconds)

    def send(self, message: Any, address: int, seconds: float) -> None:
        """Send a command that has no reply."""
        self.session.send(message, None if address == CONTROLLER else address, seconds)

    def halt(self, message: Any, ends: Ends | None, address: int, seconds: float) -> Message | None:
        """Stop a motion; the stop is sent before all waiting commands and has no reply."""
        self.session.halt(message, address, seconds)
        return None

    def pause(self, seconds: float) -> None:
        """Wait for some seconds."""
        self.session.pause(seconds)

    def heard(self) -> list[tuple[int, Message]]:
        """Return an empty list: a controller of commands sends no unsolicited messages."""
        return []

    def close(self) -> None:
        """Send the last commands and close the link."""
        self.session.close()


Transport: TypeAlias = FramedTransport | CommandTransport
Endpoint: TypeAlias = endpoints.Endpoint[Transport]


def framed_transport(endpoint: Endpoint) -> FramedTransport:
    """Return the transport of a controller whose messages have frames."""
    assert isinstance(endpoint.transport, FramedTransport)  # only these have tables with ends
    return endpoint.transport


class _ClosedSession:
    """Replacement for the session of a closed device whose link others still use."""

    lost = False
    closed = True
    broken_at = None

    def __init__(self, url: str) -> None:
        self.url = url

    def __getattr__(self, name: str) -> Any:
        raise SessionClosedError(f"this device on {self.url} was closed; nothing was sent")


def open_session(
    kind: Callable[..., S],
    protocol: Protocol,
    link: str | Link,
    connection: Connection[Any],
    **more: object,
) -> S:
    """Open a link, and a session on it, with the options of the user.

    Raise :class:`~stagewire.errors.LinkOpenError`, and the errors of the session.
    """
    options = connection.session_options()
    opened = open_link(link, **connection.link_options())
    try:
        return kind(
            protocol,
            opened,
            options=options,
            background=connection.choices.background,
            log=connection.next_log(),
            unit=connection.unit.name,
            **more,
        )
    except BaseException:
        opened.close()
        raise
