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

    def hint(self) -> str:
        """Return the hint of the only error."""
        with pytest.raises(SpecError) as caught:
            self.protocol()
        [diagnostic] = caught.value.diagnostics
        return diagnostic.cure


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
        (
            {"lists": {"TP1": {"messages": "POS_VELPARAMS"}}},
            "lists.TP1.messages: 'POS_VELPARAMS' must be a list, as in the protocol",
        ),
        (
            {"enumerations": {"channel": {"values": [4]}}},
            "enumerations.channel.values: [4] must be a mapping, as in the protocol",
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


def test_a_set_whose_messages_are_all_listed_cannot_be_added(fourth: Fourth) -> None:
    known = fourth.spec / "tiny" / "units.yaml"
    text = known.read_text(encoding="utf-8")
    members = "POS_GET_VELPARAMS, POS_REQ_VELPARAMS, POS_SET_VELPARAMS"
    assert text.count("messages: [POS_MOVE, POS_MOVED") == 1
    known.write_text(
        text.replace("messages: [POS_MOVE, POS_MOVED", f"messages: [{members}, POS_MOVE, POS_MOVED")
    )
    fourth.write({"lists": {"TP1": {"messages": ["POS_VELPARAMS"]}}})
    [found] = fourth.errors()
    assert found.endswith("SW063 lists.TP1.messages.0: POS_VELPARAMS is already in the list")


def test_an_entry_cannot_be_both_replaced_and_added_to(fourth: Fourth) -> None:
    lamp = {"id": 0x0201, "page": 2, "direction": "to_host", "summary": "Glows.", "header": {}}
    (fourth.folder / "messages").mkdir()
    (fourth.folder / "messages" / "extra.yaml").write_text(
        yaml.safe_dump({"chapter": "extra", "messages": {"LAMP": lamp}})
    )
    fourth.write({"messages": {"LAMP": {"note": "lost"}}}, overrides={"messages": ["LAMP"]})
    [found] = fourth.errors()
    assert found.endswith("SW063 messages.LAMP: the overlay also replaces this entry")
    assert fourth.hint() == "write the addition into the new entry"


def test_an_entry_with_its_additions_must_fit_the_schema(fourth: Fourth) -> None:
    fourth.write({"messages": {"POS_MOVE": {"colour": "red"}}})
    [found] = fourth.errors()
    assert "SW010 messages.POS_MOVE: unknown key colour" in found


def test_an_addition_that_an_entry_cannot_have_is_an_error_of_the_overlay(fourth: Fourth) -> None:
    for file, old, new in (
        ("units.yaml", "stages: [Slide]", "stages: [Slide, Other]"),
        ("stages.yaml", "stages:\n", "stages:\n  Other: {title: another, page: 3, like: Slide}\n"),
    ):
        path = fourth.spec / "tiny" / file
        text = path.read_text(encoding="utf-8")
        assert old in text
        path.write_text(text.replace(old, new), encoding="utf-8")
    scales = {"TP9": {"distance": {"counts_per_mm": 1}}}
    fourth.write({"stages": {"Other": {"controllers": scales}}})
    [found] = fourth.errors()
    assert "overlays/fourth/additions.yaml:2:3: SW010 stages.Other: a stage has either" in found


def test_an_addition_to_an_unknown_entry_is_refused(fourth: Fourth) -> None:
    fourth.write({"messages": {"POS_FLY": {"note": "away"}}})
    [found] = fourth.errors()
    assert found.endswith("SW061 the protocol does not define messages.POS_FLY")


@pytest.mark.parametrize(
    ("section", "name", "hint"),
    [
        ("messages", "POS_MUVE", "did you mean POS_MOVE or POS_MOVED or POS_ALIVE?"),
        (
            "messages",
            "POS_VELPARAMS",
            "POS_VELPARAMS is an entry of `parameter_sets`: name it there",
        ),
        (
            "messages",
            "POS_GET_VELPARAMS",
            "POS_GET_VELPARAMS belongs to the set POS_VELPARAMS: name that under `parameter_sets`",
        ),
        ("lists", "TP9", "TP9 is an entry of `controllers`: name it there"),
        ("messages", "QQQQ", "correct the name or the section, or remove it"),
    ],
)
def test_the_hint_for_an_unknown_entry_names_the_entry_that_was_meant(
    fourth: Fourth, section: str, name: str, hint: str
) -> None:
    fourth.write(withdraws={section: [name]})
    assert fourth.hint() == hint
    fourth.write({section: {name: {"note": "away"}}})
    assert fourth.hint() == hint


def test_the_hint_for_an_unknown_override_names_the_entry_that_was_meant(fourth: Fourth) -> None:
    fourth.write(overrides={"messages": ["LAMB"]})
    assert fourth.hint() == "define it, or remove it from `overrides`"
    (fourth.folder / "messages").mkdir()
    lamp = {"id": 0x0299, "page": 2, "direction": "to_host", "summary": "Glows.", "header": {}}
    chapter = {"chapter": "extra", "messages": {"LAMB": lamp}}
    (fourth.folder / "messages" / "extra.yaml").write_text(yaml.safe_dump(chapter))
    assert (
        fourth.hint()
        == "did you mean LAMP or LAMP_BROKEN? if it is new, remove it from `overrides`"
    )
    fourth.write(overrides={"messages": ["LAMBS"]})
    assert fourth.hint() == "did you mean LAMB?"


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


def test_a_registry_has_only_the_later_pages_of_its_overlays(fourth: Fourth) -> None:
    fourth.write()
    core = fourth.spec / "tiny" / "messages" / "core.yaml"
    text = core.read_text(encoding="utf-8")
    head = "  POS_ECHO:\n"
    assert head in text
    core.write_text(text.replace(head, f"{head}    later_pages: {{fourth: 4}}\n"), encoding="utf-8")
    for overlays, pages in ((["tiny/fourth"], {"fourth": 4}), ([], None)):
        files = render(check(fourth.spec, overlays=overlays, base=True))
        registry = json.loads(files["python/stagewire_tiny/registry.json"])
        [echo] = [m for m in registry["messages"] if m["name"] == "POS_ECHO"]
        assert echo.get("later_pages") == pages


def test_a_withdrawn_entry_has_no_additions(fourth: Fourth) -> None:
    fourth.write({"messages": {"POS_ECHO": {"note": "x"}}}, withdraws={"messages": ["POS_ECHO"]})
    [found] = fourth.errors()
    assert found.endswith("SW061 the overlay itself withdraws or renames messages.POS_ECHO")


@pytest.mark.parametrize("renames", [{"POS_ECHO": "POS_MOVE"}, {"POS_ECHO": "A", "POS_MOVE": "A"}])
def test_a_new_name_must_be_free(fourth: Fourth, renames: dict[str, str]) -> None:
    fourth.write(renames={"messages": {old: {"to": new} for old, new in renames.items()}})
    assert any("SW020" in error and "is defined twice" in error for error in fourth.errors())


def test_a_message_has_its_own_name_only_once(fourth: Fourth) -> None:
    fourth.write({"messages": {"POS_ECHO": {"also_named": {"POS_ECHO": "echo"}}}})
    assert any(error.endswith("SW020 POS_ECHO is defined twice") for error in fourth.errors())


# Several overlays


class Pair:
    """Two overlays of the small good spec; the first is on by default."""

    def __init__(self, spec: Path) -> None:
        self.spec = spec

    def write(self, name: str, additions: dict[str, Any], **head: Any) -> Path:
        folder = self.spec / "tiny" / "overlays" / name
        folder.mkdir(parents=True)
        text = yaml.safe_dump(HEAD | {"overlay": name} | head)
        (folder / "overlay.yaml").write_text(text)
        if additions:
            (folder / "additions.yaml").write_text(yaml.safe_dump(additions))
        return folder

    def found(self, *, base: bool = False) -> list[tuple[str, str, str]]:
        """Return the file, message and hint of each error of both together."""
        with pytest.raises(SpecError) as caught:
            check(self.spec, overlays=["tiny/mine"], base=base)
        return [
            (Path(d.place.file).parent.name, f"{d.code} {d.message}", d.cure)
            for d in caught.value.diagnostics
        ]


@pytest.fixture
def pair(spec: Path) -> Pair:
    return Pair(spec)


ONE_OF_THEM = (
    "apply only one of the two overlays (--base leaves out the default ones), or let one build on the other "
    "(`builds_on` in overlay.yaml)"
)


def test_an_addition_to_an_entry_that_another_overlay_withdraws_is_refused(pair: Pair) -> None:
    pair.write("later", {}, default=True, withdraws={"messages": ["POS_ECHO"]})
    pair.write("mine", {"messages": {"POS_ECHO": {"note": "x"}}})
    what = "SW061 the overlay later withdraws or renames messages.POS_ECHO"
    assert pair.found() == [("mine", what, ONE_OF_THEM)]
    check(pair.spec, overlays=["tiny/mine"], base=True)


def test_an_addition_to_an_entry_that_another_overlay_replaces_is_refused(pair: Pair) -> None:
    folder = pair.write("later", {}, default=True, overrides={"messages": ["LAMP"]})
    (folder / "messages").mkdir()
    lamp = {"id": 0x0201, "page": 2, "direction": "to_host", "summary": "Glows.", "header": {}}
    chapter = {"chapter": "extra", "messages": {"LAMP": lamp}}
    (folder / "messages" / "extra.yaml").write_text(yaml.safe_dump(chapter))
    pair.write("mine", {"messages": {"LAMP": {"note": "x"}}})
    what = "SW060 messages.LAMP: the overlay later replaces the entry that this would add to"
    assert pair.found() == [("mine", what, ONE_OF_THEM)]
    check(pair.spec, overlays=["tiny/mine"], base=True)


def test_the_hint_says_that_another_overlay_defines_an_entry(pair: Pair) -> None:
    folder = pair.write("later", {}, default=True)
    note = {"title": "Tiny newer rack", "like": "TP1", "source": "the fourth issue"}
    (folder / "units.yaml").write_text(yaml.safe_dump({"aliases": {"TP7": note}}))
    pair.write("mine", {"aliases": {"TP7": {"note": "x"}}})
    what = "SW061 the protocol does not define aliases.TP7"
    hint = "the overlay later defines it: to change it, write `builds_on: [later]`"
    assert pair.found() == [("mine", what, hint)]


@pytest.mark.parametrize("base", [False, True])
def test_overlays_with_the_same_error_are_reported_without_a_traceback(
    pair: Pair, base: bool
) -> None:
    """The error is at the same place of the protocol, and is reported once."""
    for name, default in (("later", True), ("mine", False)):
        pair.write(name, {}, default=default, withdraws={"stages": ["Slide"]})
    found = pair.found(base=base)
    assert len(found) == len(set(found))
    assert {what for _, what, _ in found} >= {"SW021 units.TP1: unknown stage Slide"}


def test_an_unknown_message_in_a_list_is_one_error(pair: Pair) -> None:
    """The other overlay has a similar message, so the hint would be another with both."""
    folder = pair.write("later", {}, default=True)
    (folder / "messages").mkdir()
    lamp = {"id": 0x0299, "page": 2, "direction": "to_host", "summary": "Glows.", "header": {}}
    chapter = {"chapter": "extra", "messages": {"POS_VELPARAN": lamp}}
    (folder / "messages" / "extra.yaml").write_text(yaml.safe_dump(chapter))
    pair.write("mine", {"lists": {"TP1": {"messages": ["POS_VELPARAM"]}}})
    [(folder, what, hint)] = pair.found()
    assert (folder, what) == ("mine", "SW021 lists.TP1: unknown message POS_VELPARAM")
    assert hint.startswith("did you mean POS_VELPARAMS")
