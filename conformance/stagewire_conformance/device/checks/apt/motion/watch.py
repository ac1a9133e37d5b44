"""Watch motors in motion until each reports its end, or is at rest without reporting it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from math import inf
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

from stagewire_apt import messages as m
from stagewire_apt.enumerations import StopMode
from stagewire_conformance.device.checks.apt.motion.axis import (
    ENDS,
    HELD,
    JITTER,
    POLL,
    Axis,
    Status,
)
from stagewire_conformance.device.checks.apt.motion.pace import LONGEST

if TYPE_CHECKING:
    from stagewire_conformance.device.lines.dialogue import Incoming


Decision = Callable[[Axis, Status], bool]
"""Decides something about a motor from its status."""

_ANSWER: Final = 1.0
"""Seconds within which a status must arrive if no deadline is close."""

_BEHIND: Final = 0.05
"""Seconds in which a second end message would follow the last one."""

_LATEST: Final = 0.3
"""Seconds for which a status is recent enough to give the position of a motor."""

_PATIENCE: Final = 2.0
"""Seconds that a motor may be at rest without an end message."""

_HEEDED: Final = 0.2
"""Seconds after an immediate stop command in which a motor must come to rest; otherwise it is disabled."""
_STANDS: Final = 0.3
"""Seconds without motion after which a motor that was stopped at a bound is at rest."""
_PROGRESS: Final = 20
"""The number of last statuses that show whether a motor still moves."""
_GIVEN_UP: Final = 2.0
"""Seconds after an immediate stop command after which a motor is left to the end of the check."""


@dataclass
class Watched:
    """The observed motion of one motor.

    :param statuses: its statuses until it ended or was stopped, in order.
    :param ends: the end messages of this motor, or of an unknown one.
    :param after: its position immediately after the first end message; None without one.
    :param others: all other messages.
    :param stopped: its status when it was commanded to stop; None if it was not.
    :param stopped_at: its position immediately after that; None if it was not read.
    :param strayed: its status outside of its limits; None if it stayed within them.
    :param overdue: whether it was stopped because it moved for too long.
    :param halted: when it was stopped immediately because it strayed or was overdue. From then on, it is
        watched until it is at rest, whatever it reports; None if it was not.
    :param disabled: whether it was then disabled because it ignored the stop.
    :param unheard: whether it was stopped at its deadline without a recent position.
    :param seconds: seconds until its end, or until the watch ended.
    :param slowing: its statuses after it was commanded to stop, in order.
    :param over: whether it is no longer watched.
    :param moved: when it was last seen to move.
    :param place: its position then.
    """

    statuses: list[Status] = field(default_factory=list)
    ends: list[Incoming] = field(default_factory=list)
    after: int | None = None
    others: list[Incoming] = field(default_factory=list)
    stopped: Status | None = None
    stopped_at: int | None = None
    strayed: Status | None = None
    overdue: bool = False
    halted: float | None = None
    disabled: bool = False
    unheard: bool = False
    seconds: float = 0.0
    slowing: list[Status] = field(default_factory=list)
    over: bool = False
    moved: float = 0.0
    place: int | None = None

    @property
    def runs(self) -> bool:
        """Whether the motor has not been stopped yet."""
        return not self.over and self.stopped is None and self.halted is None and not self.unheard

    @property
    def progressed(self) -> bool:
        """Whether the motor was still going in one direction at the end."""
        first, *_, last = [each.position for each in self.statuses[-_PROGRESS:]] or [0, 0]
        return len(self.statuses) > _PROGRESS and abs(last - first) > JITTER

    def look(self, status: Status) -> None:
        """Record a status. After a stop, it no longer belongs to the motion."""
        if self.stopped is None and self.halted is None and not self.unheard:
            self.statuses.append(status)
        elif self.stopped is not None:
            self.slowing.append(status)
        if self.place is None or abs(status.position - self.place) > 2 * JITTER:  # it may tremble
            self.place, self.moved = status.position, status.time


def is_outside(axis: Axis, status: Status) -> bool:
    """Return whether a motor is outside of the allowed range, further than a servo overshoots."""
    return not axis.low - HELD <= status.position <= axis.high + HELD


def drop_ends(axis: Axis) -> None:
    """Drop the end messages of earlier motions that wait in the inbox."""
    heard = axis.trial.line.heard
    heard[:] = [each for each in heard if each.name not in ENDS]


def watch(
    axes: Sequence[Axis],
    limits: Mapping[Axis, float],
    *,
    done: Decision | None = None,
    stop: Decision | None = None,
    mode: StopMode = StopMode.PROFILED,
    strays: Decision | None = is_outside,
    deadlines: Mapping[Axis, float] = MappingProxyType({}),
    longest: float = LONGEST,
) -> dict[Axis, Watched]:
    """Watch moving motors until an end message of each has arrived.

    A motor that exceeds its time or its distance is stopped immediately, and disabled if it ignores that.

    :param limits: the seconds that a motor may take.
    :param done: decides to stop watching a motor earlier.
    :param stop: decides to stop a motor; its end is then awaited.
    :param mode: how it is stopped.
    :param strays: decides that a motor is where it must not be.
    :param deadlines: seconds after which a running motor is stopped regardless of its status: a status that
        is lost, late or stale does not show that the motor is about to leave the range.
    :param longest: the most seconds that any motor may take, as announced before the run.
    """
    line = axes[0].trial.line
    began = line.now
    seen = {axis: Watched(moved=began) for axis in axes}
    while not all(each.over for each in seen.values()):
        _take(seen, line.listen(POLL, until=lambda heard: heard.name in ENDS), line.now - began)
        _look_after_ends(seen)
        for axis, each in seen.items():
            _stop_in_time(seen, deadlines, began, mode)
            status = None if each.over else _status(axis, seen, deadlines, began)
            if status is None:
                continue
            each.look(status)
            if each.halted is not None:
                each.over = _is_halted(axis, each, each.halted, status)
                continue
            strayed = strays is not None and strays(axis, status)
            if strayed or line.now - began > min(limits[axis], longest):
                each.strayed, each.overdue = status if strayed else None, not strayed
                each.halted = status.time
                axis.send(m.MotMoveStop(axis.channel, StopMode.IMMEDIATE))
                continue
            if each.runs and stop is not None and stop(axis, status):
                each.stopped = status
                axis.send(m.MotMoveStop(axis.channel, mode))
                each.stopped_at = axis.position()
            each.seconds = line.now - began
            stands = status.time - each.moved > _PATIENCE
            is_done = done is not None and done(axis, status)
            each.over = stands or is_done
    _take(seen, line.listen(_BEHIND), line.now - began)
    for axis in axes:
        axis.watched = line.now
    return seen


def _look_after_ends(seen: Mapping[Axis, Watched]) -> None:
    """Read the position of each motor that has just reported its end: it may still be moving."""
    for axis, each in seen.items():
        if each.ends and each.after is None:
            each.after = axis.position()


def _stop_in_time(
    seen: Mapping[Axis, Watched], deadlines: Mapping[Axis, float], began: float, mode: StopMode
) -> None:
    """Stop the motors whose deadline has passed."""
    for axis, due in deadlines.items():
        each = seen[axis]
        now = axis.trial.line.now
        if not each.runs or now - began < due:
            continue
        last = each.statuses[-1] if each.statuses else None
        if last is not None and now - last.time < _LATEST:
            each.stopped = last
        else:
            each.unheard = True
        axis.send(m.MotMoveStop(axis.channel, mode))


def _status(
    axis: Axis, seen: Mapping[Axis, Watched], deadlines: Mapping[Axis, float], began: float
) -> Status | None:
    """Return the status of a motor; None if none arrived before the next deadline."""
    left = min((due for each, due in deadlines.items() if seen[each].runs), default=inf)
    left -= axis.trial.line.now - began
    return axis.status() if left >= _ANSWER else axis.status_within(max(0.0, left))


def _is_halted(axis: Axis, seen: Watched, halted: float, status: Status) -> bool:
    """Return whether a motor that was stopped at a bound is at rest. If it ignores the stop, disable it."""
    since = status.time - halted
    if not seen.disabled and since >= _HEEDED and status.time - seen.moved < _HEEDED:
        seen.disabled = True
        axis.disable()
    return status.time - seen.moved >= _STANDS or since > _GIVEN_UP


def _take(seen: Mapping[Axis, Watched], heard: Sequence[Incoming], seconds: float) -> None:
    """Assign messages to motors: end messages by source and channel, others by source."""
    for each in heard:
        axis = _whose(seen, each)
        if each.name not in ENDS:
            seen[axis].others.append(each)
            continue
        if seen[axis].overdue:
            continue  # it reports the stop
        seen[axis].ends.append(each)
        if not seen[axis].over and seen[axis].halted is None:
            seen[axis].over, seen[axis].seconds = True, seconds


def _whose(seen: Mapping[Axis, Watched], heard: Incoming) -> Axis:
    """Return the motor that a message belongs to, by its addresses in either order, and its channel.

    A message without a known address or channel belongs to a motor that has not ended yet.
    """
    axes = list(seen)
    from_it = [axis for axis in axes if axis.place.address == heard.source]
    to_it = [axis for axis in axes if axis.place.address == heard.dest]
    likely = from_it or to_it or axes
    likely = [axis for axis in likely if heard.channel in (axis.channel, None)] or likely
    return next((axis for axis in likely if not seen[axis].over), likely[0])
