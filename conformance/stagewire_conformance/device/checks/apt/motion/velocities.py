"""The velocity in the status of a moving motor (page 79), compared with the positions."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

from stagewire_conformance.device.causes import Cause
from stagewire_conformance.device.checks.apt.motion.axis import HELD, Axis, Status
from stagewire_conformance.device.checks.apt.motion.pace import coarsest_velocity, status_velocity

_TELLING: Final = 1.5
"""The minimum velocity, in units of the status, that must not be reported as 0."""
AT_REST: Final = "velocity at rest"
"""The aspect of a velocity that is reported at rest, which explains wrong ones on the way."""
SIGN: Final = "sign of the velocity"
"""The aspect of a velocity with the wrong sign."""
_ROUNDED: Final = 3.0
"""The tolerance of a reported velocity, in units of the status."""
_OFF: Final = 0.4
"""The tolerance of the average of the reported velocities, as a fraction of the measured speed."""
_LONG: Final = 0.12
"""The minimum time in seconds over which velocities and positions are compared."""
_WINDOW: Final = 0.08
"""The minimum time in seconds of a part of the way whose speed is measured."""
_FAR: Final = 8 * HELD
"""The minimum counts of such a part."""
_APART: Final = 2.0
"""The ratio of two speeds from which their reported velocities are compared."""
_PRECISE: Final = 20
"""The minimum velocity, in units of the status, of the faster one."""
HIGHEST: Final = 0x7FFF
"""The highest velocity that a status can represent with a sign."""
_FOLLOWS: Final = 1.6
"""The tolerance of the ratio of two reported velocities, as a factor."""


def judge_velocities(axis: Axis, told: str, midway: Sequence[Status], way: int) -> bool:
    """Report what is wrong with the velocity that a motor reports on its way; return whether it is right.

    :param midway: the statuses on its way.
    :param way: 1 if it moves to higher positions, -1 to lower ones.
    """
    if len(midway) < 2 or midway[0].velocity is None:
        return True
    return (
        _judge_zero(axis, told, midway)
        and _judge_sign(axis, told, midway, way)
        and _judge_size(axis, told, midway)
    )


def _judge_zero(axis: Axis, told: str, midway: Sequence[Status]) -> bool:
    """Report a velocity that stays 0; return whether it does not.

    Without a scale, the motor must be so fast that any documented scale gives more than 0.
    """
    unit = status_velocity(axis.place, axis.channel)
    least = _TELLING * (unit or coarsest_velocity(axis.place, axis.channel))
    speed = _measured(midway)
    last = midway[-1]
    if any(status.velocity for status in midway):
        return True
    (axis.trial.must if unit else axis.trial.should)(
        speed < least,
        f"{axis.text}: on its way after {told}, it moved at {speed:.0f} counts/s, but "
        f"{last.heard.name} still reported a velocity of 0",
        rule="dc-status-velocity",
        cause=Cause(last.heard.name, "velocity"),
        because=(Cause(last.heard.name, AT_REST),),
        came=last.heard.raw,
    )
    return False


def _judge_sign(axis: Axis, told: str, midway: Sequence[Status], way: int) -> bool:
    """Report a velocity of the wrong sign; return whether all are right.

    The page prints an unsigned word, so a velocity without a sign is NON-STRICT.
    """
    wrong = next((status for status in midway if (status.velocity or 0) * way < 0), None)
    if wrong is None:
        return True
    is_up = way > 0
    return (axis.trial.must if is_up else axis.trial.should)(
        False,
        f"{axis.text}: on its way {'up' if is_up else 'down'} after {told}, {wrong.heard.name} reports a "
        f"velocity of {wrong.velocity}; while positions {'rise' if is_up else 'fall'}, the velocity should "
        f"be {'positive' if is_up else 'negative'}",
        rule="dc-status-velocity",
        cause=[Cause(wrong.heard.name, aspect) for aspect in (SIGN, "velocity")[: 1 + is_up]],
        because=(Cause(wrong.heard.name, AT_REST),),
        came=wrong.heard.raw,
    )


def _judge_size(axis: Axis, told: str, midway: Sequence[Status]) -> bool:
    """Compare the average of the reported velocities with the measured speed, if their unit is known.

    Return whether they agree.
    """
    unit = status_velocity(axis.place, axis.channel)
    seconds = midway[-1].time - midway[0].time
    if not unit or seconds < _LONG:
        return True
    reported = unit * sum(
        (abs(before.velocity or 0) + abs(after.velocity or 0)) / 2 * (after.time - before.time)
        for before, after in pairwise(midway)
    ) / seconds  # fmt: skip
    speed = _measured(midway)
    last = midway[-1]
    return axis.trial.must(
        abs(reported - speed) <= _OFF * speed + _ROUNDED * unit + HELD / seconds,
        f"{axis.text}: on its way after {told}, it moved at {speed:.0f} counts/s, but the "
        f"velocities in {last.heard.name} were {reported / unit:.0f} on average, which is "
        f"{reported:.0f} counts/s",
        rule="dc-status-velocity",
        cause=Cause(last.heard.name, "velocity"),
        because=(Cause(last.heard.name, AT_REST),),
        came=last.heard.raw,
    )


def judge_changing_velocities(axis: Axis, told: str, moving: Sequence[Status]) -> None:
    """Report velocities that do not follow the speed while the motor speeds up or slows down.

    The ratio of two speeds needs no unit: that of the slowest and the fastest part of the way.

    :param moving: the statuses of the motor in motion.
    """
    windows = list(_windows(moving))
    if len(windows) < 2:
        return
    slow = min(windows, key=lambda each: each.speed)
    fast = max(windows, key=lambda each: each.speed)
    if fast.speed < _APART * slow.speed or fast.reported < _PRECISE:
        return
    last = moving[-1].heard
    due = fast.reported * slow.speed / fast.speed
    axis.trial.must(
        due / _FOLLOWS - _ROUNDED <= slow.reported <= due * _FOLLOWS + _ROUNDED,
        f"{axis.text}: on its way after {told}, it moved at {slow.speed:.0f} and at {fast.speed:.0f} "
        f"counts/s, but {last.name} reported velocities of {slow.reported:.0f} and {fast.reported:.0f}; "
        "the velocity should follow the motion",
        rule="dc-status-velocity",
        cause=Cause(last.name, "velocity"),
        because=(Cause(last.name, AT_REST),),
        came=last.raw,
    )


@dataclass(frozen=True)
class _Window:
    """A part of the way: its speed in counts/s, and the average of the velocities that were reported."""

    speed: float
    reported: float


def _windows(moving: Sequence[Status]) -> Iterator[_Window]:
    """Yield the successive parts of the way that are long enough to measure their speed."""
    if not moving or moving[0].velocity is None:
        return
    begin = moving[0]
    velocities = [begin]
    for status in moving[1:]:
        velocities.append(status)
        seconds, way = status.time - begin.time, abs(status.position - begin.position)
        if max(abs(each.velocity or 0) for each in velocities) >= HIGHEST:
            begin, velocities = status, [status]
        elif seconds >= _WINDOW and way >= _FAR:
            reported = sum(
                (abs(before.velocity or 0) + abs(after.velocity or 0))
                / 2
                * (after.time - before.time)
                for before, after in pairwise(velocities)
            )
            yield _Window(way / seconds, reported / seconds)
            begin, velocities = status, [status]


def _measured(midway: Sequence[Status]) -> float:
    """Return the average speed in counts/s."""
    first, last = midway[0], midway[-1]
    return abs(last.position - first.position) / max(last.time - first.time, 1e-3)
