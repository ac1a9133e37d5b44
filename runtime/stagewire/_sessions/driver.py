"""The base of the drivers of a core, for threads and for event loops."""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import Generic, TypeVar

from stagewire._links.link import AsyncLink, Link
from stagewire._sessions.core import Core, log
from stagewire._sessions.interrupts import defers_interrupts
from stagewire._sessions.recording import Recording
from stagewire._sessions.statistics import Statistics
from stagewire.errors import SessionClosedError, StagewireError, TransportLostError

_C = TypeVar("_C", bound=Core)


@defers_interrupts
class Driver(Generic[_C]):
    """A core on a link.

    :param core: the core of the protocol.
    :param link: the link.
    :param recording: records all bytes, if given.
    """

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        defers_interrupts(cls)

    def __init__(self, core: _C, link: Link | AsyncLink, recording: Recording | None) -> None:
        self.on_close: list[Callable[[], bytes]] = []
        """Functions that return last words: bytes such as the stop of a motion.

        They are called when the session is closed, at the end of the process, and in the handler of a signal
        that ends it. They must not take locks, call sessions or raise.
        """
        self._core: _C = core
        self._recording = recording
        self._end: StagewireError | None = None  # why the session has ended; never replaced
        self._closed = False
        self.broken_at: float | None = None
        """When the link was lost, in the time of the session; bytes may have been cut at that point."""
        self._unsaid = b""  # last words that are not written yet
        self._is_elsewhere = False  # this process is a fork; its parent owns the session
        self._write_now = link.write_now
        self._url = link.url

    def __repr__(self) -> str:
        state = "closed" if self.closed else "lost" if self.lost else "open"
        return f"<{type(self).__name__} {self.url}: {state}>"

    @property
    def url(self) -> str:
        """The URL of the link."""
        return self._url

    @property
    def closed(self) -> bool:
        """Whether this side has closed the session, perhaps after the link was lost."""
        return self._closed

    @property
    def lost(self) -> bool:
        """Whether the link was lost; closing the session later does not change that."""
        return isinstance(self._end, TransportLostError)

    @property
    def statistics(self) -> Statistics:
        """Counts of received events, for people and tests."""
        return self._core.statistics

    def _check_usable(self) -> None:
        """Raise if the session has ended."""
        if self._end is not None:
            raise type(self._end)(str(self._end))

    # Bytes

    def _received(self, data: bytes) -> None:
        """Log and record received bytes."""
        if log.isEnabledFor(logging.DEBUG):
            log.debug("%s < %s", self._url, data.hex(" "))
        if self._recording is not None:
            self._recording.received(data)

    def _sent(self, data: bytes) -> None:
        """Log and record bytes that were written."""
        if log.isEnabledFor(logging.DEBUG):
            log.debug("%s > %s", self._url, data.hex(" "))
        if self._recording is not None:
            self._recording.sent(data)

    def _judged(self, error: TransportLostError) -> TransportLostError:
        """Return the error for a lost link, which depends on whether messages were understood."""
        if error.turned_away is None or self._core.has_understood:
            return error
        return error.turned_away

    def _gone(self, error: TransportLostError) -> None:
        """Log and record the loss of the link."""
        log.warning("%s", error)
        if self._recording is not None:
            self._recording.note(str(error))

    # Last words

    def _end_core(self, now: float) -> None:
        """Note that the session is closed, and keep the last words to be written unless the link was lost."""
        self._closed = True
        if self._end is None:
            self._unsaid = self._last_words()
            self._end = SessionClosedError(f"{self._url} was closed")
        self._core.close(now)

    def _last_words(self) -> bytes:
        words = []
        for say in tuple(self.on_close):
            try:
                words.append(say())
            except Exception:  # the other functions are still called
                log.exception("%s: last words failed", self._url)
        return b"".join(words)

    def say_last(self) -> None:
        """Write the last words and nothing else; see :mod:`stagewire._sessions.termination`."""
        if last := self._last_words() if self._end is None else self._unsaid:
            self._write_now(last)

    def leave_to_parent(self) -> None:
        """Disable the session in a fork; the parent process owns the link."""
        why = f"{self._url} was opened before this process was forked; open it after the fork"
        self._is_elsewhere = True
        self._end = TransportLostError(why)
        self._recording = None
        self._core.lose(why, 0.0)
