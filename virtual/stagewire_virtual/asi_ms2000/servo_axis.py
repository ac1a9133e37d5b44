"""One axis of an MS-2000: its buffers, its servo, and the stage that it moves.

Places are counted from the reverse end of the stage, in tenths of a micrometre as positions are on the wire.
The counter of positions has an offset to them, so that another number for where a stage stands moves nothing.
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
"""How far apart the ends of a stage are that nothing is told of: 100 mm."""
SETTLING: Final = 20 * SECOND // 1000
"""Nanoseconds in which a servo settles after a move; the axis is busy then, without motor signal."""
_TOP_SPEED: Final = 6000
"""Of a new controller, in µm/s: that of the examples of sections 24 and 25."""
_RAMP_TIME: Final = 100
"""Of a new controller, in milliseconds; section 22 advises more than 50."""

_COUNTS_PER_SPEED: Final = float(POSITION.counts_per_unit / SPEED.counts_per_unit)
_RAMP_TIMES_PER_SECOND: Final = float(1000 * TIME.counts_per_unit)


class _State(StrEnum):
    IDLE = "idle"
    MOVING = "moving"
    SETTLING = "settling"


class ServoAxis:
    """An axis that moves to targets and at vector speeds.

    :param clock: the time.
    :param settings: travel and position of its stage in tenths of a micrometre.
    :param readings: the reading of every strategy.
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
        """Begin anew, with the counter at zero where the stage stands; whether it is stuck stays as it is."""
        self._rest()
        self._zero = round(self._stage.place)
        self.enabled = True
        self.joystick_enabled = True
        self.increment = 0
        self.ramp_time = _RAMP_TIME
        self.top_speed = _TOP_SPEED

    # What it is told

    def set_position(self, position: int) -> None:
        """Call the place where it stands ``position``; a target keeps its place, too (section 17)."""
        self._zero = round(self._stage.place) - position

    def move_to(self, position: int) -> None:
        """Make ``position`` the target and go there; a stopped axis goes when it is started (section 18)."""
        self._goal = self._zero + position
        self._move()

    def move_by(self, distance: int) -> None:
        """Go as far as ``distance`` from where it is at this instant (sections 19 and 20)."""
        self.move_to(self.position + distance)

    def run(self, speed: int) -> None:
        """Ramp to a speed in µm/s and go on; 0 ramps to rest. A stopped axis does nothing (section 25).

        No axis is allowed to be faster than its top speed (section 12).
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
        """Disable the motor (section 16): it stands at once, and keeps its target."""
        goal = self._goal
        self._rest()
        self._goal = goal
        self.enabled = False

    @property
    def stuck(self) -> bool:
        """Whether something holds the stage, against which the servo pushes for ever; faults set it."""
        return self._stuck

    @stuck.setter
    def stuck(self, stuck: bool) -> None:
        if stuck is not self._stuck:
            self._stuck = stuck
            if self._state is _State.MOVING:
                self._move()

    # What it tells

    @property
    def exact_position(self) -> float:
        """What the counter would show if it had more digits."""
        return self._stage.place - self._zero

    @property
    def position(self) -> int:
        """What the counter shows at this instant."""
        return round(self._stage.place) - self._zero

    @property
    def target(self) -> int:
        """Where it goes to or has gone to; where it is while it runs without a target."""
        return self.position if self._goal is None else self._goal - self._zero

    @property
    def speed(self) -> int:
        """The speed of the trajectory at this instant in µm/s, with its sign (section 9)."""
        return round(self._stage.velocity / _COUNTS_PER_SPEED)

    @property
    def busy(self) -> bool:
        """Whether a command is still being carried out (sections 4 and 16)."""
        if self.enabled:
            return self._state is not _State.IDLE
        return self._readings["disabled_axis"] == "busy" and self.target != self.position

    @property
    def status(self) -> StatusBits:
        """The status byte of this instant (section 14)."""
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
        """What it does, for people."""
        if not self.enabled:
            return "stopped"
        if self._state is not _State.MOVING:
            return self._state.value
        if self._stuck:
            return "stuck"
        return "moving up" if self._stage.velocity >= 0 else "moving down"

    # The servo

    def _move(self) -> None:
        """Go to the goal, or at the speed that was told, from whatever it does at this instant."""
        if not self.enabled:
            return
        self._unsettle()
        self._state = _State.MOVING
        if self.top_speed and not self._stuck:
            self._stage.follow(self._plan(), self._arrived)
            return
        self._stage.halt()
        if self.target == self.position and (self._goal is not None or not self._run_speed):
            self._arrived()  # it need not move to do what it was told

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
        """Settle at the goal, at an end of the travel or where it slowed down; the target is there now."""
        self._rest()
        self._state = _State.SETTLING
        self._settled = self._clock.call_later(SETTLING, self._rest)

    def _rest(self) -> None:
        """Stand, with the target where it stands."""
        self._unsettle()
        self._stage.halt()
        self._state = _State.IDLE
        self._goal = round(self._stage.place)
        self._run_speed = 0

    def _unsettle(self) -> None:
        if self._settled is not None:
            self._settled.cancel()
            self._settled = None
