"""A line in memory whose time goes on when its host waits; for tests without a thread."""

from __future__ import annotations

import contextlib

from stagewire.errors import TransportLost
from stagewire.links import Link
from stagewire_virtual.clock import SECOND
from stagewire_virtual.controller import VirtualController
from stagewire_virtual.errors import UnpluggedError

__all__ = ["SteppedLink"]

_LEAST = 1 / SECOND  # what is shorter than the clock can tell would never pass


class SteppedLink(Link):
    """A line to a :class:`.VirtualController`, for a session that waits in one thread.

    A read that waits lets just as much time pass as it takes until something comes; a move of a minute takes
    none. A session takes its time from :attr:`clock`, and starts no thread that would read.

    :param controller: made by the test, which may look at it, and close it, as it likes.
    """

    def __init__(self, controller: VirtualController) -> None:
        self.url = f"virtual://{controller.label}"
        self.clock = lambda: controller.clock.now / SECOND
        self._line = controller.link
        self._woken = False
        self._closed = False

    def read(self, timeout: float) -> bytes:
        """Return what the controller said, and let ``timeout`` seconds pass at most."""
        self._check_open()
        if self._woken:
            self._woken, timeout = False, 0
        try:
            return self._line.read(timeout=max(timeout, _LEAST) if timeout > 0 else 0)
        except UnpluggedError:
            raise TransportLost(f"{self.url}: the line to the controller was unplugged") from None

    def write(self, data: bytes) -> None:
        """Send bytes to the controller, which takes them at this instant."""
        self._check_open()
        try:
            self._line.write(data)
        except UnpluggedError as error:
            raise TransportLost(f"{self.url}: {error}") from None

    def write_now(self, data: bytes) -> None:
        """Send bytes if that can be done; see :meth:`.Link.write_now`."""
        with contextlib.suppress(TransportLost):
            self.write(data)

    def wake(self) -> None:
        """Let the next read return without letting time pass."""
        self._woken = True

    def close(self) -> None:
        """Use the line no more; the controller stays as it is."""
        self._closed = True

    def _check_open(self) -> None:
        if self._closed:
            raise TransportLost(f"{self.url}: the line was closed")
