"""What drives a core, whether by threads or by an event loop: what both have in common."""

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
    """A core on a line.

    :param core: what knows the protocol.
    :param link: the line.
    :param recording: where all that passes is recorded, if anywhere.
    """

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        defers_interrupts(cls)

    def __init__(self, core: _C, link: Link | AsyncLink, recording: Recording | None) -> None:
        self.on_close: list[Callable[[], bytes]] = []
        """Functions that return the last words: bytes such as the stop of a motion.

        They are called when the session is closed, at the end of the process, and within the handler of a
        signal that ends it. So they take no lock, call no session and raise nothing.
        """
        self._core: _C = core
        self._recording = recording
        self._end: StagewireError | None = None  # why nothing can be done any more; never replaced
        self._closed = False
        self.broken_at: float | None = None
        """When the line was lost, by the time of the session; bytes may have been cut in the middle then."""
        self._unsaid = b""  # the last words, while they are being written
        self._is_elsewhere = False  # this process is a fork of the one that opened it
        self._write_now = link.write_now
        self._url = link.url

    def __repr__(self) -> str:
        state = "closed" if self.closed else "lost" if self.lost else "open"
        return f"<{type(self).__name__} {self.url}: {state}>"

    @property
    def url(self) -> str:
        """The line."""
        return self._url

    @property
    def closed(self) -> bool:
        """Whether it was closed by this side, perhaps after the line was lost."""
        return self._closed

    @property
    def lost(self) -> bool:
        """Whether the line was lost; closing the session afterwards does not change that."""
        return isinstance(self._end, TransportLostError)

    @property
    def statistics(self) -> Statistics:
        """Counts of what came, for people and tests."""
        return self._core.statistics

    def _check_usable(self) -> None:
        """Raise when nothing can be done any more."""
        if self._end is not None:
            raise type(self._end)(str(self._end))

    # What passes

    def _received(self, data: bytes) -> None:
        """Note bytes that came."""
        if log.isEnabledFor(logging.DEBUG):
            log.debug("%s < %s", self._url, data.hex(" "))
        if self._recording is not None:
            self._recording.received(data)

    def _sent(self, data: bytes) -> None:
        """Note bytes that were written."""
        if log.isEnabledFor(logging.DEBUG):
            log.debug("%s > %s", self._url, data.hex(" "))
        if self._recording is not None:
            self._recording.sent(data)

    def _judged(self, error: TransportLostError) -> TransportLostError:
        """Return the error for a line that is gone, by what has come over it."""
        if error.turned_away is None or self._core.has_understood:
            return error
        return error.turned_away

    def _gone(self, error: TransportLostError) -> None:
        """Note that the line is gone."""
        log.warning("%s", error)
        if self._recording is not None:
            self._recording.note(str(error))

    # What is said last

    def _end_core(self, now: float) -> None:
        """Note that the session is closed, and keep its last words to be written; a loss stays a loss."""
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
            except Exception:  # the others have something to say, too
                log.exception("%s: what was to be said last is not said", self._url)
        return b"".join(words)

    def say_last(self) -> None:
        """Say the last words and nothing else; see :mod:`stagewire._sessions.termination`."""
        if last := self._last_words() if self._end is None else self._unsaid:
            self._write_now(last)

    def leave_to_parent(self) -> None:
        """Do nothing any more: this is a fork, whose parent has the line."""
        why = f"{self._url} was opened by the process that this one was forked from; open it after the fork"
        self._is_elsewhere = True
        self._end = TransportLostError(why)
        self._recording = None
        self._core.lose(why, 0.0)
