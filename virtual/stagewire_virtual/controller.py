"""A virtual controller in memory, as users hold it."""

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
    """A virtual controller in memory, whose time is stepped by who holds it; a context manager.

    ``write`` and ``read`` are what a serial port has. What is written is taken at once; nothing else happens
    until :meth:`advance` lets time go on, or a ``read`` that waits. Made by ``stagewire_virtual.TDC001(...)``
    and its like; not for several threads.

    :param make: makes the controller.
    :param clock: its time; several controllers may share one. By default one of its own.
    :param label: for people.
    """

    def __init__(self, make: Maker, clock: SteppedClock | None = None, label: str = "") -> None:
        if not isinstance(clock, SteppedClock | None):
            raise VirtualError(
                f"in memory time is stepped: clock is a SteppedClock, not {type(clock).__name__}; "
                "tcp() and pty() serve in real time"
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
        """The controller itself, for what does not go over a line, such as an axis that sticks."""
        return self.link.instrument

    def close(self) -> None:
        """Unplug it, and end the serving of all that was served from it; harmless when done twice."""
        self.unplug()
        self._served.close()

    # The line

    def write(self, data: bytes) -> int:
        """Send bytes to it, and return how many; see :meth:`.MemoryLink.write`."""
        written = self.link.write(data)
        self._reader.wrote(data)
        return written

    def read(self, size: int | None = None, timeout: float = 0) -> bytes:
        """Return what it said: all, or ``size`` bytes; lets ``timeout`` seconds pass at most.

        See :meth:`.MemoryLink.read`. Without ``size`` it waits for the first byte, with it for all of them.
        :meth:`read_frames` does not give out again what this completes.
        """
        data = self.link.read(size, timeout)
        self._reader.read(data)  # so that read_frames knows what has been answered
        return data

    def read_frames(self, timeout: float = 0) -> list[Event]:
        """Return what it said as events, decoded by ``event.frame``, of commands by ``event.reply``.

        Without anything to read, waits like :meth:`read` until something comes. The beginning of a frame
        waits for its rest. Replies of commands have no frame: they are told by the commands that were
        written since the last reading, in order.
        """
        return self._reader.read(self.link.read(timeout=timeout))

    def unplug(self) -> None:
        """Pull the plug: :meth:`read` gives what came before, then it and :meth:`write` raise."""
        self.link.disconnect()

    def plug_in(self) -> None:
        """Connect it again; it has gone on meanwhile, and what it said is lost."""
        self.link.connect()
        self._reader = _reader_of(self.instrument)

    # The controller

    def advance(self, seconds: float) -> None:
        """Let time go on, for all that have the same clock."""
        self.clock.advance(seconds)

    def power_cycle(self) -> None:
        """Switch it off and on; the line stays plugged in."""
        at_this_instant(self.clock, self.instrument.power_cycle)

    # Served to other programs

    def tcp(self, address: str | int = 0, *, bind: str | None = None) -> ServedController:
        """Serve another controller like this one by TCP, in real time, until it is closed.

        :param address: a port, 0 for one that the system chooses; or ``127.0.0.1:4001``.
        :param bind: an address of the network to listen on; otherwise this machine alone can reach it.

        Raises :class:`~stagewire_virtual.errors.ServingError` where that cannot be.
        """
        return self._serve(parse_tcp(str(address), bind))

    def pty(self, symlink: str | Path | None = None) -> ServedController:
        """Serve another one like this on a pseudo-terminal, in real time, until it is closed.

        :param symlink: a symbolic link to be made for as long.

        Raises :class:`~stagewire_virtual.errors.ServingError` where that cannot be, as on Windows.
        """
        return self._serve(PtyEndpoint(None if symlink is None else Path(symlink)))

    def _serve(self, place: Endpoint) -> ServedController:
        served = ServedController(self._make, place, self._given_clock, self.label)
        return self._served.enter_context(served)


def _reader_of(instrument: Instrument) -> ReplyReader:
    """Return what reads the replies of an instrument."""
    statuses = {unit.facts.get("status") for unit in instrument.units}
    return framing_of(instrument.unit.protocol).reply_reader(statuses)
