"""The line to a controller as checks have it: guarded, recorded, and never slept on.

What both kinds of lines have in common. Time is that of the link, where it has one of its own: a minute of a
stepped clock takes none. Waiting is reading.
"""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping

from stagewire.errors import TransportLostError
from stagewire.links import Link
from stagewire_conformance.device.declared import Declared
from stagewire_conformance.device.lines.interruption import Interruption
from stagewire_conformance.device.permissions import Permissions
from stagewire_conformance.device.report import Entry

__all__ = ["Line"]


class Line(ABC):
    """A line to a controller; made for one run.

    :param link: open; it stays so.
    :param declared: what is at its other end.
    :param allowed: what may be sent.
    """

    def __init__(self, link: Link, declared: Declared, allowed: Permissions) -> None:
        self.declared = declared
        self.allowed = allowed
        self.log: list[Entry] = []
        """Everything that passed, in order."""
        self.interruption = Interruption(link)
        self._link = link
        self._clock = time.monotonic if link.clock is None else link.clock
        self._began = self._clock()

    @property
    def url(self) -> str:
        """What was opened."""
        return self._link.url

    @property
    def now(self) -> float:
        """Seconds since the line was made."""
        return self._clock() - self._began

    # What a run does with it

    @abstractmethod
    def contact(self) -> dict[str, int | str]:
        """Begin to talk, and return what the controller says that it is, field by field; empty: it does not.

        Raises :class:`.NothingAnswersError` where nothing comes that is of the protocol.
        """

    def identify(self, reported: Mapping[str, int | str]) -> Declared:
        """Return the controller with the scales of what it reports that it is, and guard it so from now on.

        :param reported: what :meth:`contact` returned.

        Raises :class:`.RangeError` for a declared travel that no scale converts to counts there.
        """
        return self.declared

    @abstractmethod
    def listen(self, seconds: float) -> object:
        """Return what comes within some seconds."""

    @abstractmethod
    def settle(self) -> list[str]:
        """Read until nothing comes any more, before a check; return what came unasked, for people."""

    @abstractmethod
    def halt(self) -> None:
        """Stop whatever this check may have set in motion, before anything else is done.

        Raises nothing but what interrupts it a second time: a line that is gone takes no stop.
        """

    @abstractmethod
    def rest(self) -> None:
        """Stop what a check that is over has left in motion, and forget what has ended."""

    @abstractmethod
    def leave(self) -> None:
        """Leave the controller in the state in which :meth:`contact` found it, at the end of a run."""

    # Bytes

    def _write(self, raw: bytes, tell: Callable[[], str], *, keep_alive: bool = False) -> None:
        """Send bytes, whole."""
        self.interruption.check()
        self._put(raw, tell, keep_alive)

    def _write_now(self, raw: bytes, tell: Callable[[], str]) -> None:
        """Send bytes whatever has happened; a line that is gone takes none, and the log says none."""
        try:
            self._put(raw, tell, False)
        except TransportLostError:
            self.log.pop()

    def _put(self, raw: bytes, tell: Callable[[], str], keep_alive: bool) -> None:
        self.log.append(Entry(self.now, True, raw, keep_alive, tell))
        self._link.write(raw)

    def _read(self, timeout: float) -> bytes:
        """Return what came, and wait for it for so many seconds at most."""
        self.interruption.check()
        return self._link.read(max(0.0, timeout))

    def _record(self, raw: bytes, tell: Callable[[], str]) -> None:
        """Note something that came."""
        self.log.append(Entry(self.now, False, raw, False, tell))
