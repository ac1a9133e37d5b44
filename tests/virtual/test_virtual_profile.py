"""Trapezoids follow the closed formula: duration, peak velocity, and the position every 10 ms."""

from __future__ import annotations

import math
from collections.abc import Iterator
from fractions import Fraction

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from stagewire_virtual.clock import SECOND
from stagewire_virtual.profiles import Profile, run_on, stop, trapezoid

VELOCITIES = st.floats(10, 5e6)
ACCELERATIONS = st.floats(10, 5e7)
PLACES = st.integers(-(10**7), 10**7)
MILLISECONDS_10 = SECOND // 100
MOTION = settings(deadline=None, max_examples=40)


def rest_to_rest(distance: float, velocity: float, acceleration: float) -> tuple[float, float]:
    """Return peak velocity and duration by the textbook formula."""
    peak = min(velocity, math.sqrt(distance * acceleration))
    return peak, (distance / peak + peak / acceleration if distance else 0.0)


def position_at(seconds: float, distance: float, velocity: float, acceleration: float) -> float:
    """Return the position of a motion from rest to rest: four acceleration steps, integrated twice."""
    if not distance:
        return 0.0
    peak, top = Fraction(rest_to_rest(distance, velocity, acceleration)[0]), Fraction(acceleration)
    ramp = peak / top
    duration = Fraction(distance) / peak + ramp
    steps = ((Fraction(0), 1), (ramp, -1), (duration - ramp, -1), (duration, 1))
    time = Fraction(seconds)  # large squares cancel, so floats would be wrong by several counts
    return float(sum(sign * top / 2 * max(time - at, 0) ** 2 for at, sign in steps))


