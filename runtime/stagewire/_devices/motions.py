"""What the library started and what may still go on: the list from which everything is stopped at the end."""

from __future__ import annotations

from typing import Final

from stagewire._codec.message import Message
from stagewire._sessions.exchange import Exchange

__all__ = ["BEGINNING", "Motions", "Running"]

BEGINNING: Final = 0.5
"""Seconds within which a motion that was started shows in the status at the latest."""


class Running:
    """Something that was started.

    :param what: the call, for people.
    :param stop: the bytes that stop it; none where nothing does.
    :param halt: the same as a message.
    """

    __slots__ = ("ended", "exchange", "halt", "left", "started", "stop", "stopped", "what")

    def __init__(self, what: str, stop: bytes, started: float, halt: Message | None = None) -> None:
        self.what = what
        self.stop = stop
        self.halt = halt
        self.started = started
        self.exchange: Exchange | None = None
        """What tells its end; None where it is polled for, or nothing tells it."""
        self.ended: float | None = None
        """When its end was told, in the time of the session."""
        self.stopped = False
        """Whether a stop was sent since."""
        self.left = False
        """Whether it was started over a line that is gone, so that its end will not be heard.

        A stop that was sent as the line was closed changes nothing: its answer was not heard either.
        """

    def just_begun(self, now: float) -> bool:
        """Say whether a status may not show it yet, because it was started a moment ago."""
        return now - self.started < BEGINNING


class Motions:
    """Everything that was started, by address and channel; at most one thing each.

    Threads add and remove, and a signal handler reads: every step is a single one of a dictionary.
    """

    def __init__(self) -> None:
        self._running: dict[tuple[int, int | None], Running] = {}

    def start(self, place: tuple[int, int | None], running: Running) -> None:
        """Add what is about to be started; it takes the place of what was there."""
        self._running[place] = running

    def at(self, place: tuple[int, int | None]) -> Running | None:
        """Return what may go on there."""
        return self._running.get(place)

    def refused(
        self, place: tuple[int, int | None], running: Running, before: Running | None
    ) -> None:
        """Remove what was not sent after all, and let be what was there before."""
        if self._running.get(place) in (running, None):
            if before is None:
                self._running.pop(place, None)
            else:
                self._running[place] = before

    def over(self, place: tuple[int, int | None], running: Running) -> None:
        """Remove what has ended, unless something else was started there since."""
        if self._running.get(place) is running:
            self._running.pop(place, None)

    def stopped(self, place: tuple[int, int | None]) -> None:
        """Note that a stop was sent; nothing needs to be stopped there any more."""
        running = self._running.pop(place, None)
        if running is not None:
            running.stopped = True

    def described(self) -> str:
        """Name everything that may go on, for people."""
        return ", ".join(running.what for running in tuple(self._running.values()))

    def halts(self) -> list[tuple[int, Message]]:
        """Return who is to be stopped, and by what."""
        return [
            (address, running.halt)
            for (address, _), running in tuple(self._running.items())
            if running.halt is not None
        ]

    def leave(self) -> None:
        """Note that the line is gone; what was started over it may go on, also where a stop was sent last."""
        for running in tuple(self._running.values()):
            running.left = True

    def stops(self) -> bytes:
        """Return the bytes that stop everything; for a signal handler, so that it takes no lock."""
        return b"".join([running.stop for running in tuple(self._running.values())])
