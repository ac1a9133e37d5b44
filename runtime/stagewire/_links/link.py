"""The interface of every link to a controller: bytes in, bytes out, until it is gone.

Also here: the options of opening one, the words for a link that is gone, which are the same for every kind,
and the base of what users hold and close.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Self

from stagewire.errors import BadValueError, OutOfRangeError, TransportLostError

TYPE_CHECKING = False  # typing would take half of the time of an import
if TYPE_CHECKING:
    from types import TracebackType


class Closing:
    """A context manager that closes itself."""

    def close(self) -> None:
        """End it; harmless when done twice."""
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
    """An asynchronous context manager that closes itself."""

    async def close(self) -> None:
        """End it; harmless when done twice."""
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
    """Return a new error; each that waits gets one of its own."""
    if why == CLOSED:
        return TransportLostError(f"{url}: {why}")
    return TransportLostError(
        f"{url} is gone: {why}. What was under way may have been done or not; open the line again, and read "
        "the state again"
    )


def because(error: Exception) -> str:
    """Return what the system says is wrong."""
    said = getattr(error, "strerror", None) or str(error) or type(error).__name__
    return f"the system says: {said}"


def stalled(seconds: float) -> str:
    """Return that nothing of what is to be sent was taken for so long."""
    return (
        f"for {seconds:g} s it took no byte of what is to be sent (the other end does not read, or holds "
        "CTS; see rtscts and stall_timeout)"
    )


@dataclass(frozen=True, kw_only=True)
class LinkSettings:
    """How a line is opened. What a kind of line does not have is not looked at, such as a baud rate of TCP.

    Every line has 8 data bits, no parity, 1 stop bit, and no XON/XOFF: the bytes 0x11 and 0x13 are data.

    :param baudrate: bits per second. Thorlabs APT has 115,200 (page 11), an ASI MS-2000 what its switches
        say.
    :param rtscts: whether RTS and CTS control the flow. None: as the port asks, on for a USB chip of FTDI
        (vendor 0x0403; page 10), off for every other.
    :param purge: whether to forget what the port holds, with a pause before and after, as page 10 does on
        USB. None: where ``rtscts`` is on.
    :param purge_dwell: each of these pauses, in seconds; 0 to 10.
    :param open_timeout: how long opening may take, in seconds, where somebody has to answer; over 0 to 3600.
    :param stall_timeout: when a line that takes no byte of what is to be sent is gone, in seconds; over 0 to
        3600. RTS and CTS, and the other end of TCP, can stop a line for as long as they like.

    Raises :class:`~stagewire.errors.BadValueError` and :class:`~stagewire.errors.OutOfRangeError` for a value
    that is none.
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
                f"baudrate takes a whole number of bits per second, not {self.baudrate!r}"
            )
        if not 50 <= self.baudrate <= 12_000_000:
            raise OutOfRangeError(
                f"baudrate {self.baudrate} is outside 50 to 12000000 bits per second"
            )
        for name in ("rtscts", "purge"):
            value = getattr(self, name)
            if value is not None and not isinstance(value, bool):
                raise BadValueError(
                    f"{name} takes True, False, or None for as the port asks, not {value!r}"
                )
        if not 0 <= self._seconds("purge_dwell") <= 10:
            raise OutOfRangeError(f"purge_dwell {self.purge_dwell} is outside 0 to 10 seconds")
        for name in ("open_timeout", "stall_timeout"):
            if not 0 < (value := self._seconds(name)) <= 3600:
                raise OutOfRangeError(f"{name} {value} has to be over 0 and at most 3600 seconds")

    @classmethod
    def of(cls, options: dict[str, object]) -> LinkSettings:
        """Return the settings that options say.

        Raises :class:`~stagewire.errors.BadValueError` for one that there is not, too.
        """
        known = [field.name for field in fields(cls)]
        if unknown := [name for name in options if name not in known]:
            raise BadValueError(
                f"a line has no option {', '.join(unknown)} (it has {', '.join(known)})"
            )
        return cls(**options)  # type: ignore[arg-type]  # checked when it is made

    def _seconds(self, name: str) -> float:
        value = getattr(self, name)
        if isinstance(value, bool) or not isinstance(value, (int, float)) or math.isnan(value):
            raise BadValueError(f"{name} takes seconds, not {value!r}")
        return value


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

        Raises :class:`~stagewire.errors.TransportLostError` when the line is gone or closed.
        """

    @abstractmethod
    def write(self, data: bytes) -> None:
        """Send all bytes; may be called while another thread reads.

        Raises :class:`~stagewire.errors.TransportLostError` when the line is gone or closed, or takes
        nothing.
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
        self, received: Callable[[bytes], None], lost: Callable[[TransportLostError], None]
    ) -> None:
        """Call back from now on, in the loop, and not before this has returned; to be called once.

        :param received: called with what came, what came before the start first.
        :param lost: called once, and as the last, when the line is gone; not when :meth:`close` was called.
        """

    @abstractmethod
    def write(self, data: bytes) -> None:
        """Send bytes; what the system does not take at once is kept, and sent when it does.

        Raises :class:`~stagewire.errors.TransportLostError` when the line is gone or closed.
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
