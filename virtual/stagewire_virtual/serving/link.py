"""Links between a host and a far end: the counting, the watching and the bounds that all kinds share.

The simplest kind is here, too: the link in memory, for tests, on which the host writes and reads, and lets
time go on.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import ClassVar, Final, TypeAlias

from stagewire.errors import BadValueError
from stagewire_virtual.clock import Clock, nanoseconds, passes
from stagewire_virtual.errors import UnpluggedError
from stagewire_virtual.faults.link import FaultEvent, FaultyLink
from stagewire_virtual.instrument import Instrument

BACKLOG: Final = 64 * 1024
"""Bytes that are kept for a host that does not read; frames beyond them are dropped whole."""

FarEnd: TypeAlias = Instrument | FaultyLink
"""What a host talks to: an instrument, by itself or behind faults."""

Maker: TypeAlias = Callable[[Clock], FarEnd]
"""Makes a far end on a clock."""

Run: TypeAlias = Callable[[Callable[[], None]], None]
"""Does something at the present instant of a clock; see :func:`at_this_instant`."""


class Observer:
    """Hears what goes over links; does nothing of its own. Times are nanoseconds of the link's clock."""

    def received(self, link: Link, when: int, data: bytes) -> None:
        """Hear of bytes of the host, as they came."""

    def sent(self, link: Link, when: int, data: bytes) -> None:
        """Hear of what goes to the host: one frame, unless a fault made something else of it."""

    def noted(self, link: Link, when: int, text: str) -> None:
        """Hear of what a person would want to know, such as that a second host was turned away."""


class Link:
    """One end of a line, with the far end behind it; the base of all kinds.

    :param far_end: what speaks and listens here.
    :param label: for people.
    :param observer: hears of all that goes over it.
    """

    limit: ClassVar = BACKLOG

    def __init__(
        self, far_end: FarEnd, *, label: str = "", observer: Observer | None = None
    ) -> None:
        self.far_end = far_end
        self.instrument: Instrument
        """What is at the end of the line, behind the faults if there are some."""
        if isinstance(far_end, FaultyLink):
            self.instrument = far_end.instrument
            far_end.on_disconnect = self.disconnect
            far_end.on_fault = self._note_fault
        else:
            self.instrument = far_end
        self.instrument.on_refusal = self.note
        far_end.on_send = self._say
        self.label = label
        self.observer = observer or Observer()
        self.received = 0
        """Bytes of the host."""
        self.sent = 0
        """Frames to the host; what is said while no host is connected is lost and not counted."""
        self.dropped = 0
        """Frames that were dropped because the host did not read."""
        self._dropping = False
        self._run: Run = lambda callback: at_this_instant(self.clock, callback)

    @property
    def clock(self) -> Clock:
        """The clock of the far end."""
        return self.instrument.clock

    # What each kind of line does in its own way

    @property
    def connected(self) -> bool:
        """Whether what is said reaches a host."""
        raise NotImplementedError

    def disconnect(self) -> None:
        """Pull the plug."""
        raise NotImplementedError

    def _backlog(self) -> int:
        """Return how many bytes wait for the host to read."""
        raise NotImplementedError

    def _put(self, data: bytes) -> None:
        """Send bytes to the host."""
        raise NotImplementedError

    # What all have in common

    def note(self, text: str) -> None:
        """Tell the observer something for people."""
        self.observer.noted(self, self.clock.now, text)

    def _note_fault(self, happened: FaultEvent) -> None:
        self.note(str(happened))

    def _greet(self) -> None:
        """Let the far end know that a host has come."""
        self._run(self.far_end.host_came)

    def _take(self, data: bytes) -> None:
        """Take bytes of the host."""
        self.received += len(data)
        self._run(lambda: self._pass_on(data))

    def _pass_on(self, data: bytes) -> None:
        self.observer.received(self, self.clock.now, data)
        self.far_end.receive(data)

    def _say(self, data: bytes) -> None:
        """Take what the far end says."""
        if not self.connected:
            return
        if self._backlog() + len(data) > self.limit:
            self.dropped += 1
            if not self._dropping:
                self.note(f"the host does not read: {self.limit // 1024} KiB wait, more is dropped")
            self._dropping = True
            return
        self._dropping = False
        self.sent += 1
        self.observer.sent(self, self.clock.now, data)
        self._put(data)


