"""A simulated axis that moves between the two ends of its travel, or rotates without ends."""

from __future__ import annotations

import math
from collections.abc import Callable

from stagewire_virtual.clock import Clock, Timer
from stagewire_virtual.profiles import Profile

_HALF = 0.5  # a count: a profile that ends at a bound must not cross it through rounding


class SimulatedAxis:
    """A stage that follows one profile at a time and stops hard at either end of its travel.

    Positions are counts from the lower end of the travel, and whole numbers at rest.

    :param clock: the clock.
    :param travel: the distance between its ends.
    :param place: its first position, limited to the travel.
    :param below: how far it can move below the lower end before it stops hard.
    :param endless: whether it has no ends: ``travel`` is then a turn, and positions count on after it.
    """

    def __init__(
        self, clock: Clock, travel: int, place: int, *, below: int = 0, endless: bool = False
    ) -> None:
        self._clock = clock
        self.travel = travel
        self.below = below
        self.endless = endless
        self._place: float = min(max(place, 0), travel)  # valid at rest and while it is held
        self._held = False
        self._profile: Profile | None = None
        self._began = 0
        self._timers: list[Timer] = []

    @property
    def moving(self) -> bool:
        """Whether it follows a profile."""
        return self._profile is not None

    @property
    def place(self) -> float:
        """Its present position in counts; a fraction while it moves."""
        if self._profile is None or self._held:
            return self._place
        place = self._profile.position(self._clock.now - self._began)
        return place if self.endless else min(max(place, -self.below), self.travel)

    @property
    def velocity(self) -> float:
        """Its present velocity in counts/s, with a sign."""
        if self._profile is None or self._held:
            return 0.0
        return self._profile.velocity(self._clock.now - self._began)

    @property
    def acceleration(self) -> float:
        """Its present acceleration in counts/s², with a sign."""
        if self._profile is None or self._held:
            return 0.0
        return self._profile.acceleration(self._clock.now - self._began)

    @property
    def direction(self) -> int:
        """1 while its position rises, or would rise if it were not held; -1 while it falls; 0 at rest.

        At the instant at which it starts or turns, the direction of the motion that follows.
        """
        if self._profile is None:
            return 0
        time = self._clock.now - self._began
        towards = (
            self._profile.velocity(time)
            or self._profile.velocity(time + 1)
            or self._profile.position(time) - self._place
        )
        return int(math.copysign(1, towards)) if towards else 0

    @property
    def error(self) -> float:
        """How far the profile is ahead of the position; 0 unless the axis is held."""
        if self._profile is None or not self._held:
            return 0.0
        return self._profile.position(self._clock.now - self._began) - self._place

    @property
    def held(self) -> bool:
        """Whether the axis is held. Its profile then continues without it and never ends."""
        return self._held

    @held.setter
    def held(self, held: bool) -> None:
        self._place = self.place
        if self._held and not held:
            self.halt()
        self._held = held

    def follow(self, profile: Profile, then: Callable[[], None]) -> None:
        """Replace the present motion by a profile, and call ``then`` when the axis is at rest again.

        The axis comes to rest at the end of the profile, or where the profile would leave the travel.
        """
        self.halt()
        self._profile = profile
        self._began = self._clock.now

        def arrive() -> None:
            if not self._held:
                self.halt()
                then()

        if profile.duration is not None:
            self._at(profile.duration, arrive)
        if not self.endless:
            self.watch(self.travel, 1, arrive)
            self.watch(-self.below, -1, arrive)

    def watch(self, bound: float, direction: int, callback: Callable[[], None]) -> None:
        """Call ``callback`` when the present profile crosses ``bound`` in a direction."""
        if self._profile is not None:
            slack = _HALF if self._profile.end == bound else 0
            time = self._profile.reaches(bound + direction * slack, direction)
            if time is not None:
                self._at(time, callback)

    def halt(self, near: int | None = None) -> None:
        """Stop immediately, and cancel the callbacks that wait for the motion.

        :param near: the position to stop at, if it is at most one count away.
        """
        for timer in self._timers:
            timer.cancel()
        self._timers = []
        place = self.place
        self._place = near if near is not None and abs(place - near) <= 1 else round(place)
        self._profile = None

    def _at(self, time: int, callback: Callable[[], None]) -> None:
        self._timers.append(self._clock.call_at(self._began + time, callback))
