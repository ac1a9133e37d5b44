"""A virtual controller that is served to other programs, as users hold it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

from stagewire.closing import Closing
from stagewire_virtual.clock import SteppedClock
from stagewire_virtual.errors import VirtualError
from stagewire_virtual.instrument import Instrument
from stagewire_virtual.serving.link import Maker, ServedLink, at_this_instant
from stagewire_virtual.serving.places import Place
from stagewire_virtual.serving.thread import ServingThread

__all__ = ["ServedController"]

_T = TypeVar("_T")


class ServedController(Closing):
    """A virtual controller that other programs, or a serial port in this one, reach by :attr:`url`.

    It lives in a thread, the same for all that are served, and in real time, unless it was made with a
    :class:`~stagewire_virtual.clock.SteppedClock`: then :meth:`advance` lets time go on. Whatever is done to
    it goes through :meth:`call`. Of controllers that share a clock either all are served or none.

    :param make: makes the controller, in that thread.
    :param place: where it is served.
    :param clock: a stepped one; None: real time.
    :param label: for people.
    """

    def __init__(
        self, make: Maker, place: Place, clock: SteppedClock | None = None, label: str = ""
    ) -> None:
        self.label = label
        self._thread = ServingThread.enter()
        self._closed = False
        try:
            self.link: ServedLink = self._thread.serve(make, place, clock, label)
        except BaseException:
            self._closed = True
            self._thread.leave()
            raise

    def __repr__(self) -> str:
        return f"<ServedController {self.label}: {self.url}{' (closed)' if self._closed else ''}>"

    @property
    def url(self) -> str:
        """What pyserial's ``serial_for_url`` opens: ``socket://127.0.0.1:40123``, ``/dev/pts/7``."""
        return self.link.url

    @property
    def instrument(self) -> Instrument:
        """The controller itself; to be touched within :meth:`call` only."""
        return self.link.instrument

    def call(self, function: Callable[..., _T], *arguments: Any) -> _T:
        """Run a function in the thread where the controller lives; return or raise what it does.

        What a host on this machine has sent by TCP before is taken first; over a pseudo-terminal bytes are on
        their way for a while, so that a test waits for an answer instead.
        """
        self._check_open()
        return self._thread.call(function, *arguments)

    def advance(self, seconds: float) -> None:
        """Let time go on, on a stepped clock; see :meth:`call` for what is taken before.

        Raises :class:`~stagewire_virtual.errors.VirtualError` on a real one.
        """
        clock = self.link.clock
        if not isinstance(clock, SteppedClock):
            raise VirtualError(
                "real time goes on by itself; give clock=SteppedClock() to let it go on step by step"
            )
        self.call(clock.advance, seconds)

    def power_cycle(self) -> None:
        """Switch it off and on; a connection stays."""
        self.call(at_this_instant, self.link.clock, self.instrument.power_cycle)

    def unplug(self) -> None:
        """Break the connection off; the host may come again. See the links for what that means to each."""
        self.call(self.link.disconnect)

    def close(self) -> None:
        """Serve it no more, and end the thread if it was the last one; harmless when done twice.

        Raises :class:`~stagewire_virtual.errors.VirtualError` when a controller failed in that thread, and,
        before anything is done, when it is called in it.
        """
        if self._closed:
            return
        self._thread.check()
        self._closed = True
        try:
            self._thread.close(self.link)
        finally:
            self._thread.leave()

    def _check_open(self) -> None:
        if self._closed:
            raise VirtualError(f"{self.label or 'the controller'} is not served any more")
