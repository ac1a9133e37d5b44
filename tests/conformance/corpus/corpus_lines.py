"""Lines to the firmware of the corpus, on a stepped clock and in real time, and its declarations."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable
from typing import Protocol

from stagewire.errors import TransportLostError
from stagewire.links import Link


class Firmware(Protocol):
    """A controller: bytes in, bytes out, and the instant at which it does something by itself."""

    def write(self, data: bytes) -> None: ...

    def read(self) -> bytes: ...

    def due(self) -> float: ...


Maker = Callable[[Callable[[], float]], Firmware]


class CorpusLink(Link):
    """The common part of both lines."""

    url = "corpus://firmware"
    _woken = False
    _closed = False
    firmware: Firmware

    def write(self, data: bytes) -> None:
        self._check_open()
        self.firmware.write(data)

    def write_now(self, data: bytes) -> None:
        if not self._closed:
            self.firmware.write(data)

    def wake(self) -> None:
        self._woken = True

    def close(self) -> None:
        self._closed = True

    def _check_open(self) -> None:
        if self._closed:
            raise TransportLostError(f"{self.url}: the line was closed")


class SteppedCorpusLink(CorpusLink):
    """A line whose clock runs while the host waits."""

    def __init__(self, make: Maker) -> None:
        self.now = 0.0
        self.clock = lambda: self.now
        self.firmware = make(self.clock)

    def read(self, timeout: float) -> bytes:
        self._check_open()
        end = self.now + (0 if self._woken else timeout)
        self._woken = False
        while not (data := self.firmware.read()) and self.now < end:
            self.now = max(math.nextafter(self.now, math.inf), min(end, self.firmware.due()))
        return data


class RealTimeCorpusLink(CorpusLink):
    """A line in real time."""

    def __init__(self, make: Maker) -> None:
        self._lock = threading.Condition()
        self.firmware = make(time.monotonic)

    def read(self, timeout: float) -> bytes:
        end = time.monotonic() + timeout
        with self._lock:
            while True:
                self._check_open()
                if data := self.firmware.read():
                    return data
                now = time.monotonic()
                if self._woken or now >= end:
                    self._woken = False
                    return b""
                self._lock.wait(max(0.0, min(end, self.firmware.due()) - now))

    def write(self, data: bytes) -> None:
        with self._lock:
            super().write(data)
            self._lock.notify()

    def write_now(self, data: bytes) -> None:
        with self._lock:
            super().write_now(data)
            self._lock.notify()

    def wake(self) -> None:
        with self._lock:
            self._woken = True
            self._lock.notify()
