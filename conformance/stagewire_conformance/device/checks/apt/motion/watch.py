"""Motors in motion are watched until each says that it has ended, or stands without a word."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from math import inf
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

from stagewire_apt import messages as m
from stagewire_apt.enumerations import StopMode
from stagewire_conformance.device.checks.apt.motion.axis import HELD, JITTER, POLL, Axis, Status

if TYPE_CHECKING:
    from stagewire_conformance.device.lines.dialogue import Incoming


ENDS: Final = frozenset({"MOT_MOVE_COMPLETED", "MOT_MOVE_STOPPED", "MOT_MOVE_HOMED"})
"""The messages that tell that a motion has ended."""

Decision = Callable[[Axis, Status], bool]
"""Decides something of a motor by its status."""

_ANSWER: Final = 1.0
"""Seconds within which a status has to come where nothing presses."""

_BEHIND: Final = 0.05
"""Seconds in which a second end would come behind the last one."""

_LATEST: Final = 0.3
"""Seconds for which a status tells where a motor is."""

_PATIENCE: Final = 2.0
"""Seconds that a motor may stand without a word."""

_HEEDED: Final = 0.12
"""Seconds after which a motor that was told to stop at once does not move any more."""
_STANDS: Final = 0.3
"""Seconds without motion after which a motor that was called back stands."""
_GIVEN_UP: Final = 10.0
"""Seconds after which nothing more can be done for it."""


@dataclass
class Watched:
    """What was seen of the motion of one motor.

    :param statuses: what it said of itself until it ended or was stopped, in order.
    :param ends: the end messages that are its own, or of which nobody knows whose they are.
    :param others: what else came.
    :param stopped: its status when it was told to stop; None: it was not.
    :param strayed: its status where it must not be; None: it was not there. From then on it is watched until
        it stands, whatever it says.
    :param called_back: whether it was told to go back then.
    :param unheard: whether it was stopped without knowing where it was, because the time for it had come.
    :param seconds: until its end, or until it was given up.
    :param over: whether it is watched no more.
    :param moved: when it was last seen to move.
    :param place: where it was then.
    """

    statuses: list[Status] = field(default_factory=list)
    ends: list[Incoming] = field(default_factory=list)
    others: list[Incoming] = field(default_factory=list)
    stopped: Status | None = None
    strayed: Status | None = None
    called_back: bool = False
    unheard: bool = False
    seconds: float = 0.0
    over: bool = False
    moved: float = 0.0
    place: int | None = None

    @property
    def runs(self) -> bool:
        """Whether nobody has stopped it yet."""
        return not self.over and self.stopped is None and self.strayed is None and not self.unheard

    def look(self, status: Status) -> None:
        """Note a status; those after a stop are not those of the motion any more."""
        if self.stopped is None and not self.unheard:
            self.statuses.append(status)
        if self.place is None or abs(status.position - self.place) > JITTER:
            self.place, self.moved = status.position, status.time


def is_outside(axis: Axis, status: Status) -> bool:
    """Return whether a motor has left the range that was allowed, further than a servo overshoots."""
    return not axis.low - HELD <= status.position <= axis.high + HELD


def watch(
    axes: Sequence[Axis],
    limits: Mapping[Axis, float],
    *,
    done: Decision | None = None,
    stop: Decision | None = None,
    mode: StopMode = StopMode.PROFILED,
    strays: Decision | None = is_outside,
    deadlines: Mapping[Axis, float] = MappingProxyType({}),
) -> dict[Axis, Watched]:
    """Watch motors that were told to move, until an end message of each has come.

    :param limits: seconds after which one is given up, if it still moves then.
    :param done: ends the watching of a motor before.
    :param stop: has a motor stopped, at once, and its end awaited.
    :param mode: how it is stopped.
    :param strays: says that a motor is where it must not be: it is called back, whatever that takes.
    :param deadlines: seconds after which a motor that runs on is stopped whatever is heard of it: a status
        that is lost, late or stale does not tell that it is about to leave the range.
    """
    line = axes[0].trial.line
    began = line.now
    seen = {axis: Watched(moved=began) for axis in axes}
    while not all(each.over for each in seen.values()):
        _take(seen, line.listen(POLL, until=lambda heard: heard.name in ENDS), line.now - began)
        for axis, each in seen.items():
            _stop_in_time(seen, deadlines, began, mode)
            status = None if each.over else _status(axis, seen, deadlines, began)
            if status is None:
                continue
            each.look(status)
            if each.strayed is not None:
                each.over = _is_back(axis, each, status)
                continue
            if strays is not None and strays(axis, status):
                each.strayed = status
                axis.send(m.MotMoveStop(axis.channel, StopMode.IMMEDIATE))
                continue
            if each.runs and stop is not None and stop(axis, status):
                each.stopped = status
                axis.send(m.MotMoveStop(axis.channel, mode))
            each.seconds = line.now - began
            stands = status.time - each.moved > _PATIENCE
            is_done = done is not None and done(axis, status)
            each.over = stands or is_done or each.seconds > limits[axis]
    _take(seen, line.listen(_BEHIND), line.now - began)
    return seen


def _stop_in_time(
    seen: Mapping[Axis, Watched], deadlines: Mapping[Axis, float], began: float, mode: StopMode
) -> None:
    """Stop the motors whose time is over."""
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
    """Return the status of a motor; None where none came until one has to be stopped."""
    left = min((due for each, due in deadlines.items() if seen[each].runs), default=inf)
    left -= axis.trial.line.now - began
    return axis.status() if left >= _ANSWER else axis.status_within(max(0.0, left))


def _is_back(axis: Axis, seen: Watched, status: Status) -> bool:
    """Return whether a motor that strayed stands; one that heeds no stop is told to go back, once."""
    assert seen.strayed is not None
    since = status.time - seen.strayed.time
    if not seen.called_back and since >= _HEEDED and status.time - seen.moved < _HEEDED:
        seen.called_back = True
        axis.send(m.MotMoveAbsolute(axis.channel, axis.start))
    return status.time - seen.moved >= _STANDS or since > _GIVEN_UP


def _take(seen: Mapping[Axis, Watched], heard: Sequence[Incoming], seconds: float) -> None:
    """Sort what came: ends by their source and channel, others by their source."""
    for each in heard:
        axis = _whose(seen, each)
        if each.name not in ENDS:
            seen[axis].others.append(each)
            continue
        seen[axis].ends.append(each)
        if not seen[axis].over and seen[axis].strayed is None:
            seen[axis].over, seen[axis].seconds = True, seconds


def _whose(seen: Mapping[Axis, Watched], heard: Incoming) -> Axis:
    """Return whose message it is, by its addresses, in either order, and by its channel.

    Of one that says nothing known it is a motor that still waits for its end.
    """
    axes = list(seen)
    from_it = [axis for axis in axes if axis.place.address == heard.source]
    to_it = [axis for axis in axes if axis.place.address == heard.dest]
    likely = from_it or to_it or axes
    likely = [axis for axis in likely if heard.channel in (axis.channel, None)] or likely
    return next((axis for axis in likely if not seen[axis].over), likely[0])
