"""Motion of limited jerk: seven segments, from rest to rest."""

from __future__ import annotations

import math

from stagewire_virtual.motion.profile import Profile
from stagewire_virtual.motion.route import Route

__all__ = ["s_curve"]


def s_curve(
    position: float, target: float, *, velocity: float, acceleration: float, jerk: float
) -> Profile:
    """Plan the way from rest to rest at ``target`` with an acceleration that changes by ``jerk`` only.

    Three segments to the top velocity, or to what the distance allows, one at it, three to rest.

    :param velocity: the top velocity, above zero.
    :param acceleration: the greatest acceleration, above zero; small changes of velocity do not reach it.
    :param jerk: the change of acceleration by time, above zero.
    """
    distance = abs(target - position)
    direction = math.copysign(1.0, target - position)
    route = Route(position)
    if distance:
        peak = min(velocity, _peak(distance, acceleration, jerk))
        # The jerk lasts until the top acceleration is reached, or for half of a ramp that never reaches it.
        rise = min(acceleration / jerk, math.sqrt(peak / jerk))
        top = jerk * rise
        constant = max(peak / top - rise, 0.0)
        cruise = max(distance / peak - (2 * rise + constant), 0.0)
        up, down = direction * jerk, -direction * jerk
        route.add(rise, 0.0, up)
        route.add(constant, direction * top)
        route.add(rise, direction * top, down)
        route.add(cruise)
        route.add(rise, 0.0, down)
        route.add(constant, -direction * top)
        route.add(rise, -direction * top, up)
    return route.profile(target)


def _peak(distance: float, acceleration: float, jerk: float) -> float:
    """Return the velocity that is reached over a distance when nothing else limits it.

    A ramp to v lasts v/a + a/j, and 2√(v/j) when it never reaches a, which is so below a²/j. Both ramps
    together cover v times the time of one.
    """
    knee = acceleration**2 / jerk
    peak = (math.sqrt(knee**2 + 4 * acceleration * distance) - knee) / 2
    return peak if peak >= knee else (distance**2 * jerk / 4) ** (1 / 3)
