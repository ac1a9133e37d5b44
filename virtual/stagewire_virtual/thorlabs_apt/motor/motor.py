"""Motors: moves, homing, jogs and stops, and their completions (pages 41 to 50).

A move during another takes over at the present velocity, and only the last one is completed. Moves are
refused while the channel is disabled, and with a velocity or acceleration of 0.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Final

from stagewire import Frame
from stagewire_apt import messages as m
from stagewire_apt.enumerations import JogMode, MoveDirection, StopMode
from stagewire_virtual.thorlabs_apt.channel import Channel, handles, stored
from stagewire_virtual.thorlabs_apt.motor.drive import Action
from stagewire_virtual.thorlabs_apt.motor.moves import GoTo, Pace, Paces, RunOn, SlowDown
from stagewire_virtual.thorlabs_apt.motor.stage import StageChannel
from stagewire_virtual.thorlabs_apt.motor.status import Activity
from stagewire_virtual.thorlabs_apt.motor.travel import homing

_STOP_MODES: Final = frozenset(map(int, StopMode))
_CLOCKWISE: Final = {int(MoveDirection.FORWARD): 1, int(MoveDirection.REVERSE): -1}
"""Direction of a message -> 1 clockwise, -1 counterclockwise."""

_COMPLETED: Final[Mapping[str, Callable[..., Any]]] = {
    "stepper": m.MotMoveCompletedStepper,
    "dc": m.MotMoveCompletedDc,
}
_STOPPED: Final[Mapping[str, Callable[..., Any]]] = {
    "stepper": m.MotMoveStoppedStepper,
    "dc": m.MotMoveStoppedDc,
}


class Motor(StageChannel):
    """A stepper or DC servo motor.

    :param channel: its channel.
    """

    def __init__(self, channel: Channel) -> None:
        super().__init__(channel)
        self._paces = Paces(channel, self._scales)
        self._awaited: str = channel.unit.facts.get("reports_ends_after", "")
        self._reports_ends = not self._awaited

    def power_on(self) -> None:
        """Reset to the power-on state; some units then report no ends of motions at first."""
        super().power_on()
        self._reports_ends = not self._awaited

    @stored("MOT_HOMEPARAMS")
    def home_parameters_were_set(self, frame: Frame) -> None:
        """Report the ends of motions from now on, also on units that wait for this (Issue 37, page 41)."""
        self._reports_ends = True

    def enabled_changed(self) -> None:
        """Stop immediately and report it when disabled in motion; clear a motion error when enabled."""
        action = self._drive.action
        if not self.channel.enabled:
            self._drive.rest()
            if action is not None:
                self._stopped(action.cause)
        else:
            self._drive.motion_error = False

    # Moves

    @handles("MOT_MOVE_ABSOLUTE")
    def move_absolute(self, frame: Frame) -> None:
        """Move to the position of the message, or to the stored one (page 45)."""
        match frame.message:
            case m.MotMoveAbsolute(absolute_distance=position):
                pass
            case _:
                position = self.channel.parameter("MOT_MOVEABSPARAMS", "absolute_position")
        self._move_to(frame, self._position.origin + position)

    @handles("MOT_MOVE_RELATIVE")
    def move_relative(self, frame: Frame) -> None:
        """Move by the distance of the message, or by the stored one (page 42), from the present position."""
        match frame.message:
            case m.MotMoveRelative(relative_distance=distance):
                pass
            case _:
                distance = self.channel.parameter("MOT_MOVERELPARAMS", "relative_distance")
        self._move_to(frame, round(self._axis.place) + distance)

    @handles("MOT_MOVE_VELOCITY")
    def move_velocity(self, frame: Frame) -> None:
        """Move in a direction until a stop or a limit (page 48)."""
        self._run(frame, Activity.MOVING, self._paces.move)

    @handles("MOT_MOVE_JOG")
    def move_jog(self, frame: Frame) -> None:
        """Jog in a direction, continuously or by one step from the present position (pages 32 and 47)."""
        pace = self._paces.jog
        if self.channel.parameter("MOT_JOGPARAMS", "jog_mode") == JogMode.CONTINUOUS:
            self._run(frame, Activity.JOGGING, pace)
        elif direction := self._direction(frame):
            step = self.channel.parameter("MOT_JOGPARAMS", "jog_step_size")
            way = GoTo(round(self._axis.place) + direction * step, pace)
            self._begin(Action(Activity.JOGGING, frame, pace, (way,), self._completed))

    @handles("MOT_MOVE_HOME")
    def move_home(self, frame: Frame) -> None:
        """Home (page 41); soft limits do not apply, because positions are not valid before."""
        pace = self._paces.home
        run = homing(self.channel, self._axis, pace)
        complete = self._home_found if run.found else self._stopped
        action = Action(Activity.HOMING, frame, pace, run.ways, complete, limited=False)
        if self._may_begin(action):
            self._homed = False
            self._drive.begin(action)

    @handles("MOT_MOVE_STOP")
    def move_stop(self, frame: Frame) -> None:
        """Stop immediately or with a profile (page 49); a motor at rest answers immediately.

        If the mode is neither of the two, a jog stops according to its parameters (page 32), and any other
        motion with a profile.
        """
        action = self._drive.action
        mode = getattr(frame.message, "stop_mode", 0)
        if mode not in _STOP_MODES and action is not None and action.doing is Activity.JOGGING:
            mode = self.channel.parameter("MOT_JOGPARAMS", "jog_stop_mode")
        if action is None or mode == StopMode.IMMEDIATE:
            self._drive.rest()
            self._stopped(frame)
        else:
            ways = (SlowDown(action.pace),)
            self._drive.begin(Action(Activity.STOPPING, frame, action.pace, ways, self._stopped))

    def _move_to(self, frame: Frame, place: int) -> None:
        """Move to a place; if the backlash requires it, overshoot and return (page 34).

        With a positive distance the last approach is forward, with a negative one in reverse. The position at
        which the motor would come to rest decides whether it must overshoot.
        """
        pace = self._paces.move
        action = Action(Activity.MOVING, frame, pace, (GoTo(place, pace),), self._completed)
        if self._may_begin(action):
            backlash = self.channel.parameter("MOT_GENMOVEPARAMS", "backlash_distance")
            velocity = self._axis.velocity
            rest = self._axis.place + velocity * abs(velocity) / (2 * pace.acceleration)
            if (place - rest) * backlash < 0:
                action.ways = (GoTo(place - backlash, pace), *action.ways)
            self._drive.begin(action)

    def _run(self, frame: Frame, doing: Activity, pace: Pace) -> None:
        if direction := self._direction(frame):
            self._begin(Action(doing, frame, pace, (RunOn(direction, pace),), self._completed))

    def _direction(self, frame: Frame) -> int:
        """Return how positions change in the direction of a message: 1 up, -1 down; 0 if it is invalid."""
        turn = _CLOCKWISE.get(getattr(frame.message, "direction", 0), 0)
        direction = turn * self.channel.clockwise
        if not direction:
            self.channel.report_fault(frame, "the direction must be 1 or 2")
        return direction

    def _begin(self, action: Action) -> None:
        if self._may_begin(action):
            self._drive.begin(action)

    def _may_begin(self, action: Action) -> bool:
        fault = action.pace.fault if self.channel.enabled else "the channel is disabled"
        if fault:
            self.channel.report_fault(action.cause, fault)
        return not fault

    # Completions

    def _completed(self, cause: Frame) -> None:
        if self._reports_ends:
            self._say(_COMPLETED, cause)

    def _stopped(self, cause: Frame) -> None:
        self._say(_STOPPED, cause)

    def _home_found(self, cause: Frame) -> None:
        self._homed = True
        self._position.set(0)
        self._encoder.set(0)
        if self._reports_ends:
            self.channel.send(m.MotMoveHomed(self.channel.ident), cause)

    def _say(self, layouts: Mapping[str, Callable[..., Any]], cause: Frame) -> None:
        message = layouts[self._kind](chan_ident=self.channel.ident, **self.status())
        self.channel.send(message, cause)
