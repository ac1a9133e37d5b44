"""Something that moves between two ends: a stage, as its motor and its switches see it."""

from __future__ import annotations

import math
from collections.abc import Callable

from stagewire_virtual.clock import Clock, Timer
from stagewire_virtual.profiles import Profile

_HALF = 0.5  # a count: what ends at a bound is not beyond it for being rounded


class SimulatedAxis:
    """A stage that follows one profile at a time, and stops hard at either end of its travel.

    Places are counted from the lower end of the travel. At rest it stands on a whole count.

    :param clock: the time.
    :param travel: how far apart its ends are.
    :param place: where it stands at the beginning, held within its travel.
    :param below: how far it can be driven beyond the lower end before it stops hard.
    """

    def __init__(self, clock: Clock, travel: int, place: int, *, below: int = 0) -> None:
        self._clock = clock
        self.travel = travel
        self.below = below
        self._place: float = min(max(place, 0), travel)  # at rest, and while it is held
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
        """Where it is at this instant, in counts; between them while it moves."""
        if self._profile is None or self._held:
            return self._place
        place = self._profile.position(self._clock.now - self._began)
        return min(max(place, -self.below), self.travel)

    @property
    def velocity(self) -> float:
        """How fast it is at this instant, in counts/s, with its sign."""
        if self._profile is None or self._held:
            return 0.0
        return self._profile.velocity(self._clock.now - self._began)

    @property
    def acceleration(self) -> float:
        """How its velocity changes at this instant, in counts/s², with its sign."""
        if self._profile is None or self._held:
            return 0.0
        return self._profile.acceleration(self._clock.now - self._began)

    @property
    def direction(self) -> int:
        """1 while its place rises, or would if it were not held, -1 while it falls, 0 at rest.

        At the instant at which it begins to move or turns, it is the direction of what follows.
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
        """How far the profile is ahead of the place; 0 unless it is held."""
        if self._profile is None or not self._held:
            return 0.0
        return self._profile.position(self._clock.now - self._began) - self._place

    @property
    def held(self) -> bool:
        """Whether something holds it: its profile goes on without it, and never comes to its end."""
        return self._held

    @held.setter
    def held(self, held: bool) -> None:
        self._place = self.place
        if self._held and not held:
            self.halt()
        self._held = held

    def follow(self, profile: Profile, then: Callable[[], None]) -> None:
        """Move by a profile, instead of whatever it did; at rest again, call ``then``.

        It is at rest at the end of the profile, or where the profile would leave the travel.
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
        self.watch(self.travel, 1, arrive)
        self.watch(-self.below, -1, arrive)

    def watch(self, bound: float, direction: int, callback: Callable[[], None]) -> None:
        """Call ``callback`` when the profile that it follows goes beyond a place, seen in a direction."""
        if self._profile is not None:
            slack = _HALF if self._profile.end == bound else 0
            time = self._profile.reaches(bound + direction * slack, direction)
            if time is not None:
                self._at(time, callback)

    def halt(self, near: int | None = None) -> None:
        """Stand where it is, at once; nothing that waits for the motion is called any more.

        :param near: where it stands if it is no farther than a count from there.
        """
        for timer in self._timers:
            timer.cancel()
        self._timers = []
        place = self.place
        self._place = near if near is not None and abs(place - near) <= 1 else round(place)
        self._profile = None

    def _at(self, time: int, callback: Callable[[], None]) -> None:
        self._timers.append(self._clock.call_at(self._began + time, callback))