def moments(profile: Profile) -> Iterator[int]:
    """Return times every 10 ms of a profile, or about a hundred times of a long one."""
    assert profile.duration is not None
    step = MILLISECONDS_10 * max(1, profile.duration // MILLISECONDS_10 // 100)
    return iter(range(0, profile.duration + 2 * step, step))


def same_time(profile: Profile, seconds: float) -> bool:
    """Return whether a profile has this duration, within a nanosecond and the precision of floats."""
    assert profile.duration is not None
    return abs(profile.duration - seconds * SECOND) <= 1 + seconds * SECOND * 1e-11


@MOTION
@given(PLACES, PLACES, VELOCITIES, ACCELERATIONS)
@example(0, 0, 100.0, 100.0)
@example(0, 1, 5e6, 10.0)
@example(0, 10**7, 10.0, 5e7)
def test_a_move_from_rest_follows_the_closed_formula(
    begin: int, end: int, velocity: float, acceleration: float
) -> None:
    profile = trapezoid(begin, end, velocity=velocity, acceleration=acceleration)
    distance, direction = abs(end - begin), (1 if end > begin else -1)
    peak, duration = rest_to_rest(distance, velocity, acceleration)
    assert same_time(profile, duration)
    if distance:
        fastest = max(abs(profile.velocity(round(s.begin * SECOND))) for s in profile.segments)
        assert fastest == pytest.approx(peak, rel=1e-6, abs=acceleration * 2e-9)
    for time in moments(profile):
        expected = begin + direction * position_at(time / SECOND, distance, velocity, acceleration)
        assert abs(profile.position(time) - expected) < 1
    assert profile.position(profile.duration or 0) == end
    assert profile.velocity(profile.duration or 0) == 0


@MOTION
@given(st.integers(0, 10**6), st.floats(10, 1e5), st.floats(10, 1e6), st.floats(0, 1), st.data())
def test_a_move_in_motion_is_part_of_a_move_from_rest(
    spare: int, velocity: float, acceleration: float, share: float, data: st.DataObject
) -> None:
    """A motion at velocity v continues like one that began at rest v/a earlier, at a distance of v²/2a."""
    initial = share * velocity
    behind = initial**2 / (2 * acceleration)
    target = math.ceil(behind) + spare  # far enough to stop there
    mirror = data.draw(st.sampled_from((1, -1)))
    profile = trapezoid(
        0,
        mirror * target,
        velocity=velocity,
        acceleration=acceleration,
        initial_velocity=mirror * initial,
    )
    _, whole = rest_to_rest(target + behind, velocity, acceleration)
    assert same_time(profile, whole - initial / acceleration)
    for time in moments(profile):
        since = time / SECOND + initial / acceleration
        expected = position_at(since, target + behind, velocity, acceleration) - behind
        assert abs(mirror * profile.position(time) - expected) < 1


@MOTION
@given(st.integers(-(10**6), -1), VELOCITIES, st.floats(1000, 5e7), st.floats(0.01, 1))
def test_a_motion_that_cannot_stop_in_time_overshoots_and_returns(
    beyond: int, velocity: float, acceleration: float, share: float
) -> None:
    """This includes a motion away from the target, which stops first."""
    initial = share * velocity
    way = initial**2 / (2 * acceleration)
    target = math.floor(way) + beyond
    profile = trapezoid(
        0, target, velocity=velocity, acceleration=acceleration, initial_velocity=initial
    )
    _, back = rest_to_rest(way - target, velocity, acceleration)
    # Within a microsecond: the way back is a small difference of large numbers.
    assert profile.duration == pytest.approx((initial / acceleration + back) * SECOND, abs=1000)
    assert profile.position(round(initial / acceleration * SECOND)) == pytest.approx(way, abs=1)
    for time in moments(profile):
        since = time / SECOND - initial / acceleration
        if since >= 0:
            expected = way - position_at(since, way - target, velocity, acceleration)
        else:
            expected = way - acceleration / 2 * since**2
        assert abs(profile.position(time) - expected) < 1


def test_a_motion_that_is_too_fast_slows_down_to_the_top_velocity() -> None:
    profile = trapezoid(0, 10_000, velocity=100, acceleration=1000, initial_velocity=500)
    slowing = (500**2 - 100**2) / 2000
    assert profile.velocity(0) == 500
    assert profile.velocity(SECOND) == 100
    assert profile.position(SECOND) == pytest.approx(slowing + 0.6 * 100)
    assert same_time(profile, 0.4 + (10_000 - slowing - 5) / 100 + 0.1)
    assert profile.position(profile.duration or 0) == 10_000


@MOTION
@given(PLACES, st.floats(-1e6, 1e6), ACCELERATIONS)
def test_a_stop_takes_v_by_a_and_v_squared_by_2a(
    place: int, initial: float, acceleration: float
) -> None:
    profile = stop(place, acceleration=acceleration, initial_velocity=initial)
    assert same_time(profile, abs(initial) / acceleration)
    way = math.copysign(initial**2 / (2 * acceleration), initial)
    assert profile.end == pytest.approx(place + way, rel=1e-12, abs=1e-6)


@MOTION
@given(st.floats(-1e5, 1e5), st.floats(1, 1e5), st.sampled_from((1, -1)), ACCELERATIONS)
def test_a_motion_without_end_accelerates_and_keeps_its_velocity(
    initial: float, velocity: float, direction: int, acceleration: float
) -> None:
    profile = run_on(0, direction * velocity, acceleration=acceleration, initial_velocity=initial)
    assert profile.duration is None
    ramp = abs(direction * velocity - initial) / acceleration
    half = profile.velocity(round(ramp / 2 * SECOND))
    assert half == pytest.approx((direction * velocity + initial) / 2, abs=acceleration * 2e-9)
    late = round((ramp + 1) * SECOND)
    assert profile.velocity(late) == direction * velocity
    covered = profile.position(late + SECOND) - profile.position(late)
    assert covered == pytest.approx(direction * velocity, rel=1e-6)


@MOTION
@given(PLACES, PLACES, VELOCITIES, ACCELERATIONS, st.floats(0.01, 0.99))
def test_a_bound_is_reached_at_the_first_nanosecond_beyond_it(
    begin: int, end: int, velocity: float, acceleration: float, share: float
) -> None:
    profile = trapezoid(begin, end, velocity=velocity, acceleration=acceleration)
    direction = 1 if end > begin else -1
    bound = begin + share * (end - begin)
    time = profile.reaches(bound, direction)
    if begin == end:
        assert time is None
        return
    assert time is not None
    assert (profile.position(time) - bound) * direction >= -1e-6
    assert (profile.position(time - 1) - bound) * direction <= 1e-6
    assert profile.reaches(bound, -direction) is None
    assert profile.reaches(end + direction, direction) is None
    assert (
        profile.reaches(begin - direction, direction) == 0
    )  # it starts beyond the bound and moves on


def test_a_motion_without_end_reaches_a_bound_or_never_does() -> None:
    profile = run_on(0, 10, acceleration=100)
    time = profile.reaches(1000, 1)
    assert time is not None
    assert profile.position(time) == pytest.approx(1000, abs=1e-6)
    assert profile.reaches(-1, -1) is None
    assert run_on(0, 1e-9, acceleration=1).reaches(10**9, 1) is None  # after some 10^10 years


@pytest.mark.parametrize(("time", "expected"), [(0, 1000), (SECOND, 0), (SECOND * 7 // 2, -1000)])
def test_the_acceleration_has_a_sign(time: int, expected: float) -> None:
    profile = trapezoid(0, 1000, velocity=300, acceleration=1000)
    assert profile.acceleration(time) == expected
    assert profile.acceleration(profile.duration or 0) == 0
