"""Too much, too little, NaN and infinity: refused with 0 bytes on the wire, by every call of every unit."""

from __future__ import annotations

import math
import random
from collections.abc import Iterator
from typing import Any

import pytest
from proof_calls import (
    Call,
    arguments,
    calls,
    fields_of,
    givens,
    layouts,
    message_of,
    method,
    registry,
    units,
)
from proof_controller import Parrot
from proof_line import SIDES, Side, settled

from stagewire.errors import StagewireError, UnknownScaleError
from stagewire_apt import stages

TAKING = ("_set", "_change", "_tell", "_act", "_start", "_halt")
NO_NUMBERS = (math.nan, math.inf, -math.inf)
FAR_OUT = (10**12, -(10**12), 1e300, -1e300)


def options_of(unit: str) -> dict[str, Any]:
    """All that scales can need."""
    [facts] = [facts for facts in registry()["units"] if facts["name"] == unit]
    options: dict[str, Any] = {"identify": False, "on_close": "leave"}
    if facts["stages"]:
        options |= {"stage": getattr(stages, facts["stages"][0]), "travel_mm": 25}
    if facts["status"] == "piezo":
        options |= {"max_volts": 75, "max_travel_um": 100}
    return options


def in_units(call: Call, draw: random.Random) -> Iterator[tuple[str, dict[str, Any]]]:
    """The keywords in units, each with legal counts for all other values."""
    for given in givens(call):
        for way in given.ways:
            others = arguments(call, draw)
            del others[given.keyword]
            yield way[0] if isinstance(way, tuple) else way.keyword, others


def in_counts(
    call: Call, draw: random.Random
) -> Iterator[tuple[str, dict[str, Any], tuple[Any, ...]]]:
    """The keywords in counts, with what is just outside their range."""
    ranges = {field["name"]: field for field in fields_of(layouts()[message_of(call).__name__])}
    for given in givens(call):
        field = ranges[given.field]
        if field["kind"] == "integer":
            others = arguments(call, draw)
            del others[given.keyword]
            outside = (field["minimum"] - 1, field["maximum"] + 1, math.nan, math.inf, 0.5)
            yield given.keyword, others, outside


def taking(unit: str) -> list[Call]:
    return [call for call in calls(unit) if call.kind in TAKING]


@pytest.mark.parametrize("side", SIDES, ids=repr)
@pytest.mark.parametrize("unit", units())
def test_what_is_no_number_or_too_much_makes_no_byte(unit: str, side: Side) -> None:
    controller = Parrot(seed=5)
    draw = random.Random(unit)

    async def scenario(bench: Any) -> list[str]:
        wrong: list[str] = []
        async with bench.open(unit, **options_of(unit)) as device:
            controller.heard.clear()

            async def refused(call: Call, given: dict[str, Any]) -> None:
                try:
                    await settled(method(device, call)(**given))
                except StagewireError:
                    if controller.heard:
                        wrong.append(f"{call}({given}): {controller.names()}")
                except Exception as error:
                    wrong.append(f"{call}({given}): {error!r}")
                else:
                    wrong.append(f"{call}({given}) was taken: {controller.names()}")

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
def test_what_is_refused_there_is_refused_for_its_value(unit: str) -> None:
    """The same calls with 0 are taken, wherever the scale is known; and stages have known scales."""
    controller = Parrot(seed=6)
    draw = random.Random(unit)

    async def scenario(bench: Any) -> tuple[list[str], int]:
        unknown, taken = [], 0
        async with bench.open(unit, **options_of(unit)) as device:
            for call in taking(unit):
                if call.kind not in ("_set", "_change", "_tell"):
                    continue
                for keyword, others in in_units(call, draw):
                    try:
                        method(device, call)(**others, **{keyword: 0})
                        taken += 1
                    except UnknownScaleError:
                        unknown.append(f"{call}({keyword})")
        return unknown, taken

    unknown, taken = SIDES[0].run(controller, scenario)
    ways = sum(
        len(given.ways)
        for call in taking(unit)
        if call.kind in ("_set", "_change", "_tell")
        for given in givens(call)
    )
    assert taken + len(unknown) == ways
    assert taken >= ways / 2 or not options_of(unit).get("stage"), unknown
