"""A line to a virtual MS-2000 that behaves like defective firmware."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from stagewire.framing import CommandReceived
from stagewire.protocols import Command, CommandFrame
from stagewire_ms2000 import PROTOCOL
from stagewire_virtual import VirtualController
from stagewire_virtual.linking import SteppedLink
from wrapped_links import WrappedLink


class FaultyMs2000Link(WrappedLink):
    """A stepped line; tests override methods to add faults.

    :meth:`command` receives whole commands one by one, and :meth:`other` all other bytes. Incomplete commands
    wait, as in a controller.
    """

    def __init__(self, controller: VirtualController) -> None:
        super().__init__(SteppedLink(controller))
        self.controller = controller
        self.waiting = b""
        self.framer = PROTOCOL.framer()
        self.count = 0
        """The number of commands so far."""

    def on(self, raw: bytes) -> bytes:
        """Pass bytes to the controller and return its immediate output."""
        self._link.write(raw)
        return self._link.read(0)

    def ask(self, command: Command, axis: int = 0x18) -> bytes:
        """Send a request to the controller without the host noticing."""
        return self.on(command.pack(axis))

    # Faults

    def command(self, frame: CommandFrame, raw: bytes) -> bytes:
        """Return the output for a command."""
        return self.on(raw)

    def other(self, raw: bytes) -> bytes:
        """Return the output for bytes that are not a command."""
        return self.on(raw)

    def unasked(self) -> bytes:
        """Return unsolicited output while the host waits."""
        return b""

    # The link

    def read(self, timeout: float) -> bytes:
        if not self.waiting:
            self.waiting = self._link.read(timeout) + self.unasked()
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
        raise AssertionError("the suite never calls write_now here")


class Slow(FaultyMs2000Link):
    """A line that delays each reply by a number of seconds after the last write."""

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
    """Return a line that changes the answers to some commands; to all if none are given.

    A request that is not answered, because the controller is in the other format, stays unanswered.
    """

    class Answers(FaultyMs2000Link):
        def command(self, frame: CommandFrame, raw: bytes) -> bytes:
            answer = super().command(frame, raw)
            hit = isinstance(frame.message, commands) if commands else True
            due = answer or (commands and frame.message.reply is None)
            return change(answer, frame) if hit and due else answer

    return Answers


def drops(*commands: type[Command]) -> Make:
    """Return a line that ignores some commands."""
    return passes(lambda frame, raw: [] if isinstance(frame.message, commands) else [raw])


def passes(change: Callable[[CommandFrame, bytes], Iterable[bytes]]) -> Make:
    """Return a line that passes other bytes to the controller instead of a command."""

    class Passes(FaultyMs2000Link):
        def command(self, frame: CommandFrame, raw: bytes) -> bytes:
            return b"".join(self.on(each) for each in change(frame, raw))

    return Passes
