"""The list of motions that the library started and that may still be under way."""

from __future__ import annotations

from typing import Final

from stagewire._codec.message import Message
from stagewire._sessions.exchange import Exchange

__all__ = ["BEGINNING", "Motions", "Running"]

BEGINNING: Final = 0.5
"""Maximum delay in seconds before a started motion shows in the status."""


class Running:
    """A motion that was started.

    :param what: name of the call, for messages.
    :param stop: bytes that stop it; empty if it cannot be stopped.
    :param halt: the same stop as a message.
    """

    __slots__ = ("ended", "exchange", "halt", "left", "started", "stop", "stopped", "what")

    def __init__(self, what: str, stop: bytes, started: float, halt: Message | None = None) -> None:
        self.what = what
        self.stop = stop
        self.halt = halt
        self.started = started
        self.exchange: Exchange | None = None
        """The exchange that reports its end; None if the end is polled for or not reported."""
        self.ended: float | None = None
        """When its end was reported, in the time of the session."""
        self.stopped = False
        """Whether a stop was sent after the start."""
        self.left = False
        """Whether it was started over an earlier line, so that its end will not be reported.

        A stop that was sent as that line was closed does not change this, because it was not confirmed.
        """

    def just_begun(self, now: float) -> bool:
        """Return whether it started so recently that a status may not show it yet."""
        return now - self.started < BEGINNING


class Motions:
    """The motions that were started, by address and channel; at most one each.

    Threads add and remove entries while a signal handler reads them, so every step is a single dictionary
    operation.
    """

    def __init__(self) -> None:
        self._running: dict[tuple[int, int | None], Running] = {}
        self._orders: dict[tuple[int, int | None], int] = {}

    def start(self, place: tuple[int, int | None], running: Running) -> None:
        """Add a motion that is about to start; it replaces an earlier one there."""
        self._running[place] = running

    def at(self, place: tuple[int, int | None]) -> Running | None:
        """Return the motion that may be under way there."""
        return self._running.get(place)

    def refused(
        self, place: tuple[int, int | None], running: Running, before: Running | None
    ) -> None:
        """Remove a motion that was not sent, and restore the previous one."""
        if self._running.get(place) in (running, None):
            if before is None:
                self._running.pop(place, None)
            else:
                self._running[place] = before

    def over(self, place: tuple[int, int | None], running: Running) -> None:
        """Remove a motion that has ended, unless another one was started there since."""
        if self._running.get(place) is running:
            self._running.pop(place, None)

    def stopping(self, place: tuple[int, int | None]) -> None:
        """Record that a stop is about to be sent."""
        self._orders[place] = self.orders(place) + 1

    def orders(self, place: tuple[int, int | None]) -> int:
        """Return how many stops were ordered there."""
        return self._orders.get(place, 0)

    def stopped(self, place: tuple[int, int | None]) -> None:
        """Record that a stop was sent, so that nothing there needs to be stopped."""
        running = self._running.pop(place, None)
        if running is not None:
            running.stopped = True

    def names(self, *, stopped: bool = False) -> tuple[str, ...]:
        """Return the names of the motions that may be under way, for messages.

        :param stopped: whether a stop is sent to all that can be stopped; they are then left out.
        """
        found = tuple(self._running.values())
        return tuple(running.what for running in found if not (stopped and running.stop))

    def halts(self) -> list[tuple[int, Message]]:
        """Return the address and the stop of each motion."""
        return [
            (address, running.halt)
            for (address, _), running in tuple(self._running.items())
            if running.halt is not None
        ]

    def leave(self) -> None:
        """Mark all motions as started over an earlier line, even if stops were sent last."""
        for running in tuple(self._running.values()):
            running.left = True

    def stops(self) -> bytes:
        """Return the bytes that stop everything; takes no lock, because signal handlers call it."""
        return b"".join([running.stop for running in tuple(self._running.values())])
