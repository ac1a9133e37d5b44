"""What every line to a controller does, whatever it is made of: bytes in, bytes out, until it is gone."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Self

from stagewire.errors import TransportLost

__all__ = ["FLUSH", "AsyncLink", "Link"]

FLUSH = 1.0
"""Seconds that closing a line waits, at most, for what is still to be sent."""


class Link(ABC):
    """A line that is open, for threads: one reads, others may write.

    A link knows nothing of frames. It is used by one session; two that read would take each other's bytes.
    """

    url: str
    """What was opened, for people."""

    clock: Callable[[], float] | None = None
    """A time of the line's own, in seconds, such as that of a test; None: the time of the machine."""

    @abstractmethod
    def read(self, timeout: float) -> bytes:
        """Return what came, and wait at most ``timeout`` seconds for the first byte; ``b""``: nothing came.

        Raises :class:`~stagewire.errors.TransportLost` when the line is gone or closed.
        """

    @abstractmethod
    def write(self, data: bytes) -> None:
        """Send all bytes; may be called while another thread reads.

        Raises :class:`~stagewire.errors.TransportLost` when the line is gone or closed, or takes nothing.
        """

    @abstractmethod
    def write_now(self, data: bytes) -> None:
        """Send what the system takes at once, without waiting for a lock; for a signal handler.

        Raises nothing: there is nobody who could do better.
        """

    def has_unread(self) -> bool:
        """Say whether something came that was not dealt with; may be called while another thread reads.

        A link that cannot know says no.
        """
        return False

    def note_dealt_with(self) -> None:  # noqa: B027 - most links need not know
        """Note that what :meth:`read` returned was dealt with; so it was when that is called again."""

    @abstractmethod
    def wake(self) -> None:
        """Let the read that waits in another thread return soon; if none does, the next one."""

    @abstractmethod
    def close(self) -> None:
        """Give the line back; a read that waits ends. Harmless twice, and when the line is gone."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class AsyncLink(ABC):
    """A line that is open, for the event loop that runs when it is opened."""

    url: str
    """What was opened, for people."""

    clock: Callable[[], float] | None = None
    """A time of the line's own, in seconds; None: that of the event loop."""

    @abstractmethod
    def start(
        self, received: Callable[[bytes], None], lost: Callable[[TransportLost], None]
    ) -> None:
        """Call back from now on, in the loop, and not before this has returned; to be called once.

        :param received: called with what came, what came before the start first.
        :param lost: called once, and as the last, when the line is gone; not when :meth:`close` was called.
        """

    @abstractmethod
    def write(self, data: bytes) -> None:
        """Send bytes; what the system does not take at once is kept, and sent when it does.

        Raises :class:`~stagewire.errors.TransportLost` when the line is gone or closed.
        """

    @abstractmethod
    def write_now(self, data: bytes) -> None:
        """Send what the system takes at once, if nothing is kept; for a signal handler. Raises nothing."""

    def has_unread(self) -> bool:
        """Say whether something came that the loop has not passed on. A link that cannot know says no."""
        return False

    @abstractmethod
    async def close(self) -> None:
        """Send what is kept, for a bounded time, and give the line back; harmless twice."""

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(self, *_: object) -> None:
        await self.close()
