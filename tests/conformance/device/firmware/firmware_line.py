"""A line to a virtual controller whose firmware has a defect: it cuts frames both ways and spoils them.

A defect is a :class:`Firmware` with one of its methods overridden. As it stands it is right, and what passes
is what would have passed without it, byte for byte and at the same instant.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable
from itertools import count

from firmware_frames import Frame, cut, is_message, is_whole

from stagewire.links import Link


class Firmware:
    """What stands between a host and the controller as it should be. Made anew for each run."""

    pass_on: Callable[[bytes], None]
    """Gives bytes to the controller."""
    say: Callable[..., None]
    """Gives bytes to the host: ``say(raw, after=0.0)``, ``after`` seconds later."""
    now: Callable[[], float]
    """Seconds since the controller was made."""

    def begins(self) -> None:
        """Do something when the line is made."""

    def takes(self, frame: Frame) -> None:
        """Take a message of the host."""
        self.pass_on(frame.raw)

    def takes_odd(self, raw: bytes) -> None:
        """Take what is no message: an id that is none, a length that is wrong, a part of a frame, rubbish."""
        self.pass_on(raw)

    def says(self, frame: Frame) -> None:
        """Say what the controller says."""
        self.say(frame.raw)


class FaultyLink(Link):
    """A line in stepped time with broken firmware at its other end.

    :param link: to the controller as it should be.
    :param status: which layout a status has on the unit.
    """

    def __init__(self, link: Link, firmware: Firmware, status: str = "") -> None:
        assert link.clock is not None  # in real time nothing here would be the same again
        self.url = link.url
        self.clock = link.clock
        self.firmware = firmware
        self._link = link
        self._status = status
        self._partial = b""
        self._later: list[tuple[float, int, bytes]] = []
        self._number = count()
        firmware.pass_on = link.write
        firmware.say = self._say
        firmware.now = link.clock
        firmware.begins()

    def read(self, timeout: float) -> bytes:
        """Return what the firmware says until ``timeout`` seconds are over."""
        end = self.clock() + timeout
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
        """Give the firmware what the host sends, message by message."""
        pieces = [*cut(data)]
        if all(map(is_message, pieces)):
            for piece in pieces:
                self.firmware.takes(Frame(piece, self._status))
        else:
            self.firmware.takes_odd(data)

    def write_now(self, data: bytes) -> None:
        """Do as :meth:`write` does."""
        self.write(data)

    def wake(self) -> None:
        """Let the next read return at once."""
        self._link.wake()

    def close(self) -> None:
        """Hang up."""
        self._link.close()

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
