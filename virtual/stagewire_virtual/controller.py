"""The virtual controller in memory that users work with."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path

from stagewire.framing import Event
from stagewire.links import Closing
from stagewire_virtual.clock import SECOND, SteppedClock
from stagewire_virtual.errors import VirtualError
from stagewire_virtual.framings import framing_of
from stagewire_virtual.framings.framing import ReplyReader
from stagewire_virtual.instrument import Instrument
from stagewire_virtual.serving.endpoints import Endpoint, PtyEndpoint, parse_tcp
from stagewire_virtual.serving.link import Maker, MemoryLink, at_this_instant
from stagewire_virtual.serving.server import ServedController


class VirtualController(Closing):
    """A virtual controller in memory; a context manager.

    ``write`` and ``read`` work like those of a serial port. The controller processes written bytes
    immediately. Its clock runs only during :meth:`advance` and during a ``read`` that waits. Create one with
    ``stagewire_virtual.TDC001(...)`` or another factory. Not thread-safe.

    :param make: makes the controller.
    :param clock: the clock, which several controllers may share; a new one by default.
    :param label: a name for people.
    """

    def __init__(self, make: Maker, clock: SteppedClock | None = None, label: str = "") -> None:
        if not isinstance(clock, SteppedClock | None):
            raise VirtualError(
                f"clock must be a SteppedClock, not {type(clock).__name__}: a controller in memory "
                "has stepped time; tcp() and pty() serve in real time"
            )
        self.label = label
        self._make = make
        self._given_clock = clock
        self.clock = SteppedClock() if clock is None else clock
        self.link = MemoryLink(make(self.clock), label=label)
        self._reader = _reader_of(self.instrument)
        self._served = ExitStack()

    def __repr__(self) -> str:
        return f"<VirtualController {self.label}: {self.clock.now / SECOND} s>"

    @property
    def instrument(self) -> Instrument:
        """The controller itself, for everything beyond the line, such as a stuck axis."""
        return self.link.instrument

    def close(self) -> None:
        """Unplug it, and close all controllers served from it; safe to call twice."""
        self.unplug()
        self._served.close()

    # The line

    def write(self, data: bytes) -> int:
        """Send bytes to the controller and return their number; see :meth:`.MemoryLink.write`."""
        written = self.link.write(data)
        self._reader.wrote(data)
        return written

    def read(self, size: int | None = None, timeout: float = 0) -> bytes:
        """Return the bytes that the controller sent: all, or ``size`` of them.

        Wait at most ``timeout`` seconds of the controller's time: for ``size`` bytes, or without ``size`` for
        the first byte. See :meth:`.MemoryLink.read`. :meth:`read_frames` does not return frames that this
        method completed.
        """
        data = self.link.read(size, timeout)
        self._reader.read(data)  # so that read_frames knows which commands have been answered
        return data

    def read_frames(self, timeout: float = 0) -> list[Event]:
        """Return what the controller sent as events; ``event.frame`` and ``event.reply`` decode them.

        Wait like :meth:`read` if nothing has arrived. An incomplete frame is kept until its rest arrives.
        Replies to commands have no frame: they are matched, in order, to the commands written since the last
        call.
        """
        return self._reader.read(self.link.read(timeout=timeout))

    def unplug(self) -> None:
        """Unplug the line. :meth:`read` returns what arrived before; then it and :meth:`write` raise."""
        self.link.disconnect()

    def plug_in(self) -> None:
        """Plug the line in again. The controller has continued; what it sent meanwhile is lost."""
        self.link.connect()
        self._reader = _reader_of(self.instrument)

    # The controller

    def advance(self, seconds: float) -> None:
        """Advance the clock, for all controllers that share it."""
        self.clock.advance(seconds)

    def power_cycle(self) -> None:
        """Switch the controller off and on; the line stays plugged in."""
        at_this_instant(self.clock, self.instrument.power_cycle)

    # Served to other programs

    def tcp(self, address: str | int = 0, *, bind: str | None = None) -> ServedController:
        """Serve a new controller with the same options by TCP, in real time, until it is closed.

        :param address: a port such as 4001, an address and a port such as ``127.0.0.1:4001``, or 0 for a free
            port.
        :param bind: a network address to listen on; by default only this machine can connect.

        Raises :class:`~stagewire_virtual.errors.ServingError` if it cannot listen there.
        """
        return self._serve(parse_tcp(str(address), bind))

    def pty(self, symlink: str | Path | None = None) -> ServedController:
        """Serve a new controller with the same options on a pseudo-terminal, in real time.

        It is served until it is closed.

        :param symlink: a symbolic link to create for that time.

        Raises :class:`~stagewire_virtual.errors.ServingError` if that is impossible, as on Windows.
        """
        return self._serve(PtyEndpoint(None if symlink is None else Path(symlink)))

    def _serve(self, place: Endpoint) -> ServedController:
        served = ServedController(self._make, place, self._given_clock, self.label)
        return self._served.enter_context(served)


def _reader_of(instrument: Instrument) -> ReplyReader:
    """Return a reader for the replies of an instrument."""
    statuses = {unit.facts.get("status") for unit in instrument.units}
    return framing_of(instrument.unit.protocol).reply_reader(statuses)
