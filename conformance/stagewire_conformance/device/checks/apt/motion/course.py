"""The recorded positions of a motion: its speed, its duration, and how far it went beyond its target.

All figures come from the positions in status messages and the times at which they arrived, so they need no
scale.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from stagewire_conformance.device.checks.apt.motion.axis import Status

_WINDOW: Final = 0.1
"""The minimum time in seconds between two positions from which a speed is calculated."""
_SURE: Final = 3
"""The number of successive speeds that show a trend."""
_STEADY: Final = 0.15
"""The relative difference of successive speeds up to which a motion is steady."""


@dataclass(frozen=True)
class Point:
    """A position at a time."""

    time: float
    position: int


def points_of(statuses: Sequence[Status]) -> list[Point]:
    """Return the positions of statuses, in order."""
    return [Point(status.time, status.position) for status in statuses]


def speeds(points: Sequence[Point]) -> list[float]:
    """Return the speeds in counts/s over successive windows; one over the whole motion if it was short."""
    found = []
    begin = 0
    for end in range(1, len(points)):
        while begin + 1 < end and points[end].time - points[begin + 1].time >= _WINDOW:
            begin += 1
        seconds = points[end].time - points[begin].time
        if seconds >= _WINDOW:
            found.append(abs(points[end].position - points[begin].position) / seconds)
    if not found and len(points) > 1:
        seconds = max(points[-1].time - points[0].time, 1e-3)
        found.append(abs(points[-1].position - points[0].position) / seconds)
    return found


def top_speed(points: Sequence[Point]) -> float:
    """Return the highest speed in counts/s; 0 without two positions."""
    return max(speeds(points), default=0.0)


def steady_speed(points: Sequence[Point]) -> float:
    """Return the average speed in counts/s over the middle half of a motion; 0 if it has no length.

    At a constant speed, it is more precise than the highest speed: the time is longer.
    """
    first, last = points[0].position, points[-1].position
    quarter = abs(last - first) / 4
    middle = [
        point
        for point in points
        if quarter <= abs(point.position - first) and quarter <= abs(point.position - last)
    ]
    if not middle:
        return 0.0
    seconds = max(middle[-1].time - middle[0].time, 1e-3)
    return abs(middle[-1].position - middle[0].position) / seconds


def plateau(points: Sequence[Point]) -> list[Point]:
    """Return the positions at the end of a motion from which on it had nine tenths of its highest speed."""
    fast = 0.9 * top_speed(points)
    for number in range(2, len(points) + 1):
        if top_speed(points[:number]) >= fast:
            return list(points[number - 1 :])
    return []


def is_speeding_up(points: Sequence[Point]) -> bool:
    """Return whether a motion certainly became faster until its last position."""
    last = speeds(points)[-_SURE:]
    return len(last) == _SURE and last[2] > last[1] > last[0] * (1 + _STEADY)


def until_steady(points: Sequence[Point]) -> int:
    """Return the distance after which a motion had nine tenths of its highest speed."""
    fast = plateau(points)
    return abs(fast[0].position - points[0].position) if fast else 0


def beyond(points: Sequence[Point], start: int, target: int) -> int:
    """Return the most counts by which a motion went beyond its target; negative if it did not reach it."""
    way = 1 if target >= start else -1
    return max(((point.position - target) * way for point in points), default=-abs(target - start))
