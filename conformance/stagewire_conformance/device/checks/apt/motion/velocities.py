"""The velocity in the status of a moving motor (page 79), compared with the positions."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Final

from stagewire_conformance.device.causes import Cause
from stagewire_conformance.device.checks.apt.motion.axis import HELD, Axis, Status
from stagewire_conformance.device.checks.apt.motion.pace import coarsest_velocity, status_velocity

_TELLING: Final = 1.5
"""The minimum velocity, in units of the status, that must not be reported as 0."""
_ROUNDED: Final = 3.0
"""The tolerance of a reported velocity, in units of the status."""
_OFF: Final = 0.4
"""The tolerance of the average of the reported velocities, as a fraction of the measured speed."""
_LONG: Final = 0.12
"""The minimum time in seconds over which velocities and positions are compared."""


def judge_velocities(axis: Axis, told: str, midway: Sequence[Status], way: int) -> None:
    """Report what is wrong with the velocity that a motor reports on its way.

    :param midway: the statuses on its way.
    :param way: 1 if it moves to higher positions, -1 to lower ones.
    """
    if len(midway) < 2 or midway[0].velocity is None:
        return
    if _judge_zero(axis, told, midway) and _judge_sign(axis, told, midway, way):
        _judge_size(axis, told, midway)


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
        cause=[
            Cause(wrong.heard.name, aspect)
            for aspect in ("sign of the velocity", "velocity")[: 1 + is_up]
        ],
        came=wrong.heard.raw,
    )


def _judge_size(axis: Axis, told: str, midway: Sequence[Status]) -> None:
    """Compare the average of the reported velocities with the measured speed, if their unit is known."""
    unit = status_velocity(axis.place, axis.channel)
    seconds = midway[-1].time - midway[0].time
    if not unit or seconds < _LONG:
        return
    reported = unit * sum(
        (abs(before.velocity or 0) + abs(after.velocity or 0)) / 2 * (after.time - before.time)
        for before, after in pairwise(midway)
    ) / seconds  # fmt: skip
    speed = _measured(midway)
    last = midway[-1]
    axis.trial.must(
        abs(reported - speed) <= _OFF * speed + _ROUNDED * unit + HELD / seconds,
        f"{axis.text}: on its way after {told}, it moved at {speed:.0f} counts/s, but the "
        f"velocities in {last.heard.name} were {reported / unit:.0f} on average, which is "
        f"{reported:.0f} counts/s",
        rule="dc-status-velocity",
        cause=Cause(last.heard.name, "velocity"),
        came=last.heard.raw,
    )


def _measured(midway: Sequence[Status]) -> float:
    """Return the average speed in counts/s."""
    first, last = midway[0], midway[-1]
    return abs(last.position - first.position) / max(last.time - first.time, 1e-3)
