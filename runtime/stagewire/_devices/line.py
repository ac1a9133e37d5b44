"""What a call needs of a session, whichever it is: for threads or for asyncio, of frames or of commands."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import AbstractAsyncContextManager
from typing import Any, Final, Protocol

from stagewire._codec.message import Message
from stagewire._sessions.exchange import Exchange
from stagewire._sessions.options import Ends
from stagewire.errors import BadValueError, SessionClosedError

__all__ = [
    "MOMENT",
    "ClosedSession",
    "Deadline",
    "Line",
    "LineOfFrames",
    "OnDone",
    "heard_from",
    "seconds_of",
]

OnDone = Callable[[Exchange], object]

MOMENT: Final = 0.001
"""Seconds; what a call that has no time left gives to its last question."""


class Line(Protocol):
    """A session as calls use it; an address is that of a controller, or an axis."""

    @property
    def now(self) -> Callable[[], float]:
        """The time in seconds since whenever."""

    def lock(self, key: object, what: str, seconds: float) -> AbstractAsyncContextManager[None]:
        """Keep everybody else out of what has the same key (:class:`~stagewire.errors.ReplyTimeoutError`)."""

    async def ask(
        self, message: Message, replies: tuple[type[Message], ...], address: int, seconds: float
    ) -> Message:
        """Send a request and return what answers it."""

    async def send(self, message: Message, address: int, seconds: float) -> None:
        """Send what has no reply."""

    async def halt(
        self, message: Message, ends: Ends | None, address: int, seconds: float
    ) -> Message | None:
        """Stop a motion, before everything else."""

    async def pause(self, seconds: float) -> None:
        """Wait so long."""

    def heard(self) -> list[tuple[int, Message]]:
        """Return what was said unasked since the last time, and by whom."""

    async def close(self) -> None:
        """Say what is to be said last, and close the line."""


class LineOfFrames(Line, Protocol):
    """A line to controllers that have addresses, and say when a motion has ended."""

    async def begin(
        self, message: Message, ends: Ends, address: int, seconds: float, on_done: OnDone
    ) -> Exchange:
        """Begin a motion."""

    async def wait(self, exchange: Exchange, seconds: float | None) -> Message:
        """Wait for the end of a motion."""

    async def settled(self, address: int, channel: int | None) -> None:
        """Say that nothing moves there."""

    async def tell(self, address: int, **context: str) -> None:
        """Say what decides between layouts of messages from an address."""

    async def keep_alive(self, message: Message | None, addresses: tuple[int, ...]) -> None:
        """Send signs of life from now on; None: no more."""


class ClosedSession:
    """In place of its session: for a device that was closed, on a line that others go on to use.

    :param url: of the line.
    """

    lost = False
    closed = True
    broken_at = None

    def __init__(self, url: str) -> None:
        self.url = url

    def __getattr__(self, name: str) -> Any:
        raise SessionClosedError(f"this part of {self.url} was closed; nothing was sent")


class Deadline:
    """The end of a call that has several parts.

    :param seconds: from now on, for all of them.
    """

    __slots__ = ("_end", "_line")

    def __init__(self, line: Line, seconds: float) -> None:
        self._line = line
        self._end = line.now() + seconds

    @property
    def left(self) -> float:
        """Seconds; when there is none left a moment, in which a session says what was not done."""
        return max(MOMENT, self._end - self._line.now())

    @property
    def over(self) -> bool:
        """Whether there is none left."""
        return self._line.now() >= self._end


def seconds_of(timeout: float | None, default: float) -> float:
    """Return how long a call may last.

    Raises :class:`~stagewire.errors.BadValueError` for what is no time.
    """
    if timeout is None:
        return default
    if isinstance(timeout, bool) or not isinstance(timeout, int | float) or math.isnan(timeout):
        raise BadValueError(f"timeout takes seconds, not {timeout!r}")
    if timeout <= 0:
        raise BadValueError(f"timeout takes seconds, more than 0, not {timeout}")
    return float(timeout)


def heard_from(subscription: Any) -> list[tuple[int, Message]]:
    """Take everything out of a subscription, without waiting: who said it, and what."""
    found: list[tuple[int, Message]] = []
    while subscription is not None and (event := subscription.take()) is not None:
        frame = event.frame
        found.append((frame.source, frame.message))
    return found
