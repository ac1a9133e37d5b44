"""Sets of parameters of every motor are signals, and part of the configuration in documents."""

from __future__ import annotations

from collections.abc import Iterator
from inspect import signature
from typing import Any

import bluesky.plans as bp
import pytest
from bluesky import RunEngine
from conftest import Documents
from lines import connected, run

from stagewire.errors import LimitError
from stagewire_apt import aio
from stagewire_apt.aio import BBD102, BBD301, BSC201, TDC001
from stagewire_bluesky import Controller, Motor, Parameters, Reference
from stagewire_virtual.factory import simulated_units


def motors() -> Iterator[Any]:
    """Yield the name and the parts of each controller with motors."""
    for name in aio.__all__:
        kind = getattr(aio, name)
        if name not in simulated_units() or hasattr(kind, "set_sol_state"):
            continue
        if name == "KIM001":
            continue  # its status reports a position, but not by the field of a KIM101
        controller = Controller(kind, f"virtual://{name}")
        for inside in ("bay", "channel"):
            if hasattr(kind, f"{inside}_class"):
                part = getattr(controller, inside)(1)
                if hasattr(part.kind, "move_absolute"):
                    yield pytest.param(part, id=name)
        if hasattr(kind, "move_absolute"):
            yield pytest.param(controller, id=name)


def sets_of(part: Reference) -> list[str]:
    """Return the sets of parameters of a part that need no argument."""
    return [
        name.removeprefix("get_")
        for name in dir(part.kind)
        if name.startswith("get_")
        and not any(
            one.default is one.empty and one.name != "self"
            for one in signature(getattr(part.kind, name)).parameters.values()
        )
    ]


@pytest.mark.parametrize("part", list(motors()))
def test_every_set_of_every_motor_can_be_part_of_the_configuration(
    part: Reference, plans: RunEngine, documents: Documents
) -> None:
    motor = Motor(part, "x", parameters=sets_of(part))
    with connected(motor):
        plans(bp.count([motor]))
    [descriptor] = documents.of("descriptor")
    configuration = descriptor["configuration"]["x"]
    assert configuration["data"].keys() == configuration["data_keys"].keys()
    assert part.kind.__name__.startswith("MPC") or any(
        "params-" in key for key in configuration["data"]
    )


def test_a_set_that_needs_an_argument_is_refused() -> None:
    with pytest.raises(TypeError, match="cannot be signals: a request for it requires bay_ident"):
        Parameters(Controller(BSC201, "virtual://BSC201"), "bay_used")
    with pytest.raises(TypeError, match="has no get_speed"):
        Parameters(Controller(BBD301, "virtual://BBD301"), "speed")


def test_a_set_with_a_reserved_name_has_an_underscore() -> None:
    motor = Motor(Controller(BSC201, "virtual://BSC201"), "x", parameters=["trigger"])
    assert isinstance(motor.trigger_, Parameters)  # type: ignore[attr-defined]


def test_a_number_without_a_scale_is_in_counts() -> None:
    motor = Motor(Controller(TDC001, "virtual://TDC001?stage=Z8", stage="Z8"), "t")
    with connected(motor):
        found = run(motor.describe_configuration)
    assert found["t-vel_params-acceleration"]["units"] == "counts"
    assert found["t-vel_params-max_velocity"]["units"] == "mm/s"


def test_setting_one_parameter_changes_it_and_no_other() -> None:
    x = Motor(Controller(BBD102, "virtual://BBD102?stage=MLS203", stage="MLS203").bay(1), "x")

    async def change() -> tuple[dict[str, Any], dict[str, Any]]:
        before = await x.read_configuration()
        await x.vel_params.max_velocity.set(50)  # type: ignore[attr-defined]
        return before, await x.read_configuration()

    with connected(x):
        before, after = run(change)
        with pytest.raises(LimitError):
            run(lambda: x.vel_params.max_velocity.set(10_000))  # type: ignore[attr-defined]
    changed = {key for key in before if before[key]["value"] != after[key]["value"]}
    assert changed == {"x-vel_params-max_velocity"}
    assert round(after["x-vel_params-max_velocity"]["value"], 3) == 50
