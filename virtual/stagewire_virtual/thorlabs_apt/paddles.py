"""Paddles of the polarization controllers MPC220 and MPC320 (Issue 37, pages 407 to 409)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Final

from stagewire import Frame
from stagewire_apt import messages as m
from stagewire_apt.enumerations import EnableState, MoveDirection
from stagewire_apt.flags import DcStatusBits
from stagewire_virtual.axis import SimulatedAxis
from stagewire_virtual.profiles import trapezoid
from stagewire_virtual.thorlabs_apt.channel import (
    Behaviour,
    Channel,
    LiveState,
    handles,
    live,
    stored,
)
from stagewire_virtual.thorlabs_apt.motor.status import Activity, Counter

FULL_TRAVEL: Final = 1370
"""The travel in counts, which is 170 degrees (page 408)."""
FASTEST: Final = 400.0
"""The velocity of 100 % in degrees per second (page 408)."""
ACCELERATION: Final = 2000.0
"""The acceleration in degrees per second, per second. An assumption: no document states it."""

_COUNTS_PER_DEGREE: Final = FULL_TRAVEL / 170
_SET: Final = "POL_PARAMS"
_DIRECTIONS: Final = {int(MoveDirection.FORWARD): 1, int(MoveDirection.REVERSE): -1}


@dataclass(frozen=True, slots=True)
class _Action:
    doing: Activity
    cause: Frame
    place: int
    complete: Callable[[Frame], None]


class Paddle(Behaviour):
    """The channel of a paddle, which turns over 170 degrees. Its encoder knows the angle at power-on.

    Decisions where the document is silent:

    * The channel of MOD_SET_CHANENABLESTATE is a mask: with ENABLE, paddles in the mask are enabled and all
      others are disabled, as in two public drivers (github moonshot-nagayama-pj/PnPQ; QuTech-Delft/QMI). With
      DISABLE, which these do not send, paddles in the mask are disabled.
    * Paddles of a new controller are disabled, because page 407 requires MOD_SET_CHANENABLESTATE first.
    * A new paddle is at 0.
    * A moving paddle that is disabled stops immediately and reports it.
    * MOT_MOVE_HOME moves to the home position of POL_SET_PARAMS, and the position counter keeps its zero.
    * The velocity is that at the start of a move. Other moves than those of this paddle do not depend on it.
    * Targets outside the travel are refused, and a jog ends at the end of the travel. No limit bit is set
      there, because the paddles have no switches.
    * Completions have no status, as the public drivers expect.

    :param channel: its channel; ``travel`` and ``position`` of its settings are in counts.
    """

    can_stick = True
    enables_by_mask = True

    def __init__(self, channel: Channel) -> None:
        super().__init__(channel)
        settings = channel.settings
        travel = FULL_TRAVEL if settings.travel is None else settings.travel
        position = 0 if settings.position is None else settings.position
        self._number = channel.ident.bit_length()
        self._axis = SimulatedAxis(channel.clock, travel, position)
        self._action: _Action | None = None
        self._homed = False
        self._counter = Counter(self._axis)
        self._counter.set(round(self._axis.place))
        channel.enabled = False

    @classmethod
    def defaults(cls, channel: Channel) -> Mapping[str, Mapping[str, Any]]:
        """Return the parameters of a new controller: the example of page 409, and all paddles disabled."""
        jogs = {f"jog_step{number}": 25 for number in (1, 2, 3)}
        return {
            _SET: {"velocity": 50, "home_position": 0, **jogs},
            "MOD_CHANENABLESTATE": {"enable_state": EnableState.DISABLE},
        }

    @property
    def angle(self) -> float:
        """The true angle in degrees from the lower end of the travel."""
        return self._axis.place / _COUNTS_PER_DEGREE

    # Moves

    @handles("MOT_MOVE_ABSOLUTE")
    def move_absolute(self, frame: Frame) -> None:
        """Move to the position of the message; without one, to 0, because no set stores a position."""
        position = getattr(frame.message, "absolute_distance", 0)
        place = self._counter.origin + position
        if 0 <= place <= self._axis.travel:
            self._go(frame, Activity.MOVING, place, self._completed)
        else:
            self.channel.report_fault(frame, f"the position {position} is outside the travel")

    @handles("MOT_MOVE_JOG")
    def move_jog(self, frame: Frame) -> None:
        """Move by the jog step of this paddle (page 408)."""
        message: Any = frame.message
        direction = _DIRECTIONS.get(message.direction, 0)
        if not direction:
            self.channel.report_fault(frame, "the direction must be 1 or 2")
            return
        step = self.channel.parameter(_SET, f"jog_step{self._number}")
        place = round(self._axis.place) + direction * step
        self._go(frame, Activity.JOGGING, place, self._completed)

    @handles("MOT_MOVE_HOME")
    def move_home(self, frame: Frame) -> None:
        """Move to the home position, which is the same for all paddles (page 408)."""
        home = self._counter.origin + self.channel.parameter(_SET, "home_position")
        self._go(frame, Activity.HOMING, home, self._found_home)

    @handles("MOT_MOVE_STOP")
    def move_stop(self, frame: Frame) -> None:
        """Stop immediately and report it, also at rest."""
        self._rest()
        self._stopped(frame)

    def _go(
        self, frame: Frame, doing: Activity, place: int, complete: Callable[[Frame], None]
    ) -> None:
        if not self.channel.enabled:
            self.channel.report_fault(frame, "the paddle is disabled")
            return
        self._rest()
        if doing is Activity.HOMING:
            self._homed = False
        self._action = _Action(doing, frame, min(max(place, 0), self._axis.travel), complete)
        self._follow(self._action)

    def _follow(self, action: _Action) -> None:
        percent = self.channel.parameter(_SET, "velocity")
        profile = trapezoid(
            self._axis.place,
            action.place,
            velocity=FASTEST * percent / 100 * _COUNTS_PER_DEGREE,
            acceleration=ACCELERATION * _COUNTS_PER_DEGREE,
        )
        if profile.duration == 0:
            self._end()
        else:
            self._axis.follow(profile, self._end)

    def _rest(self) -> None:
        self._axis.halt()
        self._action = None

    def _end(self) -> None:
        action = self._action
        self._rest()
        if action is not None:
            action.complete(action.cause)

    def _completed(self, cause: Frame) -> None:
        self.channel.send(m.MotMoveCompletedHeader(self.channel.ident), cause)

    def _found_home(self, cause: Frame) -> None:
        self._homed = True
        self.channel.send(m.MotMoveHomed(self.channel.ident), cause)

    def _stopped(self, cause: Frame) -> None:
        self.channel.send(m.MotMoveStoppedDc(chan_ident=self.channel.ident, **self.status()), cause)

    # For the controller

    def power_on(self) -> None:
        """Reset to the power-on state, at the present angle."""
        self._rest()
        self._homed = False
        self._counter.set(round(self._axis.place))

    def enabled_changed(self) -> None:
        """Stop a moving paddle that is disabled."""
        action = self._action
        if not self.channel.enabled and action is not None:
            self._rest()
            self._stopped(action.cause)

    def stuck_changed(self) -> None:
        """Block the paddle, or release it, which then continues to its target."""
        self._axis.held = self.channel.stuck
        if self._action is not None and not self.channel.stuck:
            self._follow(self._action)

    @live("MOT_POSCOUNTER")
    def position(self) -> dict[str, int]:
        """Return the position counter."""
        return {"position": self._counter.value}

    @stored("MOT_POSCOUNTER")
    def position_was_set(self, frame: Frame) -> None:
        """Set the position counter; nothing moves."""
        self._counter.set(self.channel.parameter("MOT_POSCOUNTER", "position"))

    def status(self) -> Mapping[str, int]:
        """Return the present position, velocity and status bits."""
        action, direction = self._action, self._axis.direction
        jogs = action is not None and action.doing is Activity.JOGGING
        bits = DcStatusBits.of(
            moving_forward=direction > 0,
            moving_reverse=direction < 0,
            jogging_forward=direction > 0 and jogs,
            jogging_reverse=direction < 0 and jogs,
            homing=action is not None and action.doing is Activity.HOMING,
            homed=self._homed,
            motor_connected=True,
            channel_enabled=self.channel.enabled,
        )
        velocity = round(self._axis.velocity)
        return {"position": self._counter.value, "velocity": velocity, "status_bits": bits}

    def row(self) -> LiveState:
        """Return the angle and the state."""
        state = "disabled" if not self.channel.enabled else "at rest"
        if self._action is not None:
            state = self._action.doing.value
        return LiveState(f"{self.angle:.2f} deg", state)
