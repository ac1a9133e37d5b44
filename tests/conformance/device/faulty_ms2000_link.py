"""A line to a virtual MS-2000 on which something is wrong: the controller behaves like broken firmware."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from stagewire.framing import CommandReceived
from stagewire.links import Link
from stagewire.protocols import Command, CommandFrame
from stagewire_ms2000 import PROTOCOL
from stagewire_virtual import VirtualController
from stagewire_virtual.linking import SteppedLink


class FaultyMs2000Link(Link):
    """A stepped line; a test overrides what it spoils.

    Whole commands reach the controller one by one, by :meth:`command`, and what is none by :meth:`other`.
    What is not whole waits, as it does in a controller.
    """

    def __init__(self, controller: VirtualController) -> None:
        self._line = SteppedLink(controller)
        self.controller = controller
        self.url = self._line.url
        self.clock = self._line.clock
        self.waiting = b""
        self.framer = PROTOCOL.framer()
        self.count = 0
        """Commands that came so far."""

    def on(self, raw: bytes) -> bytes:
        """Let the controller have some bytes, and return what it says at this instant."""
        self._line.write(raw)
        return self._line.read(0)

    def ask(self, command: Command, axis: int = 0x18) -> bytes:
        """Ask the controller behind the back of the host."""
        return self.on(command.pack(axis))

    # Faults

    def command(self, frame: CommandFrame, raw: bytes) -> bytes:
        """Return what comes of a command."""
        return self.on(raw)

    def other(self, raw: bytes) -> bytes:
        """Return what comes of bytes that are no command."""
        return self.on(raw)

    def unasked(self) -> bytes:
        """Return what comes while the host waits."""
        return b""

    # As a line

    def read(self, timeout: float) -> bytes:
        if not self.waiting:
            self.waiting = self._line.read(timeout) + self.unasked()
        said, self.waiting = self.waiting, b""
        return said

    def write(self, data: bytes) -> None:
        for event in self.framer.feed(data):
            if isinstance(event, CommandReceived):
                self.count += 1
                self.waiting += self.command(event.frame, event.raw)
            else:
                self.waiting += self.other(event.raw)

    def write_now(self, data: bytes) -> None:
        raise AssertionError("the suite writes whole commands")

    def wake(self) -> None:
        self._line.wake()

    def close(self) -> None:
        self._line.close()


class Slow(FaultyMs2000Link):
    """A line on which each reply comes so many seconds after what was sent last."""

    def __init__(self, controller: VirtualController, seconds: float) -> None:
        super().__init__(controller)
        self._seconds = seconds
        self._due = 0.0

    def write(self, data: bytes) -> None:
        super().write(data)
        self._due = self.clock() + self._seconds

    def read(self, timeout: float) -> bytes:
        left = self._due - self.clock()
        if self.waiting and left > 0:
            self.controller.advance(max(0.0, min(timeout, left)))
            if timeout < left:
                return b""
        return super().read(timeout)


Make = Callable[[VirtualController], FaultyMs2000Link]
Change = Callable[[bytes, CommandFrame], bytes]


def answers(change: Change, *commands: type[Command]) -> Make:
    """Return a line that changes the answers to some commands; to all without any.

    Where a request is not answered, because it comes in the other format, it stays so.
    """

    class Answers(FaultyMs2000Link):
        def command(self, frame: CommandFrame, raw: bytes) -> bytes:
            answer = super().command(frame, raw)
            hit = isinstance(frame.message, commands) if commands else True
            due = answer or (commands and frame.message.reply is None)
            return change(answer, frame) if hit and due else answer

    return Answers


def drops(*commands: type[Command]) -> Make:
    """Return a line on which some commands do nothing."""
    return passes(lambda frame, raw: [] if isinstance(frame.message, commands) else [raw])


def passes(change: Callable[[CommandFrame, bytes], Iterable[bytes]]) -> Make:
    """Return a line on which other bytes reach the controller instead of a command."""

    class Passes(FaultyMs2000Link):
        def command(self, frame: CommandFrame, raw: bytes) -> bytes:
            return b"".join(self.on(each) for each in change(frame, raw))

    return Passes
