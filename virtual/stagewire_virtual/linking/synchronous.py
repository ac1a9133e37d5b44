"""A line in memory to a controller that lives in real time, for threads."""

from __future__ import annotations

import contextlib
import threading
import time

from stagewire.errors import TransportLost
from stagewire.links import Link
from stagewire_virtual.clock import SECOND, RealClock
from stagewire_virtual.errors import UnpluggedError
from stagewire_virtual.serving.link import Maker
from stagewire_virtual.serving.memory import MemoryLink

__all__ = ["VirtualLink"]


class VirtualLink(Link):
    """A line whose host is a thread that reads, and others that write.

    The controller has no thread: a read that waits sleeps until something is due on its clock, and lets time
    go on. What a controller does while nobody reads, it has done when somebody does.

    :param url: for people.
    :param make: makes the controller.
    """

    def __init__(self, url: str, make: Maker) -> None:
        self.url = url
        self._clock = RealClock()
        self._line = MemoryLink(make(self._clock), label=url)
        self._changed = threading.Condition()  # something was written, or the reader is to wake
        self._woken = False
        self._closed = False

    def read(self, timeout: float) -> bytes:
        """Return what the controller said; see :meth:`.Link.read`."""
        end = time.monotonic() + timeout
        with self._changed:
            while True:
                self._check_open()
                self._clock.run_until(self._clock.now)
                if data := self._said():
                    return data
                left = end - time.monotonic()
                if self._woken or left <= 0:
                    self._woken = False
                    return b""
                due = self._clock.next_due
                if due is not None:
                    left = min(left, max(0, due - self._clock.now) / SECOND)
                self._changed.wait(min(left, threading.TIMEOUT_MAX))

    def write(self, data: bytes) -> None:
        """Send bytes to the controller, which takes them at once."""
        with self._changed:
            self._check_open()
            try:
                self._line.write(data)
            except UnpluggedError as error:
                raise TransportLost(f"{self.url}: {error}") from None
            self._changed.notify()

    def write_now(self, data: bytes) -> None:
        """Send bytes if that can be done; see :meth:`.Link.write_now`."""
        with contextlib.suppress(TransportLost):
            self.write(data)

    def wake(self) -> None:
        """Let the read that waits, or the next one, return without anything."""
        with self._changed:
            self._woken = True
            self._changed.notify()

    def close(self) -> None:
        """Unplug the controller, which is no more."""
        with self._changed:
            self._closed = True
            self._line.disconnect()
            self._changed.notify()

    def _said(self) -> bytes:
        try:
            return self._line.read()
        except UnpluggedError:
            raise TransportLost(f"{self.url}: the line to the controller was unplugged") from None

    def _check_open(self) -> None:
        if self._closed:
            raise TransportLost(f"{self.url}: the line was closed")
