"""Links between a host and a far end: the base class with counters, an observer and limits.

This module also has the link in memory, for tests, on which the host writes, reads and advances the clock.
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
"""Bytes that are buffered for a host that does not read; whole frames beyond that are dropped."""

FarEnd: TypeAlias = Instrument | FaultyLink
"""An instrument, with or without faults on its line."""

Maker: TypeAlias = Callable[[Clock], FarEnd]
"""Makes a far end on a clock."""

Run: TypeAlias = Callable[[Callable[[], None]], None]
"""Runs a callback at the present instant of a clock; see :func:`at_this_instant`."""


class Observer:
    """Callbacks for the traffic of links; they do nothing by default.

    Times are nanoseconds of the link's clock.
    """

    def received(self, link: Link, when: int, data: bytes) -> None:
        """Note bytes from the host, as they arrived."""

    def sent(self, link: Link, when: int, data: bytes) -> None:
        """Note bytes to the host: one frame, unless a fault changed it."""

    def noted(self, link: Link, when: int, text: str) -> None:
        """Take a note for people, for example that a second host was turned away."""


class Link:
    """The controller's end of a line; the base of all kinds of links.

    :param far_end: the instrument on this link, with or without faults.
    :param label: a name for people.
    :param observer: receives the traffic and the notes.
    """

    limit: ClassVar = BACKLOG

    def __init__(
        self, far_end: FarEnd, *, label: str = "", observer: Observer | None = None
    ) -> None:
        self.far_end = far_end
        self.instrument: Instrument
        """The instrument, without the faults on its line."""
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
        """Number of bytes from the host."""
        self.sent = 0
        """Number of frames to the host; frames sent while no host is connected are lost and not counted."""
        self.dropped = 0
        """Number of frames that were dropped because the host did not read."""
        self._dropping = False
        self._run: Run = lambda callback: at_this_instant(self.clock, callback)

    @property
    def clock(self) -> Clock:
        """The clock of the far end."""
        return self.instrument.clock

    # Implemented by each kind of link

    @property
    def connected(self) -> bool:
        """Whether frames of the controller reach a host."""
        raise NotImplementedError

    def disconnect(self) -> None:
        """Unplug the line."""
        raise NotImplementedError

    def _backlog(self) -> int:
        """Return the number of bytes that the host has not read yet."""
        raise NotImplementedError

    def _put(self, data: bytes) -> None:
        """Send bytes to the host."""
        raise NotImplementedError

    # Common to all kinds

    def note(self, text: str) -> None:
        """Pass a note for people to the observer."""
        self.observer.noted(self, self.clock.now, text)

    def _note_fault(self, happened: FaultEvent) -> None:
        self.note(str(happened))

    def _greet(self) -> None:
        """Notify the far end that a host has connected."""
        self._run(self.far_end.host_came)

    def _take(self, data: bytes) -> None:
        """Process bytes from the host."""
        self.received += len(data)
        self._run(lambda: self._pass_on(data))

    def _pass_on(self, data: bytes) -> None:
        self.observer.received(self, self.clock.now, data)
        self.far_end.receive(data)

    def _say(self, data: bytes) -> None:
        """Send a frame of the far end to the host."""
        if not self.connected:
            return
        if self._backlog() + len(data) > self.limit:
            self.dropped += 1
            if not self._dropping:
                self.note(
                    f"the host does not read: {self.limit // 1024} KiB are waiting, more is dropped"
                )
            self._dropping = True
            return
        self._dropping = False
        self.sent += 1
        self.observer.sent(self, self.clock.now, data)
        self._put(data)


class ServedLink(Link):
    """A link on an event loop, which other programs connect to."""

    @property
    def url(self) -> str:
        """The URL that a host opens, for example with pyserial's ``serial_for_url``."""
        raise NotImplementedError

    async def open(self, run: Run) -> None:
        """Accept hosts; process their bytes within ``run``.

        Raises :class:`~stagewire_virtual.errors.ServingError` if it cannot be served there.
        """
        raise NotImplementedError

    async def close(self) -> None:
        """Stop accepting hosts and clean up; safe to call twice."""
        raise NotImplementedError


def at_this_instant(clock: Clock, callback: Callable[[], None]) -> None:
    """Run ``callback`` as a timer of ``clock`` that is due now, after all other timers that are due.

    While the callback processes bytes, time stands still even on a real clock, and everything that should
    have happened before has happened.
    """
    clock.call_at(clock.now, callback)
    clock.run_until(clock.now)


_LIMIT: Final = 16 * 1024 * 1024  # a test may advance by hours before it reads


class MemoryLink(Link):
    """A link whose host is a test in the same thread.

    The far end processes bytes of the host immediately, at the present instant of the clock. Its own bytes
    are buffered until they are read, up to 16 MiB.
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
        """The number of bytes that can be read without waiting."""
        return len(self._waiting)

    def disconnect(self) -> None:
        """Unplug the line; bytes sent before can still be read."""
        self._connected = False

    def connect(self) -> None:
        """Plug the line in again; bytes that were not read are discarded."""
        self._waiting.clear()
        self._connected = True
        self._greet()

    def write(self, data: bytes) -> int:
        """Send bytes to the controller and return their number.

        Raises :class:`~stagewire_virtual.errors.UnpluggedError`, and
        :class:`~stagewire.errors.BadValueError` if ``data`` is not bytes.
        """
        if not isinstance(data, (bytes, bytearray, memoryview)):
            raise BadValueError(f"write requires bytes, not {type(data).__name__}")
        if not self._connected:
            raise UnpluggedError("the line to the controller is unplugged; plug_in() connects it")
        self._take(bytes(data))
        return len(data)

    def read(self, size: int | None = None, timeout: float = 0) -> bytes:
        """Return bytes from the controller, and advance its clock while waiting for them.

        :param size: the number of bytes; None: all that are available, at least one.
        :param timeout: the longest time to wait, in seconds of the controller's clock; after that, the bytes
            received so far are returned.

        Raises :class:`~stagewire_virtual.errors.UnpluggedError` if the line is unplugged and nothing is left.
        """
        if not (size is None or (isinstance(size, int) and size >= 0)) or not passes(timeout):
            raise BadValueError(
                "read requires a size of at least 0 and a finite timeout in seconds of at least 0, "
                f"not {size!r} and {timeout!r}"
            )
        wanted = 1 if size is None else size
        end = self.clock.now + nanoseconds(timeout)
        while len(self._waiting) < wanted and self._connected and self.clock.now < end:
            due = self.clock.next_due
            self.clock.run_until(end if due is None else min(due, end))
        if not self._waiting and not self._connected:
            raise UnpluggedError("the line to the controller is unplugged; plug_in() connects it")
        taken = bytes(self._waiting if size is None else self._waiting[:size])
        del self._waiting[: len(taken)]
        return taken

    def _backlog(self) -> int:
        return len(self._waiting)

    def _put(self, data: bytes) -> None:
        self._waiting += data
