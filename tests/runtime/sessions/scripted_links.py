"""Links for tests of sessions: the test plays the controller."""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import Callable

from stagewire import End, Frame, FramedMessage
from stagewire.errors import TransportLostError
from stagewire.links import AsyncLink, Link
from stagewire_apt import PROTOCOL
from stagewire_apt import messages as m

HOST, USB = 0x01, 0x50
BAYS = (0x21, 0x22, 0x23)

Answer = Callable[[bytes], bytes]
"""Returns the reply of a controller to the bytes written."""


def silent(data: bytes) -> bytes:
    return b""


class TestLink(Link):
    """A link for threads."""

    __test__ = False

    def __init__(self, answer: Answer = silent) -> None:
        self.url = "test://"
        self.answer = answer
        self.written: list[bytes] = []
        self.told_now: list[bytes] = []
        self.closed = False
        self._said = bytearray()
        self._woken = False
        self._error: str | None = None
        self._changed = threading.Condition()

    def say(self, data: bytes) -> None:
        with self._changed:
            self._said += data
            self._changed.notify_all()

    def unplug(self) -> None:
        with self._changed:
            self._error = "the plug was pulled"
            self._changed.notify_all()

    def read(self, timeout: float) -> bytes:
        end = time.monotonic() + timeout
        with self._changed:
            while not self._said:
                if self._error:
                    raise TransportLostError(self._error)
                left = end - time.monotonic()
                if self._woken or left <= 0:
                    self._woken = False
                    return b""
                self._changed.wait(left)
            data = bytes(self._said)
            self._said.clear()
            return data

    def write(self, data: bytes) -> None:
        if self._error:
            raise TransportLostError(self._error)
        self.written.append(data)
        if said := self.answer(data):
            self.say(said)

    def write_now(self, data: bytes) -> None:
        self.told_now.append(data)

    def wake(self) -> None:
        with self._changed:
            self._woken = True
            self._changed.notify_all()

    def close(self) -> None:
        self.closed = True
        with self._changed:
            self._error = "the line was closed"
            self._changed.notify_all()


class AsyncTestLink(AsyncLink):
    """A link for an event loop."""

    def __init__(self, answer: Answer = silent) -> None:
        self.url = "test://"
        self.answer = answer
        self.written: list[bytes] = []
        self.told_now: list[bytes] = []
        self.closed = False

    def start(
        self, received: Callable[[bytes], None], lost: Callable[[TransportLostError], None]
    ) -> None:
        self._received, self._lost = received, lost

    def say(self, data: bytes) -> None:
        asyncio.get_running_loop().call_soon(self._received, data)

    def unplug(self) -> None:
        self._lost(TransportLostError("the plug was pulled"))

    def write(self, data: bytes) -> None:
        self.written.append(data)
        if said := self.answer(data):
            self.say(said)

    def write_now(self, data: bytes) -> None:
        self.told_now.append(data)

    async def close(self) -> None:
        self.closed = True


# A controller that answers according to the request


def answer(data: bytes) -> bytes:
    """Return the replies to all requests in the bytes of one write."""
    framer = PROTOCOL.framer(End.DEVICE)
    return b"".join(said(event.frame) for event in framer.feed(data))


def said(request: Frame) -> bytes:
    """Return the reply to one request; its values are built from channel and address."""
    chan, dest = getattr(request.message, "chan_ident", 1), request.dest
    match request.message:
        case m.MotReqVelParams():
            reply: FramedMessage = velocity(chan, dest)
        case m.MotReqJogParams():
            reply = jog(chan, dest)
        case m.MotMoveStop():
            reply = m.MotMoveStoppedHeader(chan)
        case m.MotMoveHome():
            reply = m.MotMoveHomed(chan)
        case _:
            return b""
    return reply.pack(HOST, dest)


def velocity(chan: int = 1, dest: int = USB) -> m.MotGetVelParams:
    return m.MotGetVelParams(chan, min_velocity=dest, acceleration=3, max_velocity=4)


def jog(chan: int = 1, dest: int = USB) -> m.MotGetJogParams:
    return m.MotGetJogParams(chan, 1, dest, 1, 2, 3, 2)
