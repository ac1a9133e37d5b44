"""A line to a virtual controller with defective firmware: it splits frames both ways and changes them.

A defect is a :class:`Firmware` with an overridden method. The base class changes nothing: all bytes pass
unchanged and at the same time.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable
from itertools import count

from firmware_frames import Frame, cut, is_message, is_whole

from stagewire.links import Link
from wrapped_links import WrappedLink

_LEAST = 1e-9


class Firmware:
    """The layer between a host and a correct controller. One is made for each run."""

    pass_on: Callable[[bytes], None]
    """Passes bytes to the controller."""
    say: Callable[..., None]
    """Sends bytes to the host: ``say(raw, after=0.0)``, ``after`` seconds later."""
    now: Callable[[], float]
    """Seconds since the controller was made."""

    def begins(self) -> None:
        """Do something when the line is made."""

    def takes(self, frame: Frame) -> None:
        """Handle a message from the host."""
        self.pass_on(frame.raw)

    def takes_odd(self, raw: bytes) -> None:
        """Handle other bytes from the host: an unknown id, a wrong length, a part of a frame, garbage."""
        self.pass_on(raw)

    def says(self, frame: Frame) -> None:
        """Handle a message from the controller."""
        self.say(frame.raw)


class FaultyLink(WrappedLink):
    """A line in stepped time with defective firmware at the other end.

    :param link: to a correct controller.
    :param status: the status layout of the unit.
    """

    def __init__(self, link: Link, firmware: Firmware, status: str = "") -> None:
        assert link.clock is not None  # real time would not be reproducible
        super().__init__(link)
        self.firmware = firmware
        self._status = status
        self._partial = b""
        self._later: list[tuple[float, int, bytes]] = []
        self._number = count()
        firmware.pass_on = link.write
        firmware.say = self._say
        firmware.now = link.clock
        firmware.begins()

    def read(self, timeout: float) -> bytes:
        """Return the output of the firmware within ``timeout`` seconds."""
        # a shorter time than the resolution of the clock would never pass
        end = self.clock() + (max(timeout, _LEAST) if timeout > 0 else 0)
        while not (said := self._due()):
            now = self.clock()
            until = min(end, self._later[0][0]) if self._later else end
            data = self._link.read(max(0.0, until - now))
            if data:
                self._hear(data)
            elif self.clock() >= end:
                return self._due()
        return said

    def write(self, data: bytes) -> None:
        """Pass the bytes of the host to the firmware, message by message."""
        pieces = [*cut(data)]
        if all(map(is_message, pieces)):
            for piece in pieces:
                self.firmware.takes(Frame(piece, self._status))
        else:
            self.firmware.takes_odd(data)

    def _hear(self, data: bytes) -> None:
        pieces = [*cut(self._partial + data)]
        self._partial = b"" if is_whole(pieces[-1]) else pieces.pop()
        for piece in pieces:
            self.firmware.says(Frame(piece, self._status))

    def _say(self, raw: bytes, after: float = 0.0) -> None:
        heapq.heappush(self._later, (self.clock() + after, next(self._number), raw))

    def _due(self) -> bytes:
        said = b""
        while self._later and self._later[0][0] <= self.clock():
            said += heapq.heappop(self._later)[2]
        return said
