"""Every call of every unit refuses NaN, infinity and out-of-range values before anything is sent."""

from __future__ import annotations

import random
from typing import Any

import pytest
from proof_calls import (
    Call,
    arguments,
    calls,
    facts_of,
    givens,
    in_counts,
    in_units,
    method,
    units,
)
from proof_controller import Parrot
from proof_limits import FAR_OUT, NO_NUMBERS, fault_of, options_of
from proof_line import SIDES, Side, settled

from stagewire.errors import LimitError, OutOfRangeError, UnknownScaleError
from stagewire_apt import stages

TAKING = ("_set", "_change", "_tell", "_act", "_start", "_halt")
MODERATE = (0, 1, 10, 20, 100, 1000)


def taking(unit: str) -> list[Call]:
    return [call for call in calls(unit) if call.kind in TAKING]


@pytest.mark.parametrize("side", SIDES, ids=repr)
@pytest.mark.parametrize("unit", units())
def test_invalid_and_out_of_range_numbers_are_refused_before_anything_is_sent(
    unit: str, side: Side
) -> None:
    controller = Parrot(seed=5)
    draw = random.Random(unit)

    async def scenario(bench: Any) -> list[str]:
        wrong: list[str] = []
        async with bench.open(unit, **options_of(unit)) as device:
            controller.heard.clear()

            async def refused(call: Call, given: dict[str, Any]) -> None:
                wrong.extend(await fault_of(device, call, given, controller.names))

            for call in taking(unit):
                for keyword, others in in_units(call, draw):
                    for value in (*NO_NUMBERS, *FAR_OUT):
                        await refused(call, {**others, keyword: value})
                for keyword, others, outside in in_counts(call, draw):
                    for value in outside:
                        await refused(call, {**others, keyword: value})
        return wrong

    assert side.run(controller, scenario) == []


@pytest.mark.parametrize("unit", units())
def test_moderate_values_are_accepted(unit: str) -> None:
    """The same calls accept moderate values if the scale is known. Positions of stages have known scales."""
    controller = Parrot(seed=6)
    draw = random.Random(unit)
    writing = [call for call in taking(unit) if call.kind in ("_set", "_change", "_tell")]
    options = options_of(unit)
    rotary = "stage" in options and options["stage"].rotary

    async def scenario(bench: Any) -> tuple[list[str], list[str]]:
        unknown: list[str] = []
        refused: list[str] = []
        async with bench.open(unit, **options) as device:
            for call in writing:
                quantities = {given.keyword: given.quantity for given in givens(call)}
                for keyword, others in in_units(call, draw, rotary=rotary):
                    [missing] = quantities.keys() - others.keys()
                    for value in MODERATE:
                        try:
                            method(device, call)(**others, **{keyword: value})
                            break
                        except UnknownScaleError:
                            unknown.append(quantities[missing])
                            break
                        except OutOfRangeError:
                            continue
                    else:
                        refused.append(f"{call}({keyword})")
        return unknown, refused

    unknown, refused = SIDES[0].run(controller, scenario)
    assert refused == []
    assert "position" not in unknown or not facts_of(unit)["stages"]


MOVERS = [
    unit for unit in units()
    if facts_of(unit)["stages"] and not getattr(stages, facts_of(unit)["stages"][0]).rotary
]  # fmt: skip


@pytest.mark.parametrize("side", SIDES, ids=repr)
@pytest.mark.parametrize("unit", MOVERS)
def test_targets_outside_the_travel_are_refused_before_anything_is_sent(
    unit: str, side: Side
) -> None:
    """Every target of a move, sent or stored, is checked 0.001 mm outside a travel of 25 mm."""
    controller = Parrot(seed=7)
    draw = random.Random(unit)
    places = [
        (call, given)
        for call in taking(unit)
        for given in givens(call)
        if given.target == "absolute"
    ]
    assert {call.name for call, _ in places} >= {"move_absolute", "set_move_abs_params"}

    async def scenario(bench: Any) -> list[str]:
        wrong = []
        async with bench.open(unit, **options_of(unit), travel_mm=25) as device:
            for call, given in places:
                others = arguments(call, draw)
                others |= {other.keyword: 0 for _, other in places if other.keyword in others}
                del others[given.keyword]
                way = given.ways[0]
                for value in ("25.001", "-0.001"):
                    try:
                        await settled(method(device, call)(**others, **{way[0]: value}))
                    except LimitError:
                        if controller.heard:
                            wrong.append(f"{call}({value}): {controller.names()}")
                    else:
                        wrong.append(f"{call}({value}) was accepted")
        return wrong

    assert side.run(controller, scenario) == []
