"""The frames of each call of each unit: set_… sends one frame, change_… a REQ and a SET, get_… a REQ."""

from __future__ import annotations

import random
from typing import Any

import pytest
from proof_calls import (
    Call,
    arguments,
    as_sent,
    calls,
    facts_of,
    givens,
    message_of,
    method,
    rating,
    registry,
    units,
)
from proof_controller import Parrot
from proof_line import SIDES, Side, settled

from stagewire import Frame
from stagewire_apt import TDC001

OPTIONS: dict[str, Any] = {"identify": False, "on_close": "leave"}
ONE_FRAME = ("_get", "_ask", "_set", "_tell")


def of_kind(unit: str, *kinds: str) -> list[Call]:
    return [call for call in calls(unit) if call.kind in kinds]


def fields_written(call: Call, given: dict[str, Any], frame: Frame) -> list[str]:
    """Return the fields of a frame that differ from the arguments."""
    by_keyword = {item.keyword: item.field for item in givens(call)}
    return [
        field
        for keyword, field in by_keyword.items()
        if keyword in given
        and getattr(frame.message, field) != as_sent(frame.message, field, given[keyword])
    ]


def checks_before(call: Call) -> list[type]:
    """Return the requests that a call sends before its message, such as that for the interlock of a laser."""
    needs = TDC001.facts.units[call.unit].needs.get(message_of(call), ())
    return [need.table.req for need in needs if need.each_time and call.kind in ("_set", "_tell")]


@pytest.mark.parametrize("side", SIDES, ids=repr)
@pytest.mark.parametrize("unit", units())
def test_a_call_sends_one_frame_with_its_arguments(unit: str, side: Side) -> None:
    controller = Parrot(seed=2)
    draw = random.Random(unit)

    async def scenario(bench: Any) -> list[str]:
        wrong = []
        async with bench.open(unit, **OPTIONS, **rating(unit)) as device:
            for call in of_kind(unit, *ONE_FRAME):
                if call.name.startswith("ack_"):  # sessions also send it
                    continue
                given = arguments(call, draw)
                controller.heard.clear()
                await settled(method(device, call)(**given))
                frames = list(controller.heard)
                expected = [*checks_before(call), message_of(call)]
                if [type(frame.message) for frame in frames] != expected:
                    wrong.append(f"{call}: {controller.names()}")
                elif fields_written(call, given, frames[-1]):
                    wrong.append(f"{call}: {given}, {frames}")
        return wrong

    assert side.run(controller, scenario) == []


@pytest.mark.parametrize("side", SIDES, ids=repr)
@pytest.mark.parametrize("unit", units())
def test_a_change_sends_one_request_and_one_set(unit: str, side: Side) -> None:
    """All other values are written back unchanged."""
    controller = Parrot(seed=3)
    draw = random.Random(unit)

    async def scenario(bench: Any) -> list[str]:
        wrong = []
        async with bench.open(unit, **OPTIONS, **rating(unit)) as device:
            for call in of_kind(unit, "_change"):
                given = arguments(call, draw)
                which = {item.keyword: given[item.keyword] for item in call.table.asked}
                keyword = draw.choice(sorted(given.keys() - which))
                controller.renew()
                controller.heard.clear()
                await settled(method(device, call)(**which, **{keyword: given[keyword]}))
                classes = [type(frame.message) for frame in controller.heard]
                if classes != [call.table.req, call.table.set]:
                    wrong.append(f"{call}: {controller.names()}")
                    continue
                asked, written = controller.heard
                reply = controller.reply(asked)
                assert reply is not None
                kept = {item.field: item.keyword for item in givens(call)}
                for field, its_keyword in kept.items():
                    changed = its_keyword == keyword or its_keyword in which
                    source = getattr(reply.message, field)
                    if changed:
                        source = as_sent(written.message, field, given[its_keyword])
                    if getattr(written.message, field) != source:
                        wrong.append(f"{call}: {field} of {written}, {reply}, {keyword}")
        return wrong

    assert side.run(controller, scenario) == []


@pytest.mark.parametrize("unit", units())
def test_every_set_message_of_a_unit_has_a_call(unit: str) -> None:
    """Each SET message of a unit has a set_… call, and also a change_… call if its set has a REQ message."""
    facts = facts_of(unit)
    unsent = {entry["name"] for entry in registry()["messages"] if "not_sent" in entry}
    alone = {entry["name"] for entry in registry()["messages"] if not entry.get("set")}
    sets = {name for name in facts["messages"] if "_SET_" in name} - unsent
    written = {
        (call.table.set if call.kind == "_set" else call.table.message).layout.message
        for call in of_kind(unit, "_set", "_tell")
    }
    assert {name for name in written if "_SET_" in name} == sets
    readable = {
        name for name in sets - alone if name.replace("_SET_", "_REQ_") in facts["messages"]
    }
    assert {call.table.set.layout.message for call in of_kind(unit, "_change")} == readable
