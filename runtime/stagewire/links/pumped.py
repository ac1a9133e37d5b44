"""A line for threads on a port that a thread reads."""

from __future__ import annotations

import contextlib
import threading
import time

from stagewire.errors import TransportLost
from stagewire.links.link import Link
from stagewire.links.loss import CLOSED, because, lost
from stagewire.links.pump import Pump, write_all
from stagewire.links.serial_port import Port

__all__ = ["PumpedLink"]


class PumpedLink(Link):
    """A line on a port of pyserial, whatever it is.

    :param url: for people.
    :param port: open; reads without a time limit.
    """

    def __init__(self, url: str, port: Port) -> None:
        self.url = url
        self._port = port
        self._changed = threading.Condition()  # over all that follows
        self._waiting = bytearray()
        self._is_taken = True  # what was read last was dealt with
        self._woken = False
        self._why = ""
        self._writing = threading.Lock()
        self._writer = 0  # the thread that is writing
        self._pump = Pump(port, self._take, self._lose)
        self._pump.start()

    def read(self, timeout: float) -> bytes:
        """Return what came; see :meth:`.Link.read`."""
        end = time.monotonic() + timeout
        with self._changed:
            self._is_taken = True
            while not self._waiting:
                if self._why:
                    raise lost(self.url, self._why)
                left = end - time.monotonic()
                if self._woken or left <= 0:
                    self._woken = False
                    return b""
                self._changed.wait(min(left, threading.TIMEOUT_MAX))
            data = bytes(self._waiting)
            self._waiting.clear()
            self._is_taken = False
            return data

    def write(self, data: bytes) -> None:
        """Send all bytes; see :meth:`.Link.write`."""
        with self._writing:
            self._check()
            self._writer = threading.get_ident()
            try:
                write_all(self._port, data)
            except Exception as error:  # what pyserial raises differs from port to port
                self._lose(because(error))
            finally:
                self._writer = 0
            self._check()

    def write_now(self, data: bytes) -> None:
        """Send what is taken at once, unless this very thread is in the midst of writing."""
        if not self._why and self._writer != threading.get_ident():
            with contextlib.suppress(Exception):
                self._port.write(data)

    def has_unread(self) -> bool:
        """Say whether something came that was not dealt with; see :meth:`.Link.has_unread`."""
        with self._changed:
            return bool(self._waiting) or not self._is_taken

    def note_dealt_with(self) -> None:
        """Note that what was read was dealt with; see :meth:`.Link.note_dealt_with`."""
        self._is_taken = True

    def wake(self) -> None:
        """End a read; see :meth:`.Link.wake`."""
        with self._changed:
            self._woken = True
            self._changed.notify_all()

    def close(self) -> None:
        """Give the port back; see :meth:`.Link.close`."""
        with self._changed:
            closed, self._why = self._why == CLOSED, CLOSED
            self._waiting.clear()
            self._changed.notify_all()
        if not closed:
            self._pump.stop()

    def _check(self) -> None:
        if self._why:
            raise self._error()

    def _error(self) -> TransportLost:
        return lost(self.url, self._why)

    def _take(self, data: bytes) -> None:
        with self._changed:
            if not self._why:
                self._waiting += data
                self._changed.notify()

    def _lose(self, why: str) -> None:
        with self._changed:
            self._why = self._why or why
            self._changed.notify_all()
