"""The interface of all links to a controller: bytes in and bytes out until the link is lost.

Also here: the options for opening a link, the messages for a lost link, and the base of the context managers
that users hold.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Self

from stagewire.errors import BadValueError, OutOfRangeError, TransportLostError

TYPE_CHECKING = False  # importing typing would double the import time
if TYPE_CHECKING:
    from types import TracebackType


class Closing:
    """A context manager that closes itself on exit."""

    def close(self) -> None:
        """Close it. A second call has no effect."""
        raise NotImplementedError

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()


class AsyncClosing:
    """An asynchronous context manager that closes itself on exit."""

    async def close(self) -> None:
        """Close it. A second call has no effect."""
        raise NotImplementedError

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        await self.close()


CLOSED = "it was closed by this side"
HUNG_UP = "the other end hung up, or the port was unplugged"


def lost(url: str, why: str) -> TransportLostError:
    """Return a new error, one for each caller that waits."""
    if why == CLOSED:
        return TransportLostError(f"{url}: {why}")
    return TransportLostError(
        f"{url} is lost: {why}. Commands in progress may or may not have been carried out: open the link "
        "again, then read the state"
    )


def because(error: Exception) -> str:
    """Return the system's description of an error."""
    said = getattr(error, "strerror", None) or str(error) or type(error).__name__
    return f"the system says: {said}"


def stalled(seconds: float) -> str:
    """Return the reason of a loss after ``seconds`` without progress in writing."""
    return (
        f"it accepted no bytes for {seconds:g} s (the other end does not read, or holds CTS; see rtscts "
        "and stall_timeout)"
    )


@dataclass(frozen=True, kw_only=True)
class LinkSettings:
    """Settings for opening a link. Each kind of link ignores those it does not have: TCP has no baud rate.

    Serial ports use 8 data bits, no parity, 1 stop bit, and no XON/XOFF: the bytes 0x11 and 0x13 are data.

    :param baudrate: bits per second. Thorlabs APT uses 115,200 (page 11); an ASI MS-2000 uses the setting of
        its switches.
    :param rtscts: whether to use RTS/CTS flow control. None: depending on the port, on for USB chips by FTDI
        (vendor 0x0403; page 10) and off for all others.
    :param purge: whether to discard the buffers of the port, with a pause before and after, as page 10
        describes for USB. None: same as ``rtscts``.
    :param purge_dwell: duration of each of these pauses, in seconds; 0 to 10.
    :param open_timeout: limit for opening a link whose other end must answer, in seconds; over 0 to 3600.
    :param stall_timeout: how long no byte may be accepted before the link is lost, in seconds; over 0 to
        3600. RTS/CTS and TCP flow control can block a link indefinitely.

    Raises :class:`~stagewire.errors.BadValueError` and :class:`~stagewire.errors.OutOfRangeError` for invalid
    values.
    """

    baudrate: int = 115200
    rtscts: bool | None = None
    purge: bool | None = None
    purge_dwell: float = 0.050
    open_timeout: float = 5.0
    stall_timeout: float = 5.0

    def __post_init__(self) -> None:
        if not isinstance(self.baudrate, int) or isinstance(self.baudrate, bool):
            raise BadValueError(
                f"baudrate must be a whole number of bits per second, not {self.baudrate!r}"
            )
        if not 50 <= self.baudrate <= 12_000_000:
            raise OutOfRangeError(
                f"baudrate {self.baudrate} is outside 50 to 12000000 bits per second"
            )
        for name in ("rtscts", "purge"):
            value = getattr(self, name)
            if value is not None and not isinstance(value, bool):
                raise BadValueError(
                    f"{name} must be True, False or None (depending on the port), not {value!r}"
                )
        if not 0 <= self._seconds("purge_dwell") <= 10:
            raise OutOfRangeError(f"purge_dwell {self.purge_dwell} is outside 0 to 10 seconds")
        for name in ("open_timeout", "stall_timeout"):
            if not 0 < (value := self._seconds(name)) <= 3600:
                raise OutOfRangeError(
                    f"{name} must be over 0 and at most 3600 seconds, not {value}"
                )

    @classmethod
    def of(cls, options: dict[str, object]) -> LinkSettings:
        """Return the settings with these options.

        Raises :class:`~stagewire.errors.BadValueError` also for unknown options.
        """
        known = [field.name for field in fields(cls)]
        if unknown := [name for name in options if name not in known]:
            raise BadValueError(
                f"unknown link option: {', '.join(unknown)} (known: {', '.join(known)})"
            )
        return cls(**options)  # type: ignore[arg-type]  # checked by the constructor

    def _seconds(self, name: str) -> float:
        value = getattr(self, name)
        if isinstance(value, bool) or not isinstance(value, (int, float)) or math.isnan(value):
            raise BadValueError(f"{name} must be a number of seconds, not {value!r}")
        return value


