"""Distances and stored targets outside the travel never start a motion, on every unit with a stage.

For a distance longer than the travel, nothing is sent. For other distances only the position is read, and for
stored values also the stored value.
"""

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
    message_of,
    method,
    part_of,
    raised,
    units,
)
from proof_controller import Parrot
from proof_line import SIDES, Side, settled

from stagewire.errors import LimitError
from stagewire_apt import stages
from stagewire_apt.enumerations import JogMode

MOVERS = [
    unit for unit in units()
    if facts_of(unit)["stages"] and not getattr(stages, facts_of(unit)["stages"][0]).rotary
]  # fmt: skip
TRAVEL = 25  # mm
STORED = {
    "move_absolute_stored": ("MOT_REQ_MOVEABSPARAMS", "absolute_position"),
    "move_relative_stored": ("MOT_REQ_MOVERELPARAMS", "relative_distance"),
    "jog": ("MOT_REQ_JOGPARAMS", "jog_step_size"),
}
STATUS = ("MOT_REQ_DCSTATUSUPDATE", "MOT_REQ_STATUSUPDATE")

CASES = {
    "move_absolute_stored": [
        ("12", "25.001", "refused"), ("12", "-0.001", "refused"), ("12", "25", "sent"), ("30", "0", "sent"),
    ],
    "move_relative_stored": [
        ("12", "25.001", "refused"), ("12", "-25.001", "refused"), ("24", "1.001", "refused"),
        ("1", "-1.001", "refused"), ("24", "-1.001", "sent"), ("1", "1.001", "sent"), ("24", "0.999", "sent"),
    ],
    "jog": [
        ("12", "25.001", "refused"), ("12", "-25.001", "refused"), ("12.5", "13", "refused"),
        ("12.5", "-13", "refused"), ("24", "2", "sent"), ("1", "2", "sent"), ("12.5", "12.4", "sent"),
    ],
}  # fmt: skip


class Standing(Parrot):
    """A controller with a given position and a given stored target.

    :ivar says: values of fields, in counts.
    """

    def __init__(self) -> None:
        super().__init__(seed=8)
        self.says: dict[str, int] = {}

    def state(self, cls: type, dest: int, channel: int, **asked: int) -> Any:
        message = super().state(cls, dest, channel, **asked)
        values = {name: getattr(message, name) for name in cls.layout.fields}  # type: ignore[attr-defined]
        return cls(**{name: self.says.get(name, value) for name, value in values.items()})


class Scene:
    """One unit with a travel of 25 mm, opened anew for each call."""

    def __init__(self, unit: str, side: Side) -> None:
        self._side = side
        self._draw = random.Random(unit)
        self._options = {
            "identify": False,
            "on_close": "leave",
            "stage": getattr(stages, facts_of(unit)["stages"][0]),
            **raised(unit),
            "travel_mm": TRAVEL,
        }
        self._unit = unit
        self.wrong: list[str] = []

    def tries(
        self,
        call: Call,
        expected: str,
        here: str = "0",
        stored: str = "0",
        mode: JogMode = JogMode.SINGLE_STEP,
        **given: str,
    ) -> None:
        """Make a call at the position ``here`` mm, and compare the sent messages with those expected.

        :param expected: the names of the requests, and ``sent`` or ``refused``.
        """
        far = Standing()

        async def scenario(bench: Any) -> str:
            async with bench.open(self._unit, **self._options) as device:
                scale = part_of(device, call.part).scales.of("position", "mm")
                far.says = {"position": scale.to_counts(here)}
                far.says |= {field: scale.to_counts(stored) for _, field in STORED.values()}
                far.says["jog_mode"] = mode
                far.heard.clear()
                try:
                    await settled(method(device, call)(**self._others(call, given), **given))
                except LimitError:
                    return "refused"
                return "sent"

        end = self._side.run(far, scenario)
        names = far.names()
        if end == "sent":
            sent = names.pop()
            end = "sent" if sent == message_of(call).layout.message else sent
        happened = " ".join([*("STATUS" if name in STATUS else name for name in names), end])
        if happened != expected:
            where = f"at {here} mm with {stored} mm stored"
            self.wrong.append(f"{call}({given}) {where}: {happened}, expected {expected}")

    def _others(self, call: Call, given: dict[str, str]) -> dict[str, Any]:
        """Return random arguments, except those given."""
        others = arguments(call, self._draw)
        for entry in givens(call):
            if not given.keys().isdisjoint(way[0] for way in entry.ways):
                del others[entry.keyword]
        return others


def distances(unit: str, kinds: tuple[str, ...]) -> list[tuple[Call, str]]:
    """Return the calls with a distance, with its keyword in mm."""
    return [
        (call, given.ways[0][0])
        for call in calls(unit)
        if call.kind in kinds
        for given in givens(call)
        if given.target == "relative"
    ]


@pytest.mark.parametrize("side", SIDES, ids=repr)
@pytest.mark.parametrize("unit", MOVERS)
def test_a_distance_outside_the_travel_is_refused(unit: str, side: Side) -> None:
    moves = distances(unit, ("_act", "_start"))
    assert {call.name for call, _ in moves} == {"move_relative", "start_move_relative"}

    scene = Scene(unit, side)
    for call, keyword in moves:
        for far_out in ("25.001", "-25.001"):
            scene.tries(call, "refused", "12", **{keyword: far_out})
        for here, distance in (("24", "1.001"), ("1", "-1.001"), ("30", "1"), ("-1", "-1")):
            scene.tries(call, "STATUS refused", here, **{keyword: distance})
        if call.kind == "_start":
            for here, distance in (("24", "0.999"), ("1", "-0.999"), ("30", "-6"), ("0", "25")):
                scene.tries(call, "STATUS sent", here, **{keyword: distance})
    assert scene.wrong == []


@pytest.mark.parametrize("side", SIDES, ids=repr)
@pytest.mark.parametrize("unit", MOVERS)
def test_a_distance_to_store_is_refused_if_it_is_longer_than_the_travel(
    unit: str, side: Side
) -> None:
    """Shorter distances are accepted, because the start of the later move is unknown."""
    stores = distances(unit, ("_set", "_change", "_tell"))
    assert {call.name for call, _ in stores} >= {"set_move_rel_params", "set_jog_params"}

    scene = Scene(unit, side)
    for call, keyword in stores:
        for far_out in ("25.001", "-25.001"):
            scene.tries(call, "refused", **{keyword: far_out})
        if call.kind == "_set":
            scene.tries(call, "sent", "24", **{keyword: "24.999"})
    assert scene.wrong == []


@pytest.mark.parametrize("side", SIDES, ids=repr)
@pytest.mark.parametrize("unit", MOVERS)
def test_a_stored_target_or_distance_outside_the_travel_is_refused(unit: str, side: Side) -> None:
    """A stored distance has a sign. A jog is refused only if both directions leave the travel."""
    by_name = {call.name: call for call in calls(unit)}

    scene = Scene(unit, side)
    for name, (asks, _) in STORED.items():
        for call in (by_name[name], by_name[f"start_{name}"]):
            for here, stored, expected in CASES[name]:
                if expected != "sent" or call.kind == "_start":
                    status = "STATUS " if name != "move_absolute_stored" else ""
                    status = status if abs(float(stored)) <= TRAVEL else ""
                    scene.tries(call, f"{asks} {status}{expected}", here, stored)
    scene.tries(
        by_name["start_jog"], "MOT_REQ_JOGPARAMS sent", "12", "30", mode=JogMode.CONTINUOUS
    )  # without a target
    assert scene.wrong == []
