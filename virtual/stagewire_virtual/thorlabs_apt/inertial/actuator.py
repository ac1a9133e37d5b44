"""An actuator or stage that moves by steps: steps are counted, distances are not."""

from __future__ import annotations

import math
import random
from collections.abc import Callable

from stagewire_virtual.axis import SimulatedAxis
from stagewire_virtual.clock import Clock
from stagewire_virtual.profiles import Profile
from stagewire_virtual.thorlabs_apt.inertial.constants import Mechanics


class Actuator:
    """An actuator whose steps forward and in reverse have different sizes.

    The sizes are random for each channel, and reproducible by the seed of the instrument. At an end of the
    travel, and while it is blocked, the drive continues to step, but the actuator does not move.

    :param clock: the clock.
    :param mechanics: the mechanics of its kind.
    :param chance: random numbers of its channel.
    :param travel: its travel in nm; None for that of its kind.
    :param position: its first position in nm from the lower end; None for the middle of its travel.
    """

    def __init__(
        self,
        clock: Clock,
        mechanics: Mechanics,
        chance: random.Random,
        travel: int | None = None,
        position: int | None = None,
    ) -> None:
        self._clock = clock
        forward = mechanics.step * (1 + mechanics.spread * chance.uniform(-1, 1))
        self.step_sizes = {1: forward, -1: forward * chance.uniform(*mechanics.reverse)}
        """The size of a step at the reference amplitude in nm: 1 forward, -1 in reverse."""
        self.travel = mechanics.travel if travel is None else travel
        first = self.travel / 2 if position is None else position
        self._nm = min(max(float(first), 0.0), float(self.travel))
        self._blocked = False
        self._steps = 0
        self._size = 0.0  # of a unit of the present motion, in nm
        self._from = 0.0  # the place of the present motion at which it was at _nm
        self._counts = True  # whether its units are steps
        self._motion = self._at_rest()

    @property
    def moving(self) -> bool:
        """Whether the drive is active."""
        return self._motion.moving

    @property
    def direction(self) -> int:
        """1 while the drive is active forward, -1 in reverse, 0 at rest."""
        return self._motion.direction

    @property
    def steps(self) -> int:
        """The sum of all steps in open loop since the instrument was created, with their signs."""
        return self._steps + (round(self._motion.place) if self._counts else 0)

    @property
    def position(self) -> float:
        """The true position in nm from the lower end of the travel."""
        gone = 0.0 if self._blocked else self._motion.place - self._from
        return min(max(self._nm + gone * self._size, 0.0), float(self.travel))

    @property
    def blocked(self) -> bool:
        """Whether it does not move when the drive is active."""
        return self._blocked

    @blocked.setter
    def blocked(self, blocked: bool) -> None:
        self._nm, self._from = self.position, self._motion.place
        self._blocked = blocked

    def step(
        self, profile: Profile, direction: int, amplitude: float, then: Callable[[], None]
    ) -> None:
        """Make steps along a profile that begins at 0, and call ``then`` at its end.

        :param direction: the direction of the whole profile, 1 forward or -1 in reverse.
        :param amplitude: the size of the steps as a share of :attr:`step_sizes`.
        """
        self._start(profile, self.step_sizes[direction] * amplitude, True, then)

    def slide(self, profile: Profile, then: Callable[[], None]) -> None:
        """Move along a profile in nm that begins at 0, as in closed loop, and call ``then`` at its end."""
        self._start(profile, 1.0, False, then)

    def at_end(self, direction: int) -> bool:
        """Return whether it is at the upper end (1) or at the lower end (-1) of its travel."""
        return self.position >= self.travel if direction > 0 else self.position <= 0

    def watch_end(self, direction: int, callback: Callable[[], None]) -> None:
        """Stop the present motion where the travel ends in its direction, and call ``callback``."""
        room = self.travel - self._nm if direction > 0 else self._nm
        bound = direction * math.ceil(room / self._size)

        def stop() -> None:
            if not self._blocked:
                self.halt(near=bound)
                callback()

        self._motion.watch(bound, direction, stop)

    def halt(self, near: int | None = None) -> None:
        """Stop immediately, after a whole number of steps: ``near``, if it is at most one step away."""
        self._motion.halt(near)
        self._nm, self._steps = self.position, self.steps
        self._size = self._from = 0.0
        self._motion = self._at_rest()

    def _start(self, profile: Profile, size: float, counts: bool, then: Callable[[], None]) -> None:
        self.halt()
        self._size, self._counts = size, counts

        def end() -> None:
            self.halt()
            then()

        self._motion.follow(profile, end)

    def _at_rest(self) -> SimulatedAxis:
        return SimulatedAxis(self._clock, 1, 0, endless=True)
