"""What makes an axis do what a motor is told: one action at a time, from its first way to its completion."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial
from typing import Final

from stagewire import Frame
from stagewire_apt.quantities import SERVO_CYCLES
from stagewire_virtual.axis import SimulatedAxis
from stagewire_virtual.clock import Timer
from stagewire_virtual.thorlabs_apt.channel import Channel
from stagewire_virtual.thorlabs_apt.motor.moves import Move, Pace, SlowDown
from stagewire_virtual.thorlabs_apt.motor.status import Activity
from stagewire_virtual.thorlabs_apt.motor.travel import Limit

_NANOSECONDS_PER_CYCLE: Final = 1000 / SERVO_CYCLES.counts_per_unit
_POSITION_ERROR_LIMIT: Final = 65_535
"""Of servos without MOT_PMDPOSITIONLOOPPARAMS; the example of page 62 has it."""


@dataclass(slots=True)
class Action:
    """What a motor has been told.

    :param doing: for the status bits.
    :param cause: the frame that told it.
    :param pace: of all its ways.
    :param ways: those that are left, the present one first.
    :param complete: called with the cause at the end of the last one.
    :param limited: whether soft limits end it.
    """

    doing: Activity
    cause: Frame
    pace: Pace
    ways: tuple[Move, ...]
    complete: Callable[[Frame], None]
    limited: bool = True


class Drive:
    """Drives the axis of a channel.

    :param channel: its parameters and its clock.
    :param axis: what it drives.
    :param limits: gives the soft limits of this instant.
    """

    def __init__(
        self, channel: Channel, axis: SimulatedAxis, limits: Callable[[], Iterable[Limit]]
    ) -> None:
        self._channel = channel
        self._axis = axis
        self._limits = limits
        self._action: Action | None = None
        self._settling: Timer | None = None
        self._rests_since = channel.clock.now
        self.motion_error = False
        """Whether an excessive position error has stopped it, since it was last told to move or enabled."""

    @property
    def action(self) -> Action | None:
        """What it has been told and has not completed."""
        return self._action

    @property
    def settled(self) -> bool:
        """Whether it has been at rest for the settle time: its error is then 0 (page 66)."""
        rests = self._channel.clock.now - self._rests_since
        return not self._axis.moving and rests >= self._settle_time

    @property
    def tracking(self) -> bool:
        """Whether its position error is within the track window (page 66)."""
        window = self._channel.parameter("MOT_PMDTRACKSETTLEPARAMS", "track_window")
        return abs(self._axis.error) <= window

    def begin(self, action: Action) -> None:
        """Take an action over from the present one, at its velocity; only the new one will be completed."""
        self._settle_no_more()
        self.motion_error = False
        self._action = action
        self._follow(self._axis.velocity)

    def rest(self) -> None:
        """Stand, at once; the present action is not completed."""
        self._settle_no_more()
        if self._axis.moving:
            self._axis.halt()
            self._rests_since = self._channel.clock.now
        self._action = None

    def hold(self, held: bool) -> None:
        """Let something hold the axis, or let it go; it goes to where it was going then."""
        if held is self._axis.held:
            return
        velocity = self._axis.velocity
        self._axis.held = held
        if self._action is None or self._settling is not None:
            return
        if held and self._action.doing is Activity.STOPPING:
            self._end()  # it has stopped
        else:
            self._follow(velocity)

    def _follow(self, velocity: float) -> None:
        """Go the first way of the action, from a velocity."""
        action, axis = self._action, self._axis
        if action is None:
            return
        profile = action.ways[0].profile(axis.place, velocity)
        if profile.duration == 0:
            self._gone()
            return
        axis.follow(profile, self._gone)
        if action.limited:
            for limit in self._limits():
                axis.watch(limit.place, limit.direction, partial(self._at_limit, limit))
        if axis.held and self._channel.unit.facts["status"] == "dc":
            allowed = self._channel.parameter(
                "MOT_PMDPOSITIONLOOPPARAMS", "pos_err_lim", _POSITION_ERROR_LIMIT
            )
            for direction in (1, -1):
                axis.watch(axis.place + direction * allowed, direction, self._lose)

    def _gone(self) -> None:
        """Go on with the next way, or settle (page 66); whoever stops does not wait for that."""
        action = self._action
        if action is None:
            return
        self._axis.halt()
        self._rests_since = self._channel.clock.now
        action.ways = action.ways[1:]
        if action.ways:
            self._follow(0.0)
        elif self._settle_time and action.doing is not Activity.STOPPING:
            self._settling = self._channel.clock.call_later(self._settle_time, self._end)
        else:
            self._end()

    def _at_limit(self, limit: Limit) -> None:
        """Stop at a soft limit, at once or from there on, and complete what was done (page 48).

        Who only went beyond the target for the backlash still goes there.
        """
        action = self._action
        if action is None or self._axis.held:
            return
        if limit.profiled:
            velocity = self._axis.velocity
            action.ways = (SlowDown(action.pace), *action.ways[1:])
            action.limited = False
            self._follow(velocity)
        else:
            self._axis.halt(near=limit.place)
            self._gone()

    def _lose(self) -> None:
        """Give up: the position error is excessive, and stops the axis (page 62)."""
        self.rest()
        self.motion_error = True

    def _end(self) -> None:
        """Rest, and complete the action."""
        action = self._action
        self.rest()
        if action is not None:
            action.complete(action.cause)

    @property
    def _settle_time(self) -> int:
        """How long it must rest until it counts as settled, in nanoseconds (page 67)."""
        cycles = self._channel.parameter("MOT_PMDTRACKSETTLEPARAMS", "time")
        return round(cycles * _NANOSECONDS_PER_CYCLE)

    def _settle_no_more(self) -> None:
        if self._settling is not None:
            self._settling.cancel()
            self._settling = None
