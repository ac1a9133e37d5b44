"""The framing table of the protocol agrees with the registry."""

from __future__ import annotations

from typing import Any

import pytest

from stagewire import End
from stagewire.framing import Event, Garbage, Received
from stagewire.protocols import Direction
from stagewire_apt import PROTOCOL

Json = dict[str, Any]
BY_ID: dict[int, Json] = {m["id"]: m for m in PROTOCOL.registry()["messages"] if m["id"]}
ALONE = [id for id, message in BY_ID.items() if "sub_message" not in message]
DIRECTIONS = {
    "to_host": Direction.TO_HOST,
    "to_controller": Direction.TO_CONTROLLER,
    "both": Direction.BOTH,
}


def test_every_message_with_an_id_is_in_the_table() -> None:
    assert PROTOCOL.framing.forms.keys() == BY_ID.keys()


def test_ids_of_sub_messages_are_shared() -> None:
    assert PROTOCOL.framing.shared == BY_ID.keys() - {*ALONE}


@pytest.mark.parametrize("id", ALONE, ids=lambda id: BY_ID[id]["name"])
def test_forms(id: int) -> None:
    message, forms = BY_ID[id], PROTOCOL.framing.forms[id]
    layouts = message["layouts"]
    headers = [layout for layout in layouts if layout["form"] == "header"]
    assert forms.name == message["name"]
    assert forms.direction is DIRECTIONS[message["direction"]]
    assert forms.header is bool(headers)
    counted = [layout for layout in layouts if "longest" in layout]
    known = [layout["length"] for layout in layouts if layout not in headers + counted]
    assert forms.lengths == set(known)
    found = forms.counted and (forms.counted.least, forms.counted.most)
    assert found == next(((each["length"], each["longest"]) for each in counted), None)
    assert forms.documented is bool(layouts)
    assert forms.only_zero_parameters is any(layout.get("only_zero") for layout in headers)


def test_addresses() -> None:
    addresses = PROTOCOL.registry()["addresses"]
    bays = range(addresses["bays"]["first"], addresses["bays"]["last"] + 1)
    assert PROTOCOL.framing.host == PROTOCOL.host == addresses["host"]["value"]
    assert PROTOCOL.framing.devices == PROTOCOL.devices
    names = ("motherboard", "generic_usb")
    assert {*(addresses[name]["value"] for name in names), *bays} == PROTOCOL.devices


@pytest.mark.parametrize(
    ("raw", "kind"), [("02 00 00 00 01 50", Received), ("02 00 00 01 01 50", Garbage)]
)
def test_a_disconnection_is_accepted_only_with_zero_parameters(raw: str, kind: type[Event]) -> None:
    framer = PROTOCOL.framer(End.HOST)
    events = framer.feed(bytes.fromhex(raw + "440401000150"))
    assert [type(event) for event in events] == [kind, Received]
