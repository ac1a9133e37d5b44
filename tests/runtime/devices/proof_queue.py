"""A line in memory that several threads use concurrently, in real time."""

from __future__ import annotations

import threading

from proof_line import FarEnd

from stagewire.errors import TransportLostError
from stagewire.links import Link


class QueueLink(Link):
    """The host's end of the line, which ignores the delays of the far end."""

    url = "memory://"

    def __init__(self, far: FarEnd) -> None:
        self._far = far
        self._ready = threading.Condition()
        self._waiting = bytearray()
        self._woken = self._closed = False

    def read(self, timeout: float) -> bytes:
        with self._ready:
            self._ready.wait_for(lambda: self._waiting or self._woken or self._closed, timeout)
            if self._closed:
                raise TransportLostError("closed")
            self._woken = False
            data = bytes(self._waiting)
            self._waiting.clear()
            return data

    def write(self, data: bytes) -> None:
        with self._ready:
            self._waiting += b"".join(said for _, said in self._far.take(data) if said)
            self._ready.notify_all()

    def write_now(self, data: bytes) -> None:
        self.write(data)

    def wake(self) -> None:
        with self._ready:
            self._woken = True
            self._ready.notify_all()

    def close(self) -> None:
        with self._ready:
            self._closed = True
            self._ready.notify_all()
