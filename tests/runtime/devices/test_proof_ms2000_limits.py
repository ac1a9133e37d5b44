"""Every call of an axis refuses NaN, infinity and out-of-range values before anything is sent."""

from __future__ import annotations

import math
import random
from fractions import Fraction
from typing import Any

import pytest
from proof_calls import Call, arguments, givens, in_counts, in_units, method
from proof_limits import FAR_OUT, NO_NUMBERS, fault_of
from proof_line import SIDES, Side, settled
from proof_ms2000 import NAME, UNITS, Axes, axis_calls, opened

from stagewire.errors import LimitError, MissingFieldError, StagewireError
from stagewire_ms2000 import messages as c

PER_UNIT = {"um": 10, "ms": 1, "um_per_s": 1}  # counts per unit in the document


def taking(unit: str) -> list[Call]:
    """Return the calls with an argument."""
    return [call for call in axis_calls(unit) if givens(call)]


def just_outside(call: Call, keyword: str) -> list[Fraction]:
    """Return the nearest values outside the range, in units."""
    [given] = [given for given in givens(call) if keyword in [way[0] for way in given.ways]]
    per_unit = PER_UNIT[keyword]
    return [
        Fraction(given.minimum - 1, per_unit),
        Fraction(given.maximum + 1, per_unit),
    ]


def test_the_limit_tests_cover_all_calls_with_an_argument() -> None:
    for unit in UNITS:
        assert {call.name for call in taking(unit)} == {
            "move_absolute",
            "start_move_absolute",
            "write_increment_value",
            "write_motor_position",
            "write_ramping_time",
            "write_top_speed",
            "write_vector_speed",
        }


@pytest.mark.parametrize("side", SIDES, ids=repr)
@pytest.mark.parametrize("unit", UNITS)
def test_invalid_and_out_of_range_numbers_are_refused_before_anything_is_sent(
    unit: str, side: Side
) -> None:
    far = Axes()
    draw = random.Random(unit)
    wrong: list[str] = []

    async def refused(device: Any, call: Call, given: dict[str, Any]) -> None:
        wrong.extend(await fault_of(device, call, given, lambda: far.raw.hex(" ")))
        far.forget()

    async def scenario(bench: Any) -> None:
        async with opened(bench, unit) as device:
            await settled(device.switch_to_low_level())
            far.forget()
            for call in taking(unit):
                for keyword, others in in_units(call, draw, NAME):
                    for value in (*NO_NUMBERS, *FAR_OUT, *just_outside(call, keyword), True, "x"):
                        await refused(device, call, {**others, keyword: value})
                for keyword, others, outside in in_counts(call, draw, NAME):
                    for value in (*outside, -math.inf, True, "1"):
                        await refused(device, call, {**others, keyword: value})

    side.run(far, scenario)
    assert wrong == []


@pytest.mark.parametrize("side", SIDES, ids=repr)
@pytest.mark.parametrize("unit", UNITS)
def test_a_missing_or_duplicate_value_is_refused_before_anything_is_sent(
    unit: str, side: Side
) -> None:
    far = Axes()
    draw = random.Random(unit)

    async def scenario(bench: Any) -> None:
        async with opened(bench, unit) as device:
            await settled(device.switch_to_low_level())
            far.forget()
            for call in taking(unit):
                with pytest.raises(MissingFieldError):
                    await settled(method(device, call)())
                for keyword, _ in in_units(call, draw, NAME):
                    both = {**arguments(call, draw, NAME), keyword: 1}
                    with pytest.raises(StagewireError, match="set the same value"):
                        await settled(method(device, call)(**both))
            assert far.raw == b""

    side.run(far, scenario)


@pytest.mark.parametrize("unit", UNITS)
def test_the_minimum_and_the_maximum_are_accepted(unit: str) -> None:
    far = Axes()

    async def scenario(bench: Any) -> None:
        async with opened(bench, unit) as device:
            device.switch_to_low_level()
            for call in taking(unit):
                [given] = givens(call)
                [way] = given.ways
                for counts in (given.minimum, given.maximum):
                    for keyword, value in [
                        (given.keyword, counts),
                        (way[0], Fraction(counts, PER_UNIT[way[0]])),
                    ]:
                        device.axis("X").stop()
                        far.forget()
                        method(device, call)(**{keyword: value})
                        sent = far.heard[0].message
                        assert getattr(sent, given.field) == counts, call
                        assert far.raw.startswith(far.heard[0].encode())

    SIDES[0].run(far, scenario)


@pytest.mark.parametrize("side", SIDES, ids=repr)
@pytest.mark.parametrize("unit", UNITS)
def test_nothing_moves_outside_the_travel(unit: str, side: Side) -> None:
    """The travel is 10 mm each way. Nothing is sent for arguments outside it; stored distances are read."""
    far = Axes()

    async def scenario(bench: Any) -> None:
        async with opened(bench, unit, travel_mm=(-10, 10)) as device:
            await settled(device.switch_to_low_level())
            far.forget()
            axis = device.axis("X")
            for call in (axis.move_absolute, axis.start_move_absolute):
                for given in ({"um": 10000.1}, {"um": -10000.1}, {"counts": 100001}):
                    with pytest.raises(LimitError):
                        await settled(call(**given))
            for distance in ("20000.1", "-20000.1"):
                with pytest.raises(LimitError):
                    await settled(axis.write_increment_value(um=distance))
            with pytest.raises(LimitError):
                await settled(axis.write_increment_value(increment=200001))
            assert far.raw == b""
            far.fix(c.ReadIncrementValueReply, increment=200001)
            for name in ("increment_move_up", "increment_move_down"):
                for call in (getattr(axis, name), getattr(axis, f"start_{name}")):
                    with pytest.raises(LimitError):
                        await settled(call())
                    assert far.names() == ["READ_INCREMENT_VALUE"]
                    far.forget()
            far.fix(c.ReadIncrementValueReply, increment=160000)
            far.fix(c.ReadMotorPositionAndStatusReply, position=0, status=0)
            with pytest.raises(
                LimitError, match=r"\+16 or -16 mm from the position 0 mm is outside"
            ):
                await settled(axis.increment_move_down())
            assert far.moves() == 0
            far.fix(c.ReadIncrementValueReply, increment=90000)
            await settled(axis.increment_move_up())
            assert far.moves() == 1

    side.run(far, scenario)
