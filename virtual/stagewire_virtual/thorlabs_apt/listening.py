"""From the bytes of the host to frames, without waiting for ever for the rest of one."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from stagewire import End, FramedProtocol
from stagewire.framing import Event
from stagewire_virtual.clock import SECOND, Clock

__all__ = ["PATIENCE", "Listener"]

PATIENCE: Final = SECOND
"""How long the rest of a frame is waited for. The document has no such time; without one, a length that was
damaged would swallow what comes after it."""


class Listener:
    """Cuts what the host sends into frames.

    :param protocol: whose frames they are.
    :param clock: the time.
    :param take: takes each event of the framer.
    """

    def __init__(
        self, protocol: FramedProtocol, clock: Clock, take: Callable[[Event], None]
    ) -> None:
        self._protocol = protocol
        self._clock = clock
        self._take = take
        self._heard = 0  # when the last bytes came
        self._waits = False  # one timer at most, however finely the bytes are cut
        self.begin_anew()

    def begin_anew(self) -> None:
        """Forget what has come of a frame."""
        self._framer = self._protocol.framer(End.DEVICE)

    def hear(self, data: bytes) -> None:
        """Take what the host sends, cut at any byte."""
        self._heard = self._clock.now
        for event in self._framer.feed(data):
            self._take(event)
        if self._framer.pending and not self._waits:
            self._waits = True
            self._clock.call_later(PATIENCE, self._look)

    def _look(self) -> None:
        """Give up what waits if nothing has come for long; frames behind a damaged length are found so."""
        due = self._heard + PATIENCE
        self._waits = bool(self._framer.pending) 
        if self._waits:
            self._clock.call_at(due, self._look)
            return
        for event in self._framer.abandon():
            self._take(event)