class ServedLink(Link):
    """A link that programs open from outside, on an event loop."""

    @property
    def url(self) -> str:
        """What a host opens; pyserial's ``serial_for_url`` understands it."""
        raise NotImplementedError

    async def open(self, run: Run) -> None:
        """Let hosts come; what they send is taken within ``run``.

        Raises :class:`~stagewire_virtual.errors.ServingError` where that cannot be.
        """
        raise NotImplementedError

    async def close(self) -> None:
        """Let no more hosts come and leave nothing behind; harmless when done twice."""
        raise NotImplementedError


def at_this_instant(clock: Clock, callback: Callable[[], None]) -> None:
    """Run ``callback`` as a timer of ``clock`` that is due now, after whatever else is due.

    Thus time stands still while a far end takes what came, also on a real clock, and nothing that should
    have happened before is still to come.
    """
    clock.call_at(clock.now, callback)
    clock.run_until(clock.now)


_LIMIT: Final = 16 * 1024 * 1024  # a test may let hours pass before it reads


class MemoryLink(Link):
    """A line whose host is a test in the same thread.

    What the host writes is taken at once, at the instant at which the clock stands; what the far end says
    waits until it is read, 16 MiB of it at most.
    """

    limit: ClassVar = _LIMIT

    def __init__(
        self, far_end: FarEnd, *, label: str = "", observer: Observer | None = None
    ) -> None:
        super().__init__(far_end, label=label, observer=observer)
        self._waiting = bytearray()
        self._connected = True
        self._greet()

    @property
    def connected(self) -> bool:
        """Whether the line is plugged in."""
        return self._connected

    @property
    def in_waiting(self) -> int:
        """How many bytes can be read without letting time pass."""
        return len(self._waiting)

    def disconnect(self) -> None:
        """Pull the plug: what was said before can still be read, nothing else."""
        self._connected = False

    def connect(self) -> None:
        """Plug the line in again; nothing of what was said before waits any more."""
        self._waiting.clear()
        self._connected = True
        self._greet()

    def write(self, data: bytes) -> int:
        """Send bytes to the controller, and return how many.

        Raises :class:`~stagewire_virtual.errors.UnpluggedError`, and
        :class:`~stagewire.errors.BadValueError` for what is not bytes.
        """
        if not isinstance(data, (bytes, bytearray, memoryview)):
            raise BadValueError(f"a line carries bytes, not {type(data).__name__}")
        if not self._connected:
            raise UnpluggedError("the line to the controller is unplugged; plug_in() connects it")
        self._take(bytes(data))
        return len(data)

    def read(self, size: int | None = None, timeout: float = 0) -> bytes:
        """Return what the controller said, and let time pass for it if need be.

        :param size: how many bytes are wanted; None: all that there are, and one at least.
        :param timeout: seconds by the clock of the controller; no more time passes than until there are
            enough. What there is by then is returned.

        Raises :class:`~stagewire_virtual.errors.UnpluggedError` when nothing can come any more.
        """
        if not (size is None or (isinstance(size, int) and size >= 0)) or not passes(timeout):
            raise BadValueError(
                "read takes a size of 0 or more, and a time in seconds that has an end, "
                f"not {size!r}, {timeout!r}"
            )
        wanted = 1 if size is None else size
        end = self.clock.now + nanoseconds(timeout)
        while len(self._waiting) < wanted and self._connected and self.clock.now < end:
            due = self.clock.next_due
            self.clock.run_until(end if due is None else min(due, end))
        if not self._waiting and not self._connected:
            raise UnpluggedError("the line to the controller is unplugged; nothing will come")
        taken = bytes(self._waiting if size is None else self._waiting[:size])
        del self._waiting[: len(taken)]
        return taken

    def _backlog(self) -> int:
        return len(self._waiting)

    def _put(self, data: bytes) -> None:
        self._waiting += data
