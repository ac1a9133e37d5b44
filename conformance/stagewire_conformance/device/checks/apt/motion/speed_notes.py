"""Evidence for the scale of velocity parameters: the speeds of motions.

A velocity may have no scale, or one that the document under test does not have. Then a controller may take
the unit of page 30 literally. A motor that is several times as fast as the scale allows does so. A motor
that moves steadily at the speed of the scale confirms the scale. A short move without a
steady speed shows nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Final

from stagewire_conformance.device.checks.apt.motion.axis import POLL, Axis, Status
from stagewire_conformance.device.checks.apt.motion.pace import Pace, pace_of

_CREEPS: Final = 10.0
"""Counts/s up to which a motor may only tremble."""
_STEADY: Final = 4
"""The number of successive speeds that show a steady motion."""
_EXACT: Final = 0.1
"""The relative difference of these speeds from the velocity."""


def note_speed(axis: Axis, statuses: Sequence[Status], pace: Pace) -> None:
    """Note the highest speed of a motion, if it is not certain which scale velocities have.

    :param pace: the pace that the motion should have.
    """
    speeds = _speeds(statuses)
    speed = max(speeds, default=0.0)
    if (pace.known and not pace.printed) or speed <= _CREEPS:
        return
    line, key = axis.trial.line, (axis.place.address, axis.channel)
    ratio = max(line.measured.get(key, 0.0), speed * pace.unit / pace.velocity)
    line.measured[key] = ratio
    if _is_steady(speeds, pace.velocity):
        line.confirmed.add(key)
    if axis.pace.known:
        axis.pace = pace_of(axis.trial, axis.place, axis.channel)
    else:
        axis.pace = replace(axis.pace, measured=axis.pace.velocity * ratio)


def _speeds(statuses: Sequence[Status]) -> list[float]:
    """Return the speeds between successive statuses in counts/s."""
    pairs = [(one, other) for one, other in pairwise(statuses) if other.time - one.time >= POLL / 2]
    return [abs(other.position - one.position) / (other.time - one.time) for one, other in pairs]


def _is_steady(speeds: Sequence[float], velocity: float) -> bool:
    """Return whether a motion had a velocity for some time."""
    near = [abs(speed - velocity) <= _EXACT * velocity for speed in speeds]
    return any(all(near[at : at + _STEADY]) for at in range(len(near) - _STEADY + 1))
