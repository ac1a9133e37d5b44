"""S-curves follow the closed formula: eight steps of the jerk, each integrated three times."""

from __future__ import annotations

from fractions import Fraction

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from motor_host import MotorHost

from stagewire_apt import messages as m
from stagewire_apt import stages
from stagewire_apt.enumerations import ProfileMode
from stagewire_virtual.clock import SECOND
from stagewire_virtual.profiles import s_curve


def ramp(velocity: float, acceleration: float, jerk: float) -> tuple[float, float]:
    """Return how long the acceleration rises and how long it stays constant on the way to a velocity."""
    if velocity * jerk >= acceleration**2:
        return acceleration / jerk, velocity / acceleration - acceleration / jerk
    return (velocity / jerk) ** 0.5, 0.0


def way(velocity: float, acceleration: float, jerk: float) -> float:
    """Return the distance covered on the way to a velocity and back to rest."""
    rise, stay = ramp(velocity, acceleration, jerk)
    return velocity * (2 * rise + stay)


def highest(distance: float, velocity: float, acceleration: float, jerk: float) -> float:
    """Return the highest velocity that a distance allows, found by bisection instead of a formula."""
    if way(velocity, acceleration, jerk) <= distance:
        return velocity
    low, high = 0.0, velocity
    for _ in range(200):
        middle = (low + high) / 2
        low, high = (middle, high) if way(middle, acceleration, jerk) <= distance else (low, middle)
    return low


class Expected:
    """The closed formula of a motion over a distance."""

    def __init__(self, distance: float, velocity: float, acceleration: float, jerk: float) -> None:
        # In fractions, because large cubes cancel in the sum.
        rise, stay = map(
            Fraction, ramp(highest(distance, velocity, acceleration, jerk), acceleration, jerk)
        )
        self.peak = Fraction(jerk) * rise * (rise + stay)
        up = (Fraction(0), rise, rise + stay, 2 * rise + stay)
        self.duration = up[3] + distance / self.peak
        steps = zip(up, (1, -1, -1, 1), strict=True)
        self.steps = [(at, sign) for at, sign in steps]
        self.steps += [(self.duration - at, -sign) for at, sign in self.steps]
        self.jerk = jerk

    def position(self, seconds: float) -> float:
        time = Fraction(seconds)
        cubes = (sign * (time - at) ** 3 for at, sign in self.steps if time > at)
        return float(sum(cubes) * Fraction(self.jerk) / 6)


@settings(deadline=None, max_examples=40)
@given(st.integers(1, 10**6), st.floats(100, 1e6), st.floats(100, 1e7), st.floats(100, 1e9))
@example(10**6, 1e5, 1e6, 1e8)  # reaches both
@example(10**6, 1e5, 1e7, 1e7)  # reaches the velocity only
@example(10**4, 1e6, 1e5, 1e8)  # reaches the acceleration only
@example(10**4, 1e6, 1e7, 1e6)  # reaches neither
def test_an_s_curve_follows_the_closed_formula(
    distance: int, velocity: float, acceleration: float, jerk: float
) -> None:
    expected = Expected(distance, velocity, acceleration, jerk)
    for direction in (1, -1):
        profile = s_curve(
            7, 7 + direction * distance, velocity=velocity, acceleration=acceleration, jerk=jerk
        )
        assert profile.duration is not None
        assert profile.duration == pytest.approx(float(expected.duration) * SECOND, rel=1e-9, abs=1)
        step = max(SECOND // 100, profile.duration // 50)
        for time in range(0, profile.duration, step):
            away = expected.position(time / SECOND)
            assert abs((profile.position(time) - 7) * direction - away) < 1
        top = max(abs(profile.velocity(round(s.begin * SECOND))) for s in profile.segments)
        assert top == pytest.approx(float(expected.peak), rel=1e-6, abs=1e-3)
        for segment in profile.segments:
            assert abs(segment.acceleration) <= acceleration * (1 + 1e-9)
            assert abs(segment.jerk) in (0, jerk)
        assert profile.position(profile.duration) == 7 + direction * distance
        assert profile.velocity(profile.duration) == 0


def test_a_move_of_zero_distance_takes_no_time() -> None:
    profile = s_curve(5, 5, velocity=1, acceleration=1, jerk=1)
    assert profile.duration == 0
    assert profile.position(0) == 5


def test_a_brushless_motor_moves_in_s_curves_in_that_mode() -> None:
    """A move of 10 mm with velocity, acceleration and jerk by the document's factors (page 14)."""
    host = MotorHost("BBD102", stage=stages.MLS203, position=200_000)
    scale = {name: stages.MLS203.scale(name, "BBD102") for name in ("velocity", "jerk")}
    host.say(m.MotSetVelParams(1, 0, 13744, scale["velocity"].to_counts(100)))
    host.say(m.MotSetPmdProfileModeParams(1, ProfileMode.S_CURVE, scale["jerk"].to_counts(10_000)))
    host.say(m.MotMoveRelative(1, 200_000))
    factor = stages.MLS203.scale("acceleration", "BBD102")
    expected = Expected(
        200_000,
        20_000 * float(scale["velocity"].from_counts(scale["velocity"].to_counts(100))),
        20_000 * float(factor.from_counts(13744)),
        20_000 * float(scale["jerk"].from_counts(scale["jerk"].to_counts(10_000))),
    )
    while host.now + SECOND // 100 < expected.duration * SECOND:
        host.wait(0.01)
        assert abs(host.position - expected.position(host.now / SECOND)) <= 1
    host.wait(1)
    [(when, message)] = host.said
    assert isinstance(message, m.MotMoveCompletedDc)
    assert when == pytest.approx(float(expected.duration) * SECOND, rel=1e-9, abs=1)
    assert message.position == 200_000


def test_a_new_target_during_an_s_curve_continues_at_its_velocity() -> None:
    """Page 69 has S-curves only from rest."""
    host = MotorHost("BBD102", stage=stages.MLS203, position=200_000)
    host.say(m.MotSetPmdProfileModeParams(1, ProfileMode.S_CURVE, 922_337))
    host.say(m.MotMoveRelative(1, 1_000_000))
    host.wait(0.3)
    before = host.velocity
    assert before > 100_000
    host.say(m.MotMoveRelative(1, 500_000))
    assert host.velocity == pytest.approx(before)
    host.wait(5)
    assert [type(message) for _, message in host.said] == [m.MotMoveCompletedDc]


def test_a_move_with_a_jerk_of_zero_is_refused() -> None:
    host = MotorHost("BBD102", answer_unsupported=True)
    host.say(m.MotSetPmdProfileModeParams(1, ProfileMode.S_CURVE, 0))
    host.say(m.MotMoveRelative(1, 1000))
    assert [type(message) for _, message in host.said] == [m.HwResponse]
    host.wait(10)
    assert host.position == 0
