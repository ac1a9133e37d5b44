"""A link for threads on a descriptor that the system can wait for: a socket, or a port of POSIX.

One call of the system waits until a descriptor can be read or written, and can be woken from another thread.
"""

from __future__ import annotations

import contextlib
import select
import socket
import sys
import threading
import time
from collections.abc import Callable

from stagewire._links.link import CLOSED, Link, because, lost, stalled
from stagewire.errors import TransportLostError

_LONGEST = 86_400.0  # seconds; the system counts milliseconds in 32 bits

# Windows has no poll, and that of macOS does not work on every port.
_HAS_POLL = hasattr(select, "poll") and sys.platform not in ("darwin", "win32")


def has_input(descriptor: int) -> bool:
    """Return at once whether there is something to read; not if the descriptor was closed meanwhile."""
    if _HAS_POLL:
        poll = select.poll()
        poll.register(descriptor, select.POLLIN)
        return any(event & select.POLLIN for _, event in poll.poll(0))
    with contextlib.suppress(OSError, ValueError):
        return bool(select.select((descriptor,), (), (), 0)[0])
    return False


class Readiness:
    """Waits for one descriptor.

    :param descriptor: a socket or, where the system can wait for it, a port.
    """

    def __init__(self, descriptor: int) -> None:
        self._descriptor = descriptor
        self._wakes, self._wakened = socket.socketpair()
        self._wakes.setblocking(False)
        self._wakened.setblocking(False)
        self._wakened_descriptor = self._wakened.fileno()
        if _HAS_POLL:
            self._poll = select.poll()
            self._poll.register(descriptor, select.POLLIN)
            self._poll.register(self._wakened_descriptor, select.POLLIN)

    def readable(self, timeout: float) -> bool:
        """Wait at most ``timeout`` seconds; return whether there is something to read.

        Being woken ends the waiting. A descriptor that is gone can be read: it says so then.
        """
        timeout = min(timeout, _LONGEST)
        if _HAS_POLL:
            ready = [descriptor for descriptor, _ in self._poll.poll(timeout * 1000)]
        else:
            both = (self._descriptor, self._wakened_descriptor)
            ready = select.select(both, (), (), timeout)[0]
        if not ready:
            return False
        if self._descriptor in ready:
            return True  # a waking stays for the next time
        with contextlib.suppress(OSError):
            self._wakened.recv(4096)
        return False

    def has_input(self) -> bool:
        """Return at once whether there is something to read, while another thread may wait for it."""
        return has_input(self._descriptor)

    def writable(self, timeout: float) -> bool:
        """Wait at most ``timeout`` seconds; return whether something can be written."""
        if _HAS_POLL:
            poll = select.poll()
            poll.register(self._descriptor, select.POLLOUT)
            return bool(poll.poll(timeout * 1000))
        return bool(select.select((), (self._descriptor,), (), timeout)[1])

    def wake(self) -> None:
        """End the waiting for something to read, or the next one."""
        with contextlib.suppress(OSError):  # full: it is woken already; closed: nobody waits
            self._wakes.send(b"!")

    def close(self) -> None:
        """Wait no more."""
        self._wakes.close()
        self._wakened.close()


CHUNK = 16_384
"""Bytes that are read at once, at most."""

_LOOK_UP = 0.1  # seconds: how often a write that is stalled looks whether the line was closed


class DescriptorLink(Link):
    """A line on a descriptor that does not block.

    :param url: for people.
    :param descriptor: what to wait for.
    :param take: reads at most so many bytes; ``b""`` means that the other end is gone.
    :param give: writes what is taken at once, and returns how much.
    :param shut: gives the descriptor back; called once.
    :param gone: what ``b""`` means, in words.
    :param stall_timeout: seconds after which a line that takes nothing is gone.
    :param lost: makes the error of a line that is gone, of its URL and the reason.
    """

    def __init__(
        self,
        url: str,
        descriptor: int,
        take: Callable[[int], bytes],
        give: Callable[[bytes | memoryview], int],
        shut: Callable[[], None],
        gone: str,
        stall_timeout: float,
        lost: Callable[[str, str], TransportLostError] = lost,
    ) -> None:
        self.url = url
        self._take = take
        self._give = give
        self._shut = shut
        self._gone = gone
        self._stall_timeout = stall_timeout
        self._lost = lost
        self._readiness = Readiness(descriptor)
        self._why = ""  # why nothing can be done any more
        self._is_taking = False  # bytes are on their way from the system to who has called read
        # Reentrant, as a signal handler may close the line in the midst of a read or write of its thread.
        self._reading = threading.RLock()
        self._writing = threading.RLock()
        self._closing = threading.RLock()

    def read(self, timeout: float) -> bytes:
        """Return what came; see :meth:`.Link.read`."""
        with self._reading:
            self._is_taking = False
            if self._why:
                raise self._lost(self.url, self._why)
            if timeout > 0 and not self._readiness.readable(timeout):
                if self._why:
                    raise self._lost(self.url, self._why)
                return b""
            self._is_taking = True
            try:
                data = self._take(CHUNK)
            except BlockingIOError:
                self._is_taking = False
                return b""
            except OSError as error:
                raise self._lose(because(error)) from error
            if not data:
                raise self._lose(self._gone)
            return data

    def write(self, data: bytes) -> None:
        """Send all bytes; see :meth:`.Link.write`."""
        with self._writing:
            sent = self._write_some(data)
            if sent < len(data):
                try:
                    self._write_rest(memoryview(data)[sent:])
                except BaseException:  # what is written next would be taken for the rest
                    self._lose("a write was interrupted in its midst")
                    raise

    def write_now(self, data: bytes) -> None:
        """Send what is taken at once; see :meth:`.Link.write_now`."""
        if not self._why:
            with contextlib.suppress(OSError, ValueError):
                self._give(data)

    def has_unread(self) -> bool:
        """Say whether something came that was not dealt with; see :meth:`.Link.has_unread`."""
        # In this order: what the system has no more is being taken.
        return not self._why and (self._readiness.has_input() or self._is_taking)

    def note_dealt_with(self) -> None:
        """Note that what was read was dealt with; see :meth:`.Link.note_dealt_with`."""
        self._is_taking = False

    def wake(self) -> None:
        """End a read; see :meth:`.Link.wake`."""
        self._readiness.wake()

    def close(self) -> None:
        """Give the line back; see :meth:`.Link.close`."""
        with self._closing:
            if self._why != CLOSED:
                self._why = CLOSED
                self._readiness.wake()
                with (
                    self._reading,
                    self._writing,
                ):  # nobody is at the descriptor, which is soon another's
                    self._readiness.close()
                    self._shut()

    def _write_some(self, data: bytes | memoryview) -> int:
        if self._why:
            raise self._lost(self.url, self._why)
        try:
            return self._give(data)
        except BlockingIOError:
            return 0
        except OSError as error:
            raise self._lose(because(error)) from error

    def _write_rest(self, rest: memoryview) -> None:
        end = time.monotonic() + self._stall_timeout
        while rest:
            if self._readiness.writable(_LOOK_UP) and (sent := self._write_some(rest)):
                rest = rest[sent:]
                end = time.monotonic() + self._stall_timeout
            elif self._why:
                raise self._lost(self.url, self._why)
            elif time.monotonic() >= end:
                raise self._lose(stalled(self._stall_timeout))

    def _lose(self, why: str) -> TransportLostError:
        """Use the line no more; whoever waits elsewhere learns it, too."""
        self._why = self._why or why
        self._readiness.wake()
        return self._lost(self.url, self._why)
