"""Exact scales: rational factors, rounding to nearest, and unknown scales."""

from __future__ import annotations

from collections.abc import Callable
from decimal import Decimal
from fractions import Fraction
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from stagewire.errors import BadValueError, UnknownScaleError
from stagewire.quantities import Number, Scale, UnknownScale, exact, round_half_away
from stagewire_apt import stages


def test_conversions_use_the_exact_factor_not_the_printed_one() -> None:
    velocity = stages.MLS203.scale("velocity", "BBD102")
    assert isinstance(velocity, Scale)
    assert velocity.counts_per_unit == 20_000 * Fraction("102.4e-6") * 65_536
    assert velocity.printed == "134218"
    assert velocity.to_counts(99) == 13_287_555
    assert 134_218 * 99 - velocity.to_counts(99) == 27
    assert velocity.to_counts(100) == 0x00CCCCCD
    assert velocity.to_counts(25) == 0x00333333
    assert velocity.to_counts(200) == 26_843_546


def test_the_other_factors_follow_from_the_servo_cycle() -> None:
    cycle = Fraction("102.4e-6")
    for name, expected in {
        "position": Fraction(20_000),
        "acceleration": 20_000 * cycle**2 * 65_536,
        "jerk": 20_000 * cycle**3 * 65_536**2,
        "status_velocity": 20_000 * cycle,
    }.items():
        scale = stages.MLS203.scale(name, "BBD10x")
        assert isinstance(scale, Scale)
        assert scale.counts_per_unit == expected, name
    assert stages.Z8.scale("position", "TDC001").to_counts(1) == 512 * 67


def test_unknown_scales_are_refused() -> None:
    unknown = stages.Z8.scale("acceleration", "TDC001")
    assert isinstance(unknown, UnknownScale)
    with pytest.raises(UnknownScaleError, match="raw counts"):
        unknown.to_counts(1)
    with pytest.raises(UnknownScaleError, match="raw counts"):
        unknown.from_counts(1)
    with pytest.raises(UnknownScaleError, match="scale of jerk of Z8"):
        stages.Z8.scale("jerk", "TDC001")
    with pytest.raises(UnknownScaleError, match="MLS203 on TDC001"):
        stages.MLS203.scale("position", "TDC001")


@pytest.mark.parametrize(
    ("value", "rounded"),
    [("0.5", 1), ("-0.5", -1), ("0.49", 0), ("-0.49", 0), ("2.5", 3), ("-2.5", -3), ("-1.2", -1)],
)
def test_rounding_is_the_same_on_both_sides_of_zero(value: str, rounded: int) -> None:
    assert round_half_away(Fraction(value)) == rounded


def test_a_float_counts_as_its_shortest_decimal() -> None:
    assert exact(0.1) == Fraction(1, 10)
    assert exact(Decimal("0.1")) == exact("0.1") == Fraction(1, 10)
    for wrong in (float("nan"), float("inf"), -float("inf"), "five", "1/0", None):
        with pytest.raises(BadValueError):
            exact(wrong)  # type: ignore[arg-type]


@given(st.integers(-(2**31), 2**31 - 1), st.fractions(min_value="1/1000", max_value=10**9))
def test_counts_survive_a_round_trip_through_units(counts: int, factor: Fraction) -> None:
    scale = Scale(factor, "mm")
    assert scale.to_counts(scale.from_counts(counts)) == counts


@given(st.fractions(max_denominator=10**6), st.fractions(min_value="1/1000", max_value=10**6))
def test_a_conversion_is_never_off_by_more_than_half_a_count(
    value: Fraction, factor: Fraction
) -> None:
    counts = Scale(factor, "mm").to_counts(value)
    assert abs(counts - value * factor) <= Fraction(1, 2)
    assert Scale(factor, "mm").to_counts(-value) == -counts


def test_a_factor_can_be_given_in_both_directions() -> None:
    assert Scale.unit_per("us", 512, 5).to_counts("1024") == 10
    assert Scale.counts_per("percent", 32767, 100).from_counts(32767) == 100
    with pytest.raises(BadValueError):
        Scale(Fraction(0), "mm")


@pytest.mark.parametrize(
    "factor", [34554.96, "34554.96", Decimal("34554.96"), Fraction(863874, 25)]
)
def test_a_factor_can_be_any_number(factor: Number) -> None:
    assert Scale.counts_per("mm", factor).counts_per_unit == Fraction(863874, 25)
    assert Scale.unit_per("mm", factor).counts_per_unit == Fraction(25, 863874)
    assert Scale.counts_per("mm", factor, 2) == Scale.counts_per("mm", 863874, 50)


@pytest.mark.parametrize(
    ("over", "under"), [(0, 1), (1, 0), (-1, 1), ("x", 1), (True, 1), (1, 0.0)]
)
def test_a_factor_that_is_not_a_positive_number_is_refused(over: Any, under: Any) -> None:
    with pytest.raises(BadValueError):
        Scale.counts_per("mm", over, under)
    with pytest.raises(BadValueError):
        Scale.unit_per("mm", under, over)


@pytest.mark.parametrize("wrong", [True, None, "x", "1/0", float("inf"), [1]])
def test_a_value_that_is_not_a_number_is_refused(wrong: object) -> None:
    scale = Scale.counts_per("mm", 20000)
    for convert in (scale.to_counts, scale.from_counts):
        with pytest.raises(BadValueError):
            convert(wrong)  # type: ignore[operator]


@pytest.mark.parametrize("make", [Scale.counts_per, Scale.unit_per])
def test_a_scale_has_a_factor_a_unit_and_its_source(make: Callable[..., Scale]) -> None:
    scale = make("mm/s", 4, 3, printed="1.33", source="the crystal")
    factor = Fraction(4, 3) if make == Scale.counts_per else Fraction(3, 4)
    assert (scale.counts_per_unit, scale.unit) == (factor, "mm/s")
    assert (scale.printed, scale.source) == ("1.33", "the crystal")
    assert scale == make("mm/s", 4, 3)  # printed and source do not affect equality
    assert scale != make("mm", 4, 3)
    assert (make("mm", 4).printed, make("mm", 4).source) == ("", "")
    assert make("mm", 1) == Scale(Fraction(1), "mm")
    assert (Scale(Fraction(1), "mm").printed, Scale(Fraction(1), "mm").source) == ("", "")
    assert repr(scale) == f"<Scale {factor} counts per mm/s>"


def test_the_repr_of_a_stage_and_of_an_unknown_scale() -> None:
    assert repr(stages.Z8) == f"<Stage Z8: {stages.Z8.title}>"
    unknown = stages.Z8.scale("acceleration", "TDC001")
    assert isinstance(unknown, UnknownScale)
    assert repr(unknown) == f"<UnknownScale in {unknown.unit}: {unknown.reason}>"


@pytest.mark.parametrize(
    "number",
    ["1e99999999", "1E-99999999", "1e1000", "1e60", 10**60, -(10**5000), 1e61, "9" * 2000,
     Decimal("1e99999999"), Decimal("1e-99999999"), Fraction(10**61)],
    ids=lambda number: str(type(number).__name__),
)  # fmt: skip
def test_a_huge_number_is_refused_immediately(number: Any) -> None:
    with pytest.raises(BadValueError, match="the number is too large for any range"):
        exact(number)


@pytest.mark.parametrize("number", ["1e59", "1e-999", Decimal("1e-400"), 10**59, 1e-300])
def test_small_and_large_numbers_are_accepted(number: Any) -> None:
    assert exact(number) == Fraction(number) or isinstance(number, float)
