"""A link for threads on a descriptor that the system can wait for: a socket or a POSIX port.

One system call waits until a descriptor is readable or writable. Another thread can interrupt the wait.
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

_LONGEST = 86_400.0  # seconds; the system uses milliseconds in 32 bits

# Windows has no poll, and poll on macOS does not work for all ports.
_HAS_POLL = hasattr(select, "poll") and sys.platform not in ("darwin", "win32")


def has_input(descriptor: int) -> bool:
    """Return immediately whether bytes can be read; False if the descriptor was closed meanwhile."""
    if _HAS_POLL:
        poll = select.poll()
        poll.register(descriptor, select.POLLIN)
        return any(event & select.POLLIN for _, event in poll.poll(0))
    with contextlib.suppress(OSError, ValueError):
        return bool(select.select((descriptor,), (), (), 0)[0])
    return False


class Readiness:
    """A wait for one descriptor that another thread can interrupt.

    :param descriptor: a socket or, if the system can wait for it, a port.
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
        """Wait at most ``timeout`` seconds, and return whether bytes can be read.

        :meth:`wake` ends the wait. A lost descriptor counts as readable: reading it reports the loss.
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
            return True  # a wake-up is kept for the next call
        with contextlib.suppress(OSError):
            self._wakened.recv(4096)
        return False

    def has_input(self) -> bool:
        """Return immediately whether bytes can be read, even while another thread waits for them."""
        return has_input(self._descriptor)

    def writable(self, timeout: float) -> bool:
        """Wait at most ``timeout`` seconds, and return whether bytes can be written."""
        if _HAS_POLL:
            poll = select.poll()
            poll.register(self._descriptor, select.POLLOUT)
            return bool(poll.poll(timeout * 1000))
        return bool(select.select((), (self._descriptor,), (), timeout)[1])

    def wake(self) -> None:
        """End the current :meth:`readable`, or the next one if none is waiting."""
        with contextlib.suppress(OSError):  # full: already woken; closed: nothing waits
            self._wakes.send(b"!")

    def close(self) -> None:
        """Release the sockets; no call may be waiting."""
        self._wakes.close()
        self._wakened.close()


CHUNK = 16_384
"""Largest number of bytes per read."""

_LOOK_UP = 0.1  # seconds between checks of a stalled write whether the link was closed


class DescriptorLink(Link):
    """A link on a non-blocking descriptor.

    :param url: the link, for people.
    :param descriptor: the descriptor to wait for.
    :param take: reads at most this many bytes; ``b""`` means that the other end has closed the link.
    :param give: writes as much as possible without waiting, and returns how much.
    :param shut: closes the descriptor; called once.
    :param gone: the meaning of ``b""``, in words.
    :param stall_timeout: seconds without progress in writing after which the link is lost.
    :param lost: returns the error of a lost link for its URL and the reason.
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
        self._why = ""  # why the link cannot be used any more
        self._is_taking = False  # bytes were read that are not processed yet
        # Reentrant, because a signal handler may close the link while its thread reads or writes.
        self._reading = threading.RLock()
        self._writing = threading.RLock()
        self._closing = threading.RLock()

    def read(self, timeout: float) -> bytes:
        """Return received bytes; see :meth:`.Link.read`."""
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
                except BaseException:  # the next write would be mistaken for the rest
                    self._lose("a write was interrupted halfway")
                    raise

    def write_now(self, data: bytes) -> None:
        """Send as much as possible without waiting; see :meth:`.Link.write_now`."""
        if not self._why:
            with contextlib.suppress(OSError, ValueError):
                self._give(data)

    def has_unread(self) -> bool:
        """Return whether there are unprocessed bytes; see :meth:`.Link.has_unread`."""
        # In this order: bytes that have left the system set _is_taking.
        return not self._why and (self._readiness.has_input() or self._is_taking)

    def note_dealt_with(self) -> None:
        """Note that the bytes of the last read were processed; see :meth:`.Link.note_dealt_with`."""
        self._is_taking = False

    def wake(self) -> None:
        """End a read; see :meth:`.Link.wake`."""
        self._readiness.wake()

    def close(self) -> None:
        """Close the link; see :meth:`.Link.close`."""
        with self._closing:
            if self._why != CLOSED:
                self._why = CLOSED
                self._readiness.wake()
                with (
                    self._reading,
                    self._writing,
                ):  # nothing uses the descriptor, whose number may be reused
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
        """Mark the link as lost, and end other waits so that they notice."""
        self._why = self._why or why
        self._readiness.wake()
        return self._lost(self.url, self._why)
