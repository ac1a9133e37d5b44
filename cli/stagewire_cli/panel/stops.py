"""The stop of all axes, which waits neither for the screen nor for any axis."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence
from queue import SimpleQueue
from typing import Final, Protocol

_REPEAT: Final = 0.25
"""Seconds after a stop in which a repeated order, as from a held key, is not sent again. Axes refuse motions
for longer after each order."""


class Stoppable(Protocol):
    """An axis that can be stopped."""

    name: str

    def forbid(self) -> None:
        """Refuse motions that have been asked for but not sent; never waits."""

    def stop(self) -> None:
        """Send a stop and wait for its answer; raises no error."""


class Stops:
    """Sends a stop to each axis on a thread of its own, so that no axis waits for another.

    :param axes: all axes.
    :param clock: monotonic time in seconds.
    """

    def __init__(
        self, axes: Sequence[Stoppable], clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._axes = axes
        self._clock = clock
        self._orders: SimpleQueue[bool] = SimpleQueue()
        self._sending: list[threading.Thread] = []
        self._thread = threading.Thread(target=self._serve, name="panel stops", daemon=True)
        self._thread.start()

    def order(self) -> None:
        """Stop all axes; returns at once. Can be called by any thread, and by a signal handler."""
        self._orders.put(True)

    def close(self, patience: float) -> None:
        """Send a last stop, and wait for the answers.

        :param patience: seconds to wait.
        """
        self.order()
        self._orders.put(False)
        deadline = time.monotonic() + patience
        self._thread.join(patience)
        for thread in self._sending:
            thread.join(max(deadline - time.monotonic(), 0))

    def _serve(self) -> None:
        sent = -_REPEAT
        while self._orders.get():
            now = self._clock()
            for axis in self._axes:
                axis.forbid()
            if now - sent < _REPEAT:  # no axis has accepted a motion since
                continue
            sent = now
            self._sending = [thread for thread in self._sending if thread.is_alive()]
            for axis in self._axes:
                thread = threading.Thread(
                    target=axis.stop, name=f"stop of {axis.name}", daemon=True
                )
                try:
                    thread.start()
                except RuntimeError:  # the system has no more threads
                    axis.stop()
                else:
                    self._sending.append(thread)
