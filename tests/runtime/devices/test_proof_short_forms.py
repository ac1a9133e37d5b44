"""Short forms of calls, such as ``set_volts(volts)``, send the frames of their full calls."""

from __future__ import annotations

from typing import Any

import pytest
from proof_calls import Call, method, rating, short_forms, units
from proof_controller import Parrot
from proof_limits import FAR_OUT, NO_NUMBERS, fault_of, options_of
from proof_line import SIDES, Side, settled

from stagewire.errors import MotionTimeoutError, OutOfRangeError

VALUES = (0, 1, 10, 50)
UNITS = [unit for unit in units() if short_forms(unit)]

each_side = pytest.mark.parametrize("side", SIDES, ids=repr)
each_unit = pytest.mark.parametrize("unit", UNITS)


def raw_of(side: Side, call: Call, **given: Any) -> bytes:
    """Return the bytes that a call sends."""
    controller = Parrot(seed=8)

    async def scenario(bench: Any) -> None:
        async with bench.open(call.unit, **options_of(call.unit)) as device:
            controller.heard.clear()
            limit = {} if call.kind == "_start" else {"timeout": 1.0}
            try:
                await settled(method(device, call)(**given, **limit))
            except MotionTimeoutError:  # the controller reports no end
                assert call.kind == "_act"

    side.run(controller, scenario)
    return controller.raw


@each_side
@each_unit
def test_a_short_form_sends_the_frames_of_its_full_call(unit: str, side: Side) -> None:
    for short, full in short_forms(unit):
        sent = set()
        for value in VALUES:
            raw = raw_of(side, short, **{short.argument: value})
            assert raw == raw_of(side, full, **{short.keyword: value}), f"{short}({value})"
            sent.add(raw)
        assert b"" not in sent
        assert len(sent) > 1


@each_side
@each_unit
def test_a_short_form_refuses_invalid_numbers_before_anything_is_sent(
    unit: str, side: Side
) -> None:
    controller = Parrot(seed=9)

    async def scenario(bench: Any) -> list[str]:
        wrong: list[str] = []
        async with bench.open(unit, **options_of(unit)) as device:
            controller.heard.clear()
            for short, _ in short_forms(unit):
                for value in (*NO_NUMBERS, *FAR_OUT, None, "1V"):
                    given = {short.argument: value}
                    wrong += await fault_of(device, short, given, controller.names)
        return wrong

    assert side.run(controller, scenario) == []


@each_side
@pytest.mark.parametrize("unit", [unit for unit in UNITS if rating(unit)])
def test_a_short_form_refuses_a_voltage_above_the_rating(unit: str, side: Side) -> None:
    controller = Parrot(seed=10)

    async def scenario(bench: Any) -> list[str]:
        tried = []
        options = options_of(unit) | {"max_volts": 20}
        if "settings" in options:
            options["settings"] = {"maximum_volts": 75}
        async with bench.open(unit, **options) as device:
            controller.heard.clear()
            for short, _ in short_forms(unit):
                if short.keyword == "volts":
                    with pytest.raises(OutOfRangeError, match=r"20 V.*set by max_volts"):
                        await settled(method(device, short)(**{short.argument: 21}))
                    tried.append(short.name)
        return tried

    assert side.run(controller, scenario) == (["set_volts"] if "volts" in keywords(unit) else [])
    assert controller.names() == []


def keywords(unit: str) -> set[str]:
    return {short.keyword for short, _ in short_forms(unit)}


def test_the_short_forms_are_found() -> None:
    """Every method whose argument is not one of its message."""
    found = {short.name for unit in UNITS for short, _ in short_forms(unit)}
    assert found == {
        "move_steps", "move_to_steps", "set_position_um", "set_power_percent", "set_volts",
        "start_move_steps", "start_move_to_steps",
    }  # fmt: skip
