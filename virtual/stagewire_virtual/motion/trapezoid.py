"""Motion of constant acceleration: to a target, on and on, and to a stop."""

from __future__ import annotations

import math

from stagewire_virtual.motion.profile import Profile
from stagewire_virtual.motion.route import Route

__all__ = ["run_on", "stop", "trapezoid"]


def trapezoid(
    position: float,
    target: float,
    *,
    velocity: float,
    acceleration: float,
    initial_velocity: float = 0.0,
) -> Profile:
    """Plan the way to ``target``, there to rest: accelerate, go on at the top velocity, decelerate.

    Whoever cannot stop in time goes beyond the target and comes back, whoever moves away stops first, and
    whoever is too fast slows down to the top velocity.

    :param velocity: the top velocity, above zero.
    :param acceleration: of speeding up and of slowing down, above zero.
    :param initial_velocity: at the beginning, with its sign.
    """
    route = Route(position, initial_velocity)
    beyond = target - _at_rest(route, acceleration)
    direction = math.copysign(1.0, beyond)
    if route.velocity * direction < 0 or not beyond:
        _brake(route, acceleration)
    distance = abs(target - route.position)
    if beyond and distance:
        first = abs(route.velocity)
        peak = math.sqrt(acceleration * distance + first**2 / 2)
        peak = min(max(peak, first), velocity)
        ramps = (abs(peak**2 - first**2) + peak**2) / (2 * acceleration)
        change = direction * (peak - first)  # downwards for who is too fast
        route.add(abs(change) / acceleration, math.copysign(acceleration, change))
        route.velocity = direction * peak
        route.add(max(distance - ramps, 0.0) / peak)
        route.add(peak / acceleration, -direction * acceleration)
    return route.profile(target)


def run_on(
    position: float, velocity: float, *, acceleration: float, initial_velocity: float = 0.0
) -> Profile:
    """Plan a motion that changes to ``velocity``, which has a sign, and goes on for ever."""
    route = Route(position, initial_velocity)
    if route.velocity * velocity < 0:
        _brake(route, acceleration)
    change = velocity - route.velocity
    route.add(abs(change) / acceleration, math.copysign(acceleration, change))
    route.velocity = velocity
    route.add(math.inf)
    return route.profile(None)


def stop(position: float, *, acceleration: float, initial_velocity: float) -> Profile:
    """Plan to slow down to rest."""
    route = Route(position, initial_velocity)
    _brake(route, acceleration)
    return route.profile(route.position)


def _at_rest(route: Route, acceleration: float) -> float:
    """Return where it would come to rest if it slowed down from now on."""
    way = route.velocity**2 / (2 * acceleration)
    return route.position + math.copysign(way, route.velocity)


def _brake(route: Route, acceleration: float) -> None:
    """Slow down, and stand."""
    duration = abs(route.velocity) / acceleration
    route.add(duration, -math.copysign(acceleration, route.velocity))
    route.velocity = 0.0