FLUSH = 1.0
"""Longest time, in seconds, that closing a link waits for unsent bytes."""


class Link(ABC):
    """An open link, for threads: one thread reads, others may write.

    A link does not interpret the bytes. Only one session may use it, because two readers would take each
    other's bytes.
    """

    url: str
    """The URL or port that was opened, for people."""

    clock: Callable[[], float] | None = None
    """The link's own time in seconds, such as that of a test; None: the machine's time."""

    @abstractmethod
    def read(self, timeout: float) -> bytes:
        """Return received bytes. Wait at most ``timeout`` seconds for the first; return ``b""`` if none came.

        Raises :class:`~stagewire.errors.TransportLostError` if the link is lost or closed.
        """

    @abstractmethod
    def write(self, data: bytes) -> None:
        """Send all bytes. May be called while another thread reads.

        Raises :class:`~stagewire.errors.TransportLostError` if the link is lost or closed, or accepts no
        bytes.
        """

    @abstractmethod
    def write_now(self, data: bytes) -> None:
        """Send as much as the system accepts immediately, without taking a lock; for signal handlers.

        Never raises, because a signal handler could not recover.
        """

    def has_unread(self) -> bool:
        """Return whether there are unprocessed bytes. May be called while another thread reads.

        A link that cannot tell returns False.
        """
        return False

    def note_dealt_with(self) -> None:  # noqa: B027 - most links have no use for it
        """Note that the bytes of the last :meth:`read` were processed. Calling :meth:`read` implies this."""

    @abstractmethod
    def wake(self) -> None:
        """Make the :meth:`read` that waits in another thread return soon, or the next one if none waits."""

    @abstractmethod
    def close(self) -> None:
        """Close the link and end a waiting read. Harmless if called twice or on a lost link."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class AsyncLink(ABC):
    """An open link, for the event loop that was running when it was opened."""

    url: str
    """The URL or port that was opened, for people."""

    clock: Callable[[], float] | None = None
    """The link's own time in seconds; None: the event loop's time."""

    @abstractmethod
    def start(
        self, received: Callable[[bytes], None], lost: Callable[[TransportLostError], None]
    ) -> None:
        """Start the callbacks. They run in the loop, after this method has returned. Call this once.

        :param received: called with received bytes, including those received before the start.
        :param lost: called once, as the last callback, if the link is lost; not after :meth:`close`.
        """

    @abstractmethod
    def write(self, data: bytes) -> None:
        """Send bytes. Bytes that the system does not accept immediately are kept and sent later.

        Raises :class:`~stagewire.errors.TransportLostError` if the link is lost or closed.
        """

    @abstractmethod
    def write_now(self, data: bytes) -> None:
        """Send as much as the system accepts immediately, if nothing is kept; for signal handlers."""

    def has_unread(self) -> bool:
        """Return whether the loop has not passed on all bytes. A link that cannot tell returns False."""
        return False

    @abstractmethod
    async def close(self) -> None:
        """Send the kept bytes, for a limited time, and close the link. Harmless if called twice."""

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(self, *_: object) -> None:
        await self.close()
