"""An output approaches its target according to a formula, and never too fast."""

import itertools
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from stagewire_virtual.thorlabs_apt.piezo.drive import Approach

MS = 1_000_000

WAYS = [
    # start, target, ns per count, time constant, ms -> value
    (0, 1000, 0, 0, {0: 1000, 5: 1000}),
    (1000, -1000, 1e4, 0, {0: 1000, 5: 500, 10: 0, 20: -1000, 30: -1000}),
    (0, 1000, 0, 10 * MS, {0: 0, 10: 1000 * (1 - 1 / math.e), 1000: 1000}),
    # 100 counts/ms: ramp until 500 of 2000 counts are left, where the loop becomes slower
    (0, 2000, 1e4, 5 * MS, {0: 0, 10: 1000, 15: 1500, 20: 2000 - 500 / math.e, 500: 2000}),
    (0, -2000, 1e4, 5 * MS, {10: -1000, 15: -1500, 20: -2000 + 500 / math.e}),
    (0, 1000, 0, math.inf, {0: 0, 1e6: 0}),
    (0, 1000, 1e4, math.inf, {0: 0, 1e6: 0}),
    (5, 5, 1e4, 5 * MS, {0: 5, 1: 5}),
]


@pytest.mark.parametrize(("start", "target", "crossing", "settling", "values"), WAYS)
def test_a_value_follows_the_formula(start, target, crossing, settling, values):
    approach = Approach(start, target, 7 * MS, crossing, settling)
    for time, value in values.items():
        assert approach.at(round((7 + time) * MS)) == pytest.approx(value, abs=1e-6)


def test_the_ramp_ends_where_the_target_is_reached_or_the_loop_takes_over():
    assert Approach(0, 1000, 0, 1e4).ramp == 10 * MS
    assert Approach(0, 2000, 0, 1e4, 5 * MS).ramp == 15 * MS
    assert Approach(0, 1000).ramp == 0


@given(
    st.integers(-32768, 32767),
    st.integers(-32768, 32767),
    st.sampled_from([0.0, 10.0, 152.6, 30519.0]),
    st.sampled_from([0.0, 1.0 * MS, 8.7 * MS]),
)
def test_it_approaches_the_target_monotonically_and_never_too_fast(
    start, target, crossing, settling
):
    approach = Approach(start, target, 0, crossing, settling)
    step = MS // 4
    values = [start, *(approach.at(time) for time in range(0, 400 * step, step))]
    towards = 1 if target >= start else -1
    most = step / crossing if crossing else math.inf
    for before, after in itertools.pairwise(values):
        assert -1e-6 <= towards * (after - before) <= most + 1e-6
        assert towards * (target - after) >= -1e-6
