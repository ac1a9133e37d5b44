"""One axis of an MS-2000: its buffers, its servo and its stage.

Places are tenths of a micrometre from the reverse end of the stage. Positions on the wire have the same unit
and an offset, so that writing the position of a stage does not move it.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import StrEnum
from typing import Final

from stagewire_ms2000.flags import StatusBits
from stagewire_ms2000.quantities import POSITION, SPEED, TIME
from stagewire_virtual.axis import SimulatedAxis
from stagewire_virtual.clock import SECOND, Clock, Timer
from stagewire_virtual.options import Settings
from stagewire_virtual.profiles import Profile, run_on, stop, trapezoid

TRAVEL: Final = 1_000_000
"""The default travel: 100 mm."""
SETTLING: Final = 20 * SECOND // 1000
"""Nanoseconds that a servo settles after a move; the axis is then busy, without motor signal."""
_TOP_SPEED: Final = 6000
"""The top speed of a new controller in µm/s, from the examples of sections 24 and 25."""
_RAMP_TIME: Final = 100
"""The ramp time of a new controller in milliseconds; section 22 recommends more than 50."""

_COUNTS_PER_SPEED: Final = float(POSITION.counts_per_unit / SPEED.counts_per_unit)
_RAMP_TIMES_PER_SECOND: Final = float(1000 * TIME.counts_per_unit)


class _State(StrEnum):
    IDLE = "idle"
    MOVING = "moving"
    SETTLING = "settling"


class ServoAxis:
    """An axis that moves to targets and at vector speeds.

    :param clock: the clock.
    :param settings: travel and position of its stage in tenths of a micrometre.
    :param readings: the reading of each strategy.
    """

    def __init__(self, clock: Clock, settings: Settings, readings: Mapping[str, str]) -> None:
        travel = TRAVEL if settings.travel is None else settings.travel
        place = travel // 2 if settings.position is None else settings.position
        self._clock = clock
        self._readings = readings
        self._stage = SimulatedAxis(clock, travel, place)
        self._settled: Timer | None = None
        self._stuck = False
        self._goal: int | None = None
        self._run_speed = 0
        self.power_on()

    def power_on(self) -> None:
        """Reset to the power-on state, with position 0 at the present place; a stuck stage stays stuck."""
        self._rest()
        self._zero = round(self._stage.place)
        self.enabled = True
        self.joystick_enabled = True
        self.increment = 0
        self.ramp_time = _RAMP_TIME
        self.top_speed = _TOP_SPEED

    # Commands

    def set_position(self, position: int) -> None:
        """Make ``position`` the number of the present place; a target keeps its place (section 17)."""
        self._zero = round(self._stage.place) - position

    def move_to(self, position: int) -> None:
        """Move to a new target; a stopped axis moves when it is started (section 18)."""
        self._goal = self._zero + position
        self._move()

    def move_by(self, distance: int) -> None:
        """Move by ``distance`` from the present position (sections 19 and 20)."""
        self.move_to(self.position + distance)

    def run(self, speed: int) -> None:
        """Ramp to a speed in µm/s and keep it; 0 ramps to rest. A stopped axis ignores it (section 25).

        The top speed limits the speed of an axis (section 12).
        """
        if self.enabled:
            self._goal = None
            self._run_speed = min(max(speed, -self.top_speed), self.top_speed)
            self._move()

    def start(self) -> None:
        """Enable the motor (section 15)."""
        if not self.enabled:
            self.enabled = True
            if self._readings["start_motor"] == "stays":
                self._rest()
            elif self.target != self.position:
                self._move()

    def stop(self) -> None:
        """Disable the motor (section 16): it stops immediately and keeps its target."""
        goal = self._goal
        self._rest()
        self._goal = goal
        self.enabled = False

    @property
    def stuck(self) -> bool:
        """Whether the stage is blocked by a fault, while the servo keeps pushing."""
        return self._stuck

    @stuck.setter
    def stuck(self, stuck: bool) -> None:
        if stuck is not self._stuck:
            self._stuck = stuck
            if self._state is _State.MOVING:
                self._move()

    # State

    @property
    def exact_position(self) -> float:
        """The present position with its fraction."""
        return self._stage.place - self._zero

    @property
    def position(self) -> int:
        """The present position."""
        return round(self._stage.place) - self._zero

    @property
    def target(self) -> int:
        """The last target; the present position during a motion without a target."""
        return self.position if self._goal is None else self._goal - self._zero

    @property
    def speed(self) -> int:
        """The present speed of the trajectory in µm/s, with a sign (section 9)."""
        return round(self._stage.velocity / _COUNTS_PER_SPEED)

    @property
    def busy(self) -> bool:
        """Whether a command is still in progress (sections 4 and 16)."""
        if self.enabled:
            return self._state is not _State.IDLE
        return self._readings["disabled_axis"] == "busy" and self.target != self.position

    @property
    def status(self) -> StatusBits:
        """The present status byte (section 14)."""
        velocity, acceleration = self._stage.velocity, self._stage.acceleration
        return StatusBits.of(
            motor_signal=self._state is _State.MOVING,
            servo=True,
            joystick_enabled=self.joystick_enabled,
            ramping=acceleration != 0,
            ramping_down=acceleration * velocity < 0,
            upper_limit=self._stage.place >= self._stage.travel,
            lower_limit=self._stage.place <= 0,
        )

    @property
    def words(self) -> str:
        """The present state for people."""
        if not self.enabled:
            return "stopped"
        if self._state is not _State.MOVING:
            return self._state.value
        if self._stuck:
            return "stuck"
        return "moving up" if self._stage.velocity >= 0 else "moving down"

    # The servo

    def _move(self) -> None:
        """Start towards the target or at the vector speed, from the present motion."""
        if not self.enabled:
            return
        self._unsettle()
        self._state = _State.MOVING
        if self.top_speed and not self._stuck:
            self._stage.follow(self._plan(), self._arrived)
            return
        self._stage.halt()
        if self.target == self.position and (self._goal is not None or not self._run_speed):
            self._arrived()  # no motion is necessary

    def _plan(self) -> Profile:
        place = self._stage.place
        top = self.top_speed * _COUNTS_PER_SPEED
        ramp = {
            "acceleration": top * _RAMP_TIMES_PER_SECOND / self.ramp_time,  # section 22
            "initial_velocity": self._stage.velocity,
        }
        if self._goal is not None:
            return trapezoid(place, self._goal, velocity=top, **ramp)
        if not self._run_speed:
            return stop(place, **ramp)
        return run_on(place, self._run_speed * _COUNTS_PER_SPEED, **ramp)

    def _arrived(self) -> None:
        """Settle at the target, at an end of the travel or after a stop; this place becomes the target."""
        self._rest()
        self._state = _State.SETTLING
        self._settled = self._clock.call_later(SETTLING, self._rest)

    def _rest(self) -> None:
        """Stop, and make the present place the target."""
        self._unsettle()
        self._stage.halt()
        self._state = _State.IDLE
        self._goal = round(self._stage.place)
        self._run_speed = 0

    def _unsettle(self) -> None:
        if self._settled is not None:
            self._settled.cancel()
            self._settled = None
