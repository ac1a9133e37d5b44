"""Any number of virtual controllers on one event loop, awake only when something is due or comes."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from stagewire.closing import AsyncClosing
from stagewire_virtual.clock import SECOND, Clock, RealClock
from stagewire_virtual.serving.link import ServedLink, at_this_instant

__all__ = ["Server"]


class Server(AsyncClosing):
    """Serves links whose far ends share one clock, in the event loop that is running.

    On a :class:`~stagewire_virtual.clock.RealClock` it sleeps until the next timer is due. A
    :class:`~stagewire_virtual.clock.SteppedClock` stands still between the calls of its ``advance``, which
    are to be made in the thread of the event loop.

    :param clock: a new real one by default; no other server may have it at the same time.
    """

    def __init__(self, clock: Clock | None = None) -> None:
        self.clock = RealClock() if clock is None else clock
        self.links: list[ServedLink] = []
        self._alarm: asyncio.TimerHandle | None = None
        self._alarm_at: int | None = None
        self._running = False
        self.clock.on_earlier = self._set_alarm

    async def open(self, link: ServedLink) -> None:
        """Serve a link whose far end has the clock of this server.

        Raises :class:`~stagewire_virtual.errors.ServingError` where that cannot be.
        """
        await link.open(self.run)
        self.links.append(link)
        self._set_alarm()

    async def close_link(self, link: ServedLink) -> None:
        """Serve a link no more."""
        self.links.remove(link)
        await link.close()

    async def close(self) -> None:
        """Close all links, and wake no more."""
        for link in list(self.links):
            await self.close_link(link)
        self.clock.on_earlier = None
        self._cancel_alarm()

    def run(self, callback: Callable[[], None]) -> None:
        """Do something at this instant, after all that is due, and see what is due next."""
        self._running = True
        try:
            at_this_instant(self.clock, callback)
        finally:
            self._running = False
            self._set_alarm()

    def _set_alarm(self) -> None:
        """See to being woken when the next timer is due; nobody wakes a clock that is stepped."""
        if self._running or not isinstance(self.clock, RealClock):
            return
        due = self.clock.next_due
        if due == self._alarm_at:
            return
        self._cancel_alarm()
        if due is not None:
            delay = (due - self.clock.now) / SECOND
            self._alarm = asyncio.get_running_loop().call_later(delay, self._wake)
            self._alarm_at = due

    def _cancel_alarm(self) -> None:
        if self._alarm is not None:
            self._alarm.cancel()
        self._alarm = self._alarm_at = None

    def _wake(self) -> None:
        self._alarm = self._alarm_at = None
        self.run(_nothing)


def _nothing() -> None:
    """Do nothing but let time go on."""
