"""Overlays that add to entries of their protocol, rename them and withdraw them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
import yaml

from stagewire_generator import check, render
from stagewire_generator.diagnostics import SpecError
from stagewire_generator.model import Message, Protocol

HEAD = {
    "overlay": "fourth",
    "title": "A fourth issue.",
    "summary": "Adds, renames and withdraws.",
    "document": {"title": "Tiny", "issue": "4", "date": "later", "pages": 40},
}


class Fourth:
    """An overlay of the small good spec."""

    def __init__(self, spec: Path) -> None:
        self.spec = spec
        self.folder = spec / "tiny" / "overlays" / "fourth"
        self.folder.mkdir(parents=True)

    def write(self, additions: dict[str, Any] | None = None, **head: Any) -> None:
        (self.folder / "overlay.yaml").write_text(yaml.safe_dump(HEAD | head))
        if additions is not None:
            (self.folder / "additions.yaml").write_text(yaml.safe_dump(additions))

    def protocol(self) -> Protocol:
        return next(iter(check(self.spec, overlays=["tiny/fourth"])))

    def errors(self) -> list[str]:
        with pytest.raises(SpecError) as caught:
            self.protocol()
        return [str(diagnostic).splitlines()[0] for diagnostic in caught.value.diagnostics]


@pytest.fixture
def fourth(spec: Path) -> Fourth:
    return Fourth(spec)


def message(protocol: Protocol, name: str) -> Message:
    [found] = [message for message in protocol.messages if message.name == name]
    return found


def test_an_addition_keeps_all_other_parts_of_the_entry(fourth: Fourth) -> None:
    fourth.write(
        {
            "enumerations": {"channel": {"values": {"CHANNEL_3": {"value": 4}}}},
            "lists": {"TP1": {"messages": ["POS_VELPARAMS"]}},
            "stages": {"Slide": {"controllers": {"TP9": {"share": {"unknown": "not tried"}}}}},
        }
    )
    protocol = fourth.protocol()
    [channel] = [e for e in protocol.enumerations if e.name == "channel"]
    assert [v.name for v in channel.values] == ["CHANNEL_1", "CHANNEL_2", "CHANNEL_3"]
    assert channel.summary == "Which axis."
    listed = protocol.units["lists"]["TP1"]["messages"]
    assert listed == [
        "POS_MOVE",
        "POS_MOVED",
        "POS_ALIVE",
        "POS_SET_VELPARAMS",
        "POS_REQ_VELPARAMS",
        "POS_GET_VELPARAMS",
    ]
    assert protocol.stages[0].scales["TP9"].keys() == {"distance", "speed", "share"}


def test_an_added_field_says_which_document_it_is_from(fourth: Fourth) -> None:
    wide = {"length": 2, "fields": {"chan_ident": {"format": "word", "page": 7}}}
    fourth.write({"messages": {"POS_MOVE": {"layouts": {"data_short": wide}}}})
    move = message(fourth.protocol(), "POS_MOVE")
    fields = {layout.form: layout.all_fields[0] for layout in move.layouts}
    assert move.overlay == fields["data"].overlay == ""
    assert fields["data:short"].overlay == "fourth"


@pytest.mark.parametrize(
    ("additions", "error"),
    [
        (
            {"enumerations": {"channel": {"page": 5}}},
            "enumerations.channel.page: the protocol has 4, the overlay 5",
        ),
        (
            {"enumerations": {"channel": {"page": 4}}},
            "enumerations.channel.page: the protocol has the same value",
        ),
        (
            {"lists": {"TP1": {"messages": ["POS_MOVE"]}}},
            "lists.TP1.messages.0: POS_MOVE is already in the list",
        ),
    ],
)
def test_an_addition_never_changes_an_entry(
    fourth: Fourth, additions: dict[str, Any], error: str
) -> None:
    fourth.write(additions)
    [found] = fourth.errors()
    assert "additions.yaml:" in found
    assert found.endswith(f"SW063 {error}")


def test_an_entry_with_its_additions_must_fit_the_schema(fourth: Fourth) -> None:
    fourth.write({"messages": {"POS_MOVE": {"colour": "red"}}})
    [found] = fourth.errors()
    assert "SW010 messages.POS_MOVE: unknown key colour" in found


def test_an_addition_to_an_unknown_entry_is_refused(fourth: Fourth) -> None:
    fourth.write({"messages": {"POS_FLY": {"note": "away"}}})
    [found] = fourth.errors()
    assert found.endswith("SW061 the protocol does not define messages.POS_FLY")


def test_a_withdrawn_message_is_in_no_list(fourth: Fourth) -> None:
    fourth.write(withdraws={"messages": ["POS_ECHO"]})
    protocol = fourth.protocol()
    assert "POS_ECHO" not in {m.name for m in protocol.messages}
    assert protocol.units["lists"]["TP1"]["completes"] == []


def test_a_withdrawn_entry_must_exist(fourth: Fourth) -> None:
    fourth.write(withdraws={"messages": ["POS_FLY"]})
    [found] = fourth.errors()
    assert found.endswith("SW061 the protocol does not define messages.POS_FLY")


def test_a_renamed_message_keeps_its_old_name_as_an_alias(fourth: Fourth) -> None:
    fourth.write(renames={"messages": {"POS_ECHO": {"to": "POS_REFLECT"}}})
    protocol = fourth.protocol()
    renamed = message(protocol, "POS_REFLECT")
    assert renamed.aliases == {"POS_ECHO": ("pos", "echo")}
    assert protocol.units["lists"]["TP1"]["completes"] == ["POS_REFLECT"]


def test_all_messages_of_a_renamed_set_are_renamed(fourth: Fourth) -> None:
    to = {"to": "POS_SPEEDPARAMS", "spelling": "speed params"}
    fourth.write(renames={"parameter_sets": {"POS_VELPARAMS": to}})
    protocol = fourth.protocol()
    assert message(protocol, "POS_GET_SPEEDPARAMS").class_name == "PosGetSpeedParams"
    stored = message(protocol, "POS_MOVE").exchange["stored"]
    assert stored["read"] == "POS_REQ_SPEEDPARAMS"
    aliases = {m.name: list(m.aliases) for m in protocol.messages if m.aliases}
    assert aliases == {
        f"POS_{role}_SPEEDPARAMS": [f"POS_{role}_VELPARAMS"] for role in ("SET", "REQ", "GET")
    }


def test_an_alias_must_be_a_new_name(fourth: Fourth) -> None:
    fourth.write({"messages": {"POS_ECHO": {"also_named": {"POS_MOVE": "move"}}}})
    assert any(error.endswith("SW020 POS_MOVE is defined twice") for error in fourth.errors())


def test_generated_python_has_the_other_names(fourth: Fourth) -> None:
    fourth.write({"messages": {"POS_ECHO": {"also_named": {"POS_REFLECT": "reflect"}}}})
    files = render([fourth.protocol()])
    core = files["python/stagewire_tiny/messages/core.py"]
    assert "\nPosReflect = PosEcho\n" in core
    registry = json.loads(files["python/stagewire_tiny/registry.json"])
    [echo] = [m for m in registry["messages"] if m["name"] == "POS_ECHO"]
    assert echo["aliases"] == ["POS_REFLECT"]
    assert (
        'aliases={"POS_REFLECT": "POS_ECHO"}' in files["python/stagewire_tiny/messages/__init__.py"]
    )


def test_generated_c_has_the_other_names(fourth: Fourth) -> None:
    fourth.write({"messages": {"POS_MOVE": {"also_named": {"POS_TRAVEL": "travel"}}}})
    core = render([fourth.protocol()])["c/stagewire_tiny/messages/core.h"]
    for name, meant in (
        ("TINY_POS_TRAVEL_ID", "TINY_POS_MOVE_ID"),
        ("tiny_pos_travel_header_encode", "tiny_pos_move_header_encode"),
        ("TINY_POS_TRAVEL_SIZE", "TINY_POS_MOVE_SIZE"),
    ):
        assert f"\n#define {name} {meant}\n" in core


def test_a_page_of_an_addition_is_a_page_of_the_later_document(fourth: Fourth) -> None:
    fourth.write({"messages": {"POS_ECHO": {"later_pages": {"fourth": 41}}}})
    [found] = fourth.errors()
    assert found.endswith(
        "SW039 messages.POS_ECHO.later_pages.fourth: page 41 does not exist (the last is 40)"
    )
    fourth.write({"messages": {"POS_ECHO": {"later_pages": {"fourth": 40}}}})
    echo = message(fourth.protocol(), "POS_ECHO")
    assert (echo.page_in(""), echo.page_in("fourth")) == (6, 40)


def test_a_withdrawn_entry_has_no_additions(fourth: Fourth) -> None:
    fourth.write({"messages": {"POS_ECHO": {"note": "x"}}}, withdraws={"messages": ["POS_ECHO"]})
    [found] = fourth.errors()
    assert found.endswith("SW061 the protocol does not define messages.POS_ECHO")


@pytest.mark.parametrize("renames", [{"POS_ECHO": "POS_MOVE"}, {"POS_ECHO": "A", "POS_MOVE": "A"}])
def test_a_new_name_must_be_free(fourth: Fourth, renames: dict[str, str]) -> None:
    fourth.write(renames={"messages": {old: {"to": new} for old, new in renames.items()}})
    assert any("SW020" in error and "is defined twice" in error for error in fourth.errors())


def test_a_message_has_its_own_name_only_once(fourth: Fourth) -> None:
    fourth.write({"messages": {"POS_ECHO": {"also_named": {"POS_ECHO": "echo"}}}})
    assert any(error.endswith("SW020 POS_ECHO is defined twice") for error in fourth.errors())
