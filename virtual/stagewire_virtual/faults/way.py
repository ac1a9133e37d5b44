"""One direction of a line: the faults on it in their order, and what is late."""

from __future__ import annotations

import heapq
from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import chain

from stagewire_virtual.clock import Clock, Timer
from stagewire_virtual.faults.effect import Effect
from stagewire_virtual.faults.parcel import MOST_HELD, Parcel

__all__ = ["Way"]


class Way:
    """Takes parcels, sends them through the faults, and hands on what comes out, when it is due.

    A parcel that is late holds up what follows, as on a serial line, unless it may be overtaken.

    :param clock: the time.
    :param hand_on: takes what arrives; it may lead to :meth:`clear`.
    :param lost: told, in words, of bytes for which there is no room.
    """

    def __init__(
        self,
        clock: Clock,
        hand_on: Callable[[Parcel], None],
        lost: Callable[[str], None],
    ) -> None:
        self.effects: Sequence[Effect] = ()
        self._clock = clock
        self._hand_on = hand_on
        self._lost = lost
        self._timer: Timer | None = None
        self._count = 0  # parcels of one instant arrive in the order in which they were sent
        self._latest = 0  # when the last parcel arrives that holds up others
        self.clear()

    def clear(self) -> None:
        """Lose all that is late: the line was cut."""
        self._late: list[tuple[int, int, Parcel]] = []
        self._held = 0
        self._in_order = 0  # late parcels that hold up others
        self._set_timer()

    def take(self, parcel: Parcel) -> None:
        """Send a parcel through the faults."""
        parcels = [parcel]
        for effect in self.effects:
            parcels = list(
                self._within(len(parcel.data), chain.from_iterable(map(effect.apply, parcels)))
            )
        for one in parcels:
            self.send(one)

    def _within(self, size: int, parcels: Iterable[Parcel]) -> Iterator[Parcel]:
        """Yield what came of ``size`` bytes, to the end of the line, or until it is too much."""
        room = size + MOST_HELD
        for parcel in parcels:
            room -= len(parcel.data)
            if room < 0:
                self._lost(f"lost the rest of what came of {size} bytes: over {MOST_HELD} more")
                return
            yield parcel
            if parcel.cut:
                return

    def send(self, parcel: Parcel) -> None:
        """Send a parcel past the faults."""
        if not parcel.delay and not self._in_order:
            self._hand_on(parcel)
            return
        if self._held + len(parcel.data) > MOST_HELD:
            self._lost(f"lost {len(parcel.data)} bytes: over {MOST_HELD} are held back")
            return
        due = self._clock.now + parcel.delay
        if not parcel.overtaken:
            if self._in_order:
                due = max(due, self._latest)
            self._latest = due
            self._in_order += 1
        self._count += 1
        self._held += len(parcel.data)
        heapq.heappush(self._late, (due, self._count, parcel))
        self._set_timer()

    def _set_timer(self) -> None:
        """See to it that there is a timer for what is due next, and no other."""
        due = self._late[0][0] if self._late else None
        if self._timer is not None:
            if self._timer.when == due:
                return
            self._timer.cancel()
        self._timer = None if due is None else self._clock.call_at(due, self._arrive)

    def _arrive(self) -> None:
        """Hand on what is due."""
        self._timer = None
        while self._late and self._late[0][0] <= self._clock.now:
            parcel = heapq.heappop(self._late)[2]
            self._held -= len(parcel.data)
            self._in_order -= not parcel.overtaken
            self._hand_on(parcel)
        self._set_timer()
