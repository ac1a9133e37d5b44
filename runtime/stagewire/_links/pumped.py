"""Links on ports that the system cannot wait for: ``rfc2217://``, ``loop://``, COM ports. A thread reads."""

from __future__ import annotations

import asyncio
import contextlib
import queue
import threading
import time
from collections.abc import Callable

from stagewire._links.link import CLOSED, FLUSH, HUNG_UP, AsyncLink, Link, because, lost
from stagewire._links.serial_port import Port
from stagewire.errors import TransportLostError

_WRITTEN_AT_ONCE = 256  # bytes; the write timeout of a port then covers few bytes
_LONGEST_END = 10.0  # seconds; pyserial needs up to 7 to close a network port


class Pump:
    """A thread that reads a port and waits without a time limit.

    :param port: the open port.
    :param received: called in the thread with received bytes.
    :param lost: called in the thread, once, with the reason if reading fails; not after :meth:`stop`.
    """

    def __init__(
        self, port: Port, received: Callable[[bytes], None], lost: Callable[[str], None]
    ) -> None:
        self._port = port
        self._received = received
        self._lost = lost
        self._stopping = False
        self._thread = threading.Thread(target=self._run, name=f"reads {port.port}", daemon=True)

    def start(self) -> None:
        """Start reading."""
        self._thread.start()

    def stop(self) -> None:
        """Close the port, and wait for the thread to end if it was started."""
        self._stopping = True
        with contextlib.suppress(Exception):  # ports differ in what they support and raise
            self._port.cancel_read()
        if not hasattr(self._port, "cancel_read"):
            self._close()
        if self._thread.is_alive():
            self._thread.join(_LONGEST_END)
        self._close()

    def _close(self) -> None:
        with contextlib.suppress(Exception):  # the port may be lost
            self._port.close()

    def _run(self) -> None:
        why = HUNG_UP
        try:
            while not self._stopping and self._pass_on():
                pass
        except Exception as error:  # the errors for a lost port differ between ports
            why = because(error)
        if not self._stopping:
            self._lost(why)

    def _pass_on(self) -> bool:
        """Pass on the next bytes, and return whether more can follow.

        If a read without a time limit returns too few bytes, it was cancelled or the port is lost.
        """
        data = self._port.read(1)
        waiting = self._port.in_waiting if data else 0
        whole = len(data) + waiting if data else 1
        if waiting:
            data += self._port.read(waiting)
        if data:
            self._received(bytes(data))
        return len(data) == whole


def write_all(port: Port, data: bytes) -> None:
    """Write everything, or raise the error of the port."""
    for start in range(0, len(data), _WRITTEN_AT_ONCE):
        port.write(data[start : start + _WRITTEN_AT_ONCE])


class PumpedLink(Link):
    """A link on any port of pyserial.

    :param url: the link, for people.
    :param port: the open port, with reads without a time limit.
    """

    def __init__(self, url: str, port: Port) -> None:
        self.url = url
        self._port = port
        self._changed = threading.Condition()  # guards the attributes below
        self._waiting = bytearray()
        self._is_taken = True  # the bytes of the last read were processed
        self._woken = False
        self._why = ""
        self._writing = threading.Lock()
        self._writer = 0  # the thread that is writing
        self._pump = Pump(port, self._take, self._lose)
        self._pump.start()

    def read(self, timeout: float) -> bytes:
        """Return received bytes; see :meth:`.Link.read`."""
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
            except Exception as error:  # the errors of pyserial differ between ports
                self._lose(because(error))
            finally:
                self._writer = 0
            self._check()

    def write_now(self, data: bytes) -> None:
        """Send bytes without waiting, unless this very thread is writing."""
        if not self._why and self._writer != threading.get_ident():
            with contextlib.suppress(Exception):
                self._port.write(data)

    def has_unread(self) -> bool:
        """Return whether there are unprocessed bytes; see :meth:`.Link.has_unread`."""
        with self._changed:
            return bool(self._waiting) or not self._is_taken

    def note_dealt_with(self) -> None:
        """Note that the bytes of the last read were processed; see :meth:`.Link.note_dealt_with`."""
        self._is_taken = True

    def wake(self) -> None:
        """End a read; see :meth:`.Link.wake`."""
        with self._changed:
            self._woken = True
            self._changed.notify_all()

    def close(self) -> None:
        """Close the port; see :meth:`.Link.close`."""
        with self._changed:
            closed, self._why = self._why == CLOSED, CLOSED
            self._waiting.clear()
            self._changed.notify_all()
        if not closed:
            self._pump.stop()

    def _check(self) -> None:
        if self._why:
            raise self._error()

    def _error(self) -> TransportLostError:
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


class AsyncPumpedLink(AsyncLink):
    """A link on any port of pyserial. One thread reads and another writes, because both may wait.

    :param url: the link, for people.
    :param port: the open port, with reads without a time limit.
    """

    def __init__(self, url: str, port: Port) -> None:
        self.url = url
        self._port = port
        self._loop = asyncio.get_running_loop()
        self._why = ""
        self._received: Callable[[bytes], None] | None = None
        self._lost: Callable[[TransportLostError], None] | None = None
        self._kept: queue.SimpleQueue[bytes | None] = queue.SimpleQueue()
        self._writer = threading.Thread(target=self._write, name=f"writes {url}", daemon=True)
        self._pump = Pump(port, self._from_thread, self._lost_in_thread)
        self._writer.start()

    def start(
        self, received: Callable[[bytes], None], lost: Callable[[TransportLostError], None]
    ) -> None:
        """Start the callbacks; see :meth:`.AsyncLink.start`."""
        self._received, self._lost = received, lost
        if self._why:
            self._loop.call_soon(self._say_lost)
        else:
            self._pump.start()

    def write(self, data: bytes) -> None:
        """Send bytes; see :meth:`.AsyncLink.write`."""
        if self._why:
            raise lost(self.url, self._why)
        self._kept.put(data)

    def write_now(self, data: bytes) -> None:
        """Send bytes after the kept ones, and wait a moment for it; see :meth:`.AsyncLink.write_now`."""
        if not self._why:
            self._kept.put(data)
            self._kept.put(None)
            self._writer.join(FLUSH)

    async def close(self) -> None:
        """Send the kept bytes and close the port; see :meth:`.AsyncLink.close`."""
        if self._why == CLOSED:
            return
        self._why, self._lost = CLOSED, None
        await asyncio.shield(self._loop.run_in_executor(None, self._end))

    def _end(self) -> None:
        self._kept.put(None)
        self._writer.join(FLUSH)
        self._pump.stop()
        self._writer.join(FLUSH)  # a write that was waiting has failed now

    # In the threads

    def _write(self) -> None:
        while (data := self._kept.get()) is not None:
            try:
                write_all(self._port, data)
            except Exception as error:  # the errors of pyserial differ between ports
                self._lost_in_thread(because(error))
                return

    def _from_thread(self, data: bytes) -> None:
        self._in_loop(self._take, data)

    def _lost_in_thread(self, why: str) -> None:
        self._in_loop(self._lose, why)

    def _in_loop(self, call: Callable[..., None], argument: object) -> None:
        with contextlib.suppress(RuntimeError):  # the loop was closed
            self._loop.call_soon_threadsafe(call, argument)

    # In the loop

    def _take(self, data: bytes) -> None:
        if self._received is not None and not self._why:
            self._received(data)

    def _lose(self, why: str) -> None:
        self._why = self._why or why
        self._say_lost()

    def _say_lost(self) -> None:
        if self._lost is not None:
            say, self._lost = self._lost, None
            say(lost(self.url, self._why))
