"""The drive of a motor: it carries out one action at a time, from its first move to its completion."""

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
"""The limit of servos without MOT_PMDPOSITIONLOOPPARAMS, from the example of page 62."""


@dataclass(slots=True)
class Action:
    """An action of a motor.

    :param doing: its kind, for the status bits.
    :param cause: the frame that started it.
    :param pace: the pace of its moves.
    :param ways: the remaining moves, the present one first.
    :param complete: called with the cause at the end of the last move.
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

    :param channel: the channel.
    :param axis: the axis.
    :param limits: returns the present soft limits.
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
        """Whether an excessive position error stopped it; cleared by the next move and when enabled."""

    @property
    def action(self) -> Action | None:
        """The present action; None at rest."""
        return self._action

    @property
    def settled(self) -> bool:
        """Whether it has been at rest for the settle time, with an error of 0 (page 66)."""
        rests = self._channel.clock.now - self._rests_since
        return not self._axis.moving and rests >= self._settle_time

    @property
    def tracking(self) -> bool:
        """Whether its position error is within the track window (page 66)."""
        window = self._channel.parameter("MOT_PMDTRACKSETTLEPARAMS", "track_window")
        return abs(self._axis.error) <= window

    def begin(self, action: Action) -> None:
        """Start an action at the present velocity; it replaces the present action, which is not completed."""
        self._settle_no_more()
        self.motion_error = False
        self._action = action
        self._follow(self._axis.velocity)

    def rest(self) -> None:
        """Stop immediately, without completing the present action."""
        self._settle_no_more()
        if self._axis.moving:
            self._axis.halt()
            self._rests_since = self._channel.clock.now
        self._action = None

    def hold(self, held: bool) -> None:
        """Block the axis, or release it; a released axis continues to its target."""
        if held is self._axis.held:
            return
        velocity = self._axis.velocity
        self._axis.held = held
        if self._action is None or self._settling is not None:
            return
        if held and self._action.doing is Activity.STOPPING:
            self._end()  # a blocked axis has stopped
        else:
            self._follow(velocity)

    def _follow(self, velocity: float) -> None:
        """Start the first move of the action at a velocity."""
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
        """Continue with the next move, or settle (page 66); stops do not settle."""
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
        """Stop at a soft limit, immediately or with a profile, and complete the action (page 48).

        A move that overshot its target for the backlash still returns to it.
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
        """Stop with a motion error, because the position error is excessive (page 62)."""
        self.rest()
        self.motion_error = True

    def _end(self) -> None:
        """Stop and complete the action."""
        action = self._action
        self.rest()
        if action is not None:
            action.complete(action.cause)

    @property
    def _settle_time(self) -> int:
        """The time at rest after which it counts as settled, in nanoseconds (page 67)."""
        cycles = self._channel.parameter("MOT_PMDTRACKSETTLEPARAMS", "time")
        return round(cycles * _NANOSECONDS_PER_CYCLE)

    def _settle_no_more(self) -> None:
        if self._settling is not None:
            self._settling.cancel()
            self._settling = None
