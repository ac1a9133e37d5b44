"""Waiting until a descriptor can be read or written, in one call of the system, and being woken from it."""

from __future__ import annotations

import contextlib
import select
import socket
import sys

__all__ = ["Readiness", "has_input"]

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
