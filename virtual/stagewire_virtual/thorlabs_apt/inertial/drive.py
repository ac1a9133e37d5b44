"""The drive of an inertial channel: it carries out one move, jog or homing run at a time."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

from stagewire import Frame
from stagewire_virtual.clock import Clock, Timer
from stagewire_virtual.profiles import Profile, run_on, trapezoid
from stagewire_virtual.thorlabs_apt.inertial.actuator import Actuator
from stagewire_virtual.thorlabs_apt.inertial.constants import UNNOTICED
from stagewire_virtual.thorlabs_apt.motor.status import Activity


@dataclass(frozen=True, slots=True)
class Action:
    """An action of a drive.

    :param doing: its kind, for the status bits.
    :param cause: the frame that started it.
    :param distance: how far it goes, in steps, or in nm in closed loop; infinite for a move without end.
    :param rate: the top rate, in steps/s or nm/s.
    :param acceleration: the acceleration, in steps/s² or nm/s².
    :param complete: called with the cause at its end.
    :param amplitude: the size of the steps as a share of the reference; None in closed loop.
    """

    doing: Activity
    cause: Frame
    distance: float
    rate: float
    acceleration: float
    complete: Callable[[Frame], None]
    amplitude: float | None

    @property
    def direction(self) -> int:
        """1 forward, -1 in reverse, 0 for no distance."""
        return int(math.copysign(1, self.distance)) if self.distance else 0

    @property
    def fault(self) -> str:
        """Why no drive can carry it out; empty if it can."""
        return (
            "" if self.rate > 0 < self.acceleration else "the rate and acceleration must be above 0"
        )

    def profile(self) -> Profile:
        """Plan it from rest at 0."""
        if math.isinf(self.distance):
            return run_on(0.0, self.direction * self.rate, acceleration=self.acceleration)
        return trapezoid(0.0, self.distance, velocity=self.rate, acceleration=self.acceleration)


class InertialDrive:
    """Drives an actuator. It has no inertia of its own: it stops at once, and every action begins at rest.

    :param clock: the clock.
    :param actuator: the actuator.
    :param obeys: returns whether the limit switch in a direction, 1 or -1, stops it.
    :param lost: called when a closed loop notices that the stage is blocked.
    """

    def __init__(
        self,
        clock: Clock,
        actuator: Actuator,
        obeys: Callable[[int], bool],
        lost: Callable[[], bool],
    ) -> None:
        self._clock = clock
        self._actuator = actuator
        self._obeys = obeys
        self._lost = lost
        self._watchdog: Timer | None = None
        self._origin = 0.0  # where the present action began, in nm
        self.action: Action | None = None
        """The present action; None at rest."""

    def begin(self, action: Action) -> None:
        """Start an action; it replaces the present one, which is not completed."""
        self.rest()
        self.action = action
        self._origin = self._actuator.position
        direction = action.direction
        at_switch = direction and self._obeys(direction) and self._actuator.at_end(direction)
        if not direction or at_switch:
            self._end()
            return
        profile = action.profile()
        if action.amplitude is None:
            if self._actuator.blocked:
                self._watchdog = self._clock.call_later(UNNOTICED, self._notice)
                return
            self._actuator.slide(profile, self._end)
        else:
            self._actuator.step(profile, direction, action.amplitude, self._end)
        if self._obeys(direction):
            self._actuator.watch_end(direction, self._end)

    def rest(self) -> None:
        """Stop immediately, without completing the present action."""
        if self._watchdog is not None:
            self._watchdog.cancel()
            self._watchdog = None
        self._actuator.halt()
        self.action = None

    def block(self, blocked: bool) -> None:
        """Block the actuator, or release it; a closed loop then continues to its target."""
        action = self.action
        gone = self._actuator.position - self._origin
        self._actuator.blocked = blocked
        if action is not None and action.amplitude is None:
            self.begin(replace(action, distance=action.distance - gone))

    def _notice(self) -> None:
        self._watchdog = None
        if self._lost():
            self.rest()

    def _end(self) -> None:
        action = self.action
        self.rest()
        if action is not None:
            action.complete(action.cause)
