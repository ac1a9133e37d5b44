"""Overlays: replaced, added and unchanged entries, and how the output marks them.

``good_overlays`` has overlays for the good specs: one with an entry in every section, one whose document has
sections, and one for commands. ``test_later_issues`` tests the overlay of Thorlabs APT.
"""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jsonschema
import pytest

from files import write_files
from stagewire_generator import check, render
from stagewire_generator.change import compare
from stagewire_generator.diagnostics import SpecError
from stagewire_generator.model import Message, Protocol
from stagewire_generator.overlays.composition import SECTIONS
from stagewire_generator.pipeline import Counts, inputs
from stagewire_generator.reader import find_spec

HERE = Path(__file__).parent
SCHEMAS = HERE.parents[1] / "spec" / "schema"


@pytest.fixture
def spec(overlaid_spec: Path, tmp_path: Path) -> Path:
    """A copy of the good specs with their overlays."""
    return Path(shutil.copytree(overlaid_spec, tmp_path / "spec"))


@pytest.fixture(scope="module")
def second(overlaid: dict[str, Protocol]) -> Protocol:
    return overlaid["tiny/second"]


@pytest.fixture(scope="module")
def autumn(overlaid: dict[str, Protocol]) -> Protocol:
    return overlaid["turtle/autumn"]


def message(protocol: Protocol, name: str) -> Message:
    [found] = [message for message in protocol.messages if message.name == name]
    return found


def said(spec: Path, *overlays: str) -> list[str]:
    with pytest.raises(SpecError) as caught:
        check(spec, overlays=overlays)
    return [str(diagnostic).splitlines()[0] for diagnostic in caught.value.diagnostics]


def edit(path: Path, old: str, new: str) -> None:
    text = path.read_text(encoding="utf-8")
    assert text.count(old) == 1, old
    path.write_text(text.replace(old, new), encoding="utf-8")


# Without an overlay


def test_unselected_overlays_do_not_change_the_output(
    overlaid_spec: Path, files: dict[str, str], command_files: dict[str, str]
) -> None:
    tiny, turtle = check(overlaid_spec)
    assert render([tiny]) == files
    assert render([turtle]) == command_files


def test_a_check_covers_every_overlay(overlaid_spec: Path) -> None:
    progress: list[str] = []
    counts = check(overlaid_spec, progress.append).counts
    assert list(counts) == ["tiny", "tiny/second", "tiny/third", "turtle", "turtle/autumn"]
    assert counts["tiny/second"] == Counts(
        messages=16, layouts=19, fields=39, errata=3, not_compared=2, places=17, examples=2
    )
    assert counts["tiny/third"].places == 0  # it has no witness
    assert counts["turtle/autumn"].places > 50
    assert "tiny/second: witness and errata" in progress
    assert "tiny/overlays/second/printed/all.yaml" in progress


def test_overlays_of_an_invalid_protocol_are_not_checked(spec: Path) -> None:
    """They would only repeat the errors."""
    edit(spec / "tiny" / "messages" / "extra.yaml", "id: 0x0201", "id: 0x0123")
    shutil.rmtree(spec / "tiny" / "overlays" / "third" / "messages")
    wrong = said(spec)
    assert not [line for line in wrong if "overlays" in line]
    assert (
        "tiny/messages/core.yaml:120:3: SW030 POS_ALIVE and LAMP both have the id 0x0123" in wrong
    )


# Replaced and added entries


def test_the_overlays_of_these_tests_have_every_section(overlaid_spec: Path) -> None:
    """Each section has a replaced and an added entry, so that no section is forgotten."""
    import yaml

    overridden: set[str] = set()
    added: set[str] = set()
    for folder in overlaid_spec.glob("*/overlays/*"):
        head = yaml.safe_load((folder / "overlay.yaml").read_text(encoding="utf-8"))
        listed = {(s, n) for s, names in head["overrides"].items() for n in names}
        overridden |= {section for section, _ in listed}
        for path in folder.rglob("*.yaml"):
            if path.parent.name != "printed":
                data = yaml.safe_load(path.read_text(encoding="utf-8"))
                known = {s for sections in SECTIONS.values() for s in sections} & data.keys()
                added |= {s for s in known for n in data[s] if (s, n) not in listed}
    everything = {section for sections in SECTIONS.values() for section in sections}
    # The good specs have no entries in these sections.
    assert overridden == everything - {
        "sources",
        "evidence",
        "aliases",
        "hardware_types",
        "unsupported",
    }
    assert added == everything - {"addresses"}  # always the same four addresses
    schema = json.loads((SCHEMAS / "overlay.schema.json").read_text(encoding="utf-8"))
    assert set(schema["properties"]["overrides"]["properties"]) == everything


def test_entries_are_replaced_as_a_whole(second: Protocol) -> None:
    lamp = message(second, "LAMP_TEST")
    assert [(x.form, [f.name for f in x.all_fields]) for x in lamp.layouts] == [
        ("header", ["seconds"])
    ]
    assert message(second, "POS_GET_MODE").layouts[0].param2.enum.name == "tempo"  # type: ignore[union-attr]
    assert [x.form for x in message(second, "POS_ECHO").layouts] == ["data", "data:wide"]
    enumerations = {e.name: e for e in second.enumerations}
    assert [v.name for v in enumerations["channel"].values] == [
        "CHANNEL_1",
        "CHANNEL_2",
        "CHANNEL_3",
    ]
    assert [b.name for t in second.flags if t.name == "coil_bits" for b in t.bits] == [
        "warm",
        "cold",
    ]
    quantities = {q.name: q for q in second.quantities}
    assert quantities["interval"].factor.printed == "102"  # type: ignore[union-attr]
    stages = {s.name: s for s in second.stages}
    assert stages["Slide"].title == "a slide of twenty millimetres"
    assert stages["Slide"].scales["TPx"]["distance"].value == 10000  # type: ignore[union-attr]
    assert {c.name: c.units for c in second.controllers}["TP9"] == ("TP9", "TP11")
    assert second.units["units"]["TP9"]["family"] == "warm"
    assert "completes" not in second.units["lists"]["TP1"]
    assert second.units["addresses"]["bays"]["count"] == 2
    assert second.units["known_prefixes"]["73"]["unit"] == "TP4"
    assert second.contexts["status"]["values"] == ["servo", "coil", "piezo"]
    assert "note" in second.formats["dword"]
    assert {e.id: e.evidence for e in second.errata}[
        "tiny-move-length"
    ] == "The second edition says so."
    assert second.examples["examples"]["lamp-test"]["page"] == 3
    assert second.captures["captures"]["alive"]["dest"] == 0x21


def test_entries_are_added(second: Protocol) -> None:
    assert message(second, "AUX_SET_HEAT").set == ("AUX_HEAT", "set")  # the group is also new
    assert message(second, "AUX_HEAT_STATE").layouts[0].length == 2
    assert {"tempo"} <= {e.name for e in second.enumerations}
    assert {"heat_bits"} <= {t.name for t in second.flags}
    [warm] = [t for t in second.flags if t.name == "warm_bits"]  # a subset of another table
    assert [(bit.name, bit.bit) for bit in warm.bits] == [("warm", 4)]
    assert {"warmth"} <= {q.name for q in second.quantities}
    assert {"Tower"} <= {s.name for s in second.stages}
    assert [c.name for c in second.chapters] == ["core", "extra", "heat"]
    assert second.formats["qword"]["size"] == 8
    assert "mood" in second.contexts
    assert {"TP1", "TP2", "TP10"} <= second.units["units"].keys()
    assert second.units["hardware_types"]["7"]["title"] == "a tower"
    assert "heat" in second.captures["captures"]


def test_other_entries_are_unchanged(second: Protocol, protocol: Protocol) -> None:
    for name in ("POS_MOVE", "POS_ALIVE", "POS_SET_VELPARAMS", "LAMP"):
        mine, theirs = message(second, name), message(protocol, name)
        assert (mine.overlay, mine.summary, mine.pages) == ("", theirs.summary, theirs.pages)
    assert second.document == protocol.document
    assert second.framing == protocol.framing


def test_a_block_reaches_the_messages_that_use_it(second: Protocol) -> None:
    """The message belongs to the protocol, and its fields to the overlay."""
    moved = message(second, "POS_MOVED")
    assert moved.overlay == ""
    servo, coil = moved.layouts[1:]
    assert {field.overlay for field in servo.fields} == {"second"}
    assert {field.overlay for field in coil.fields} == {""}
    assert servo.fields[2].format.signed


def test_an_overlay_of_commands_replaces_and_adds_entries(autumn: Protocol) -> None:
    go_to, mood = message(autumn, "GO_TO"), message(autumn, "MOOD")
    assert (go_to.size, [f.name for f in go_to.layouts[0].fields]) == (3, ["place"])
    assert [f.name for f in mood.layouts[1].fields] == ["mood", "strength"]
    assert message(autumn, "TURN").overlay == "autumn"
    assert message(autumn, "STRETCH").kind == "setup"
    assert message(autumn, "SLEEP").summary == "Lets it sleep till spring."
    assert message(autumn, "WHERE").overlay == ""


def test_several_overlays_are_applied_in_order(overlaid_spec: Path) -> None:
    both, _ = check(overlaid_spec, overlays=["tiny/third", "tiny/second"])
    assert [overlay.name for overlay in both.overlays] == ["third", "second"]
    assert message(both, "LAMP").overlay == "third"
    assert message(both, "LAMP_TEST").overlay == "second"


def test_two_overlays_cannot_define_the_same_entry(spec: Path) -> None:
    folder = spec / "tiny" / "overlays"
    shutil.copyfile(folder / "second" / "captures.yaml", folder / "third" / "captures.yaml")
    edit(
        folder / "third" / "overlay.yaml",
        "{messages: [LAMP]}",
        "{messages: [LAMP], captures: [alive]}",
    )
    edit(
        folder / "third" / "captures.yaml",
        "message: AUX_SET_HEAT\n    form: data\n    dest: 0x50\n    source: 0x01\n    fields: {warmth: 100}",
        "message: POS_MOVE\n    form: data\n    dest: 0x50\n    source: 0x01\n    fields: {}",
    )
    check(spec, overlays=["tiny/third"])
    assert said(spec, "tiny/second", "tiny/third") == [
        f"tiny/overlays/third/captures.yaml:{line} SW060 captures.{name} would replace the entry of the "
        "overlay second"
        for line, name in (("4:3:", "alive"), ("14:3:", "heat"))
    ]


# The witness and the errata


def test_the_document_of_the_protocol_is_compared_without_overlays(spec: Path) -> None:
    """An overlay that replaces an entry does not hide an error in the original."""
    edit(spec / "tiny" / "printed" / "extra.yaml", 'id: "0x0201"', 'id: "0x0211"')
    assert said(spec, "tiny/third") == [
        "tiny/printed/extra.yaml:5:5: SW040 heading/LAMP/id: the document has '0x0211', the registry '0x0201'"
    ]


@pytest.mark.parametrize(
    ("file", "old", "new", "wanted"),
    [
        (
            "printed/all.yaml",
            'heading: {page: 3, line: 2, id: "0x0122"}',
            'heading: {page: 4, line: 2, id: "0x0122"}',
            "printed/all.yaml:9:5: SW040 heading/POS_ECHO/page: the document has '4', the registry '3'",
        ),
        (
            "errata/core.yaml",
            "      heading/AUX_REQ_HEAT/id:",
            '      heading/AUX_SET_HEAT/id: ["0x0311", "0x0301"]\n      heading/AUX_REQ_HEAT/id:',
            "errata/core.yaml:12:3: SW042 tiny-heat-id: document and registry do not differ at "
            "heading/AUX_SET_HEAT/id",
        ),
        (
            "examples.yaml",
            "    errata: [tiny-move-length]\n",
            "",
            "errata/core.yaml:3:3: SW041 tiny-move-length names no place, and no worked example refers to it",
        ),
        (
            "printed/all.yaml",
            '  AUX_HEAT_STATE:\n    heading: {page: 4, line: 5, id: "0x0304"}\n',
            "",
            "messages/heat.yaml:17:3: SW043 AUX_HEAT_STATE does not occur in printed/",
        ),
        (
            "messages/heat.yaml",
            "page: 4\n    spelling: heat state",
            "page: 5\n    spelling: heat state",
            "messages/heat.yaml:19:5: SW039 messages.AUX_HEAT_STATE.page: page 5 does not exist "
            "(the last is 4)",
        ),
    ],
    ids=["difference", "agreement", "unsupported erratum", "not printed", "page"],
)
def test_the_document_of_an_overlay_is_compared(
    spec: Path, file: str, old: str, new: str, wanted: str
) -> None:
    edit(spec / "tiny" / "overlays" / "second" / file, old, new)
    assert f"tiny/overlays/second/{wanted}" in said(spec)


def test_an_erratum_of_the_protocol_does_not_apply_to_a_replaced_message(
    second: Protocol, protocol: Protocol
) -> None:
    assert message(protocol, "LAMP_TEST").errata == ("tiny-lamp-test",)
    assert message(second, "LAMP_TEST").errata == ()
    assert message(second, "LAMP_BROKEN").errata == ("tiny-lamp-test",)
    assert message(second, "AUX_REQ_HEAT").errata == ("tiny-heat-id",)


# Marks in the output


def test_the_registry_marks_the_entries_of_an_overlay(second: Protocol) -> None:
    registry = json.loads(render([second])["python/stagewire_tiny/registry.json"])
    [overlay] = registry["document"]["overlays"]
    assert (overlay["name"], overlay["document"]["issue"]) == ("second", "2")
    marked = {m["name"] for m in registry["messages"] if m.get("overlay") == "second"}
    assert marked == {
        "POS_REQ_MODE", "POS_GET_MODE", "POS_ECHO", "LAMP_TEST",
        "AUX_SET_HEAT", "AUX_REQ_HEAT", "AUX_GET_HEAT", "AUX_HEAT_STATE",
    }  # fmt: skip
    by_name = {m["name"]: m for m in registry["messages"]}
    fields = {f["name"]: f.get("overlay") for f in by_name["POS_MOVED"]["layouts"][1]["fields"]}
    assert set(fields.values()) == {"second"}
    assert "overlay" not in by_name["POS_MOVE"]
    for section, names in {
        "enumerations": {"channel", "tempo"},
        "flags": {"coil_bits", "heat_bits", "warm_bits"},
        "quantities": {"interval", "warmth"},
        "controllers": {"TP9", "TP10"},
        "families": {"plain", "warm"},
        "lists": {"TP1", "TP10"},
        "addresses": {"bays"},
        "aliases": {"TP3", "TP4", "TP5"},
        "known_prefixes": {"73", "74"},
        "unsupported": {"TP8"},
        "hardware_types": {"7"},
    }.items():
        assert {n for n, e in registry[section].items() if "overlay" in e} == names, section
    for section, key, names in (
        ("units", "name", {"TP9", "TP10"}),
        ("stages", "name", {"Slide", "Tower", "Turret"}),
        ("chapters", "name", {"heat"}),
        ("errata", "id", {"tiny-move-length", "tiny-heat-id"}),
    ):
        assert {e[key] for e in registry[section] if "overlay" in e} == names, section


@pytest.mark.parametrize("name", ["tiny/second", "tiny/third", "turtle/autumn"])
@pytest.mark.parametrize("kind", ["registry", "vectors"])
def test_the_json_matches_its_schema(overlaid: dict[str, Protocol], name: str, kind: str) -> None:
    files = render([overlaid[name]])
    schema = json.loads((SCHEMAS / f"{kind}.schema.json").read_text(encoding="utf-8"))
    [path] = [path for path in files if path.endswith(f"/{kind}.json")]
    data = json.loads(files[path])
    errors = jsonschema.Draft202012Validator(schema).iter_errors(data)
    assert [f"{e.json_path}: {e.message}" for e in errors] == []


def test_vectors_mark_the_entries_of_an_overlay(second: Protocol) -> None:
    vectors = json.loads(render([second])["python/stagewire_tiny/vectors.json"])
    assert {e["id"]: e.get("overlay") for e in vectors["captures"]} == {
        "alive": "second",
        "heat": "second",
    }
    assert {e["id"] for e in vectors["examples"] if "overlay" in e} == {"lamp-test", "move-length"}


def test_docstrings_name_the_document(overlaid: dict[str, Protocol]) -> None:
    second, third = (render([overlaid[f"tiny/{name}"]]) for name in ("second", "third"))
    core, package = (
        second["python/stagewire_tiny/messages/core.py"],
        second["python/stagewire_tiny/__init__.py"],
    )
    assert "Returns the received data." in core
    assert "16 bytes of data; Issue 2, page 3." in core
    assert "12 bytes" not in core
    assert "issue 1 of Spring." in package
    assert (
        "With the overlay ``second``: The second edition. Its document: The Tiny Positioner"
        in package
    )
    assert (
        "Values of ``channel`` (Issue 2, page 2)."
        in second["python/stagewire_tiny/enumerations.py"]
    )
    assert "Heating (Issue 2, page 4)." in second["python/stagewire_tiny/messages/heat.py"]
    assert "(Issue 2, page 1)" in second["python/stagewire_tiny/quantities.py"]
    stages = second["python/stagewire_tiny/stages.py"]
    assert "# Issue 2, page 2\nSlide = Stage(" in stages
    assert "Issue 3, section Bell." in third["python/stagewire_tiny/messages/extra.py"]


def test_with_several_documents_every_page_names_its_document(second: Protocol) -> None:
    files = render([second])
    registry = json.loads(files["python/stagewire_tiny/registry.json"])
    assert registry["document"]["name"] == "Issue 1"
    messages = {entry["name"]: entry for entry in registry["messages"]}
    assert messages["POS_MOVE"]["document"] == "Issue 1"
    assert messages["POS_ECHO"]["document"] == "Issue 2"
    units = {entry["name"]: entry["document"] for entry in registry["units"]}
    assert (units["TP1"], units["TP10"]) == ("Issue 1", "Issue 2")
    pages = re.compile(r"(.{0,12})\bpages? [0-9]")
    for path, text in files.items():
        if path.endswith((".py", ".h")) and "testing" not in path:
            flowed = " ".join(text.replace("*", "").split())
            alone = [
                found for found in pages.findall(flowed) if not re.search("Issue [12], $", found)
            ]
            assert alone == [], path


def test_every_target_carries_the_evidence(second: Protocol) -> None:
    files = render([second])
    registry = json.loads(files["python/stagewire_tiny/registry.json"])
    assert registry["sources"]["frames"]["text"] == "someone/tiny/frames.py, commit 0123abc"
    [echo] = [entry for entry in registry["messages"] if entry["name"] == "POS_ECHO"]
    shown = {"class": "hardware_frames", "source": "frames", "shows": "a frame of a TP10"}
    assert echo["evidence"] == [shown]
    [move] = [entry for entry in registry["messages"] if entry["name"] == "POS_MOVE"]
    assert "evidence" not in move
    said = "Evidence: hardware frames."
    for path in ("devices/units.py", "flags.py", "messages/core.py"):
        assert said in files[f"python/stagewire_tiny/{path}"], path
    assert (
        "# Issue 2, page 2; evidence: vendor program\nTurret"
        in (files["python/stagewire_tiny/stages.py"])
    )
    assert said in files["c/stagewire_tiny/messages/core.h"]
    assert "evidence: vendor program" in files["c/stagewire_tiny/quantities.h"]


def test_with_one_document_pages_do_not_name_it(spec: Path) -> None:
    [tiny] = [protocol for protocol in check(spec) if protocol.name == "tiny"]
    assert "Issue 1" not in "".join(render([tiny]).values())


def test_docstrings_of_commands_name_the_document(autumn: Protocol) -> None:
    walk = render([autumn])["python/stagewire_turtle/messages/walk.py"]
    assert "size 2; Issue 3, section Turn. Typed as" in walk


# The packages


def test_frames_follow_the_overlay(
    second: Protocol, tmp_path: Path, imported: Callable[[Path], Any]
) -> None:
    write_files(tmp_path, render([second]))
    tiny = imported(tmp_path)
    heat = tiny.decode(bytes.fromhex("01 03 02 00 D0 01 64 00"))
    assert heat.message == tiny.messages.AuxSetHeat(warmth=100)
    assert tiny.decode(bytes.fromhex("02 02 05 00 50 01")).message == tiny.messages.LampTest(
        seconds=5
    )
    wide = tiny.messages.PosEchoWide(label="a", blob=bytes(8), serial=1 << 40)
    assert tiny.decode(wide.pack(0x50, 0x01)).message == wide
    narrow = tiny.messages.PosEcho(label="a", blob=bytes(6), load=1)
    assert tiny.decode(narrow.pack(0x50, 0x01)).message == narrow
    back = tiny.messages.PosMovedServo(chan_ident=1, position=0, velocity=-1, status_bits=0)
    assert back.velocity == -1  # the first edition has no sign there


def test_frames_of_commands_follow_the_overlay(
    autumn: Protocol, tmp_path: Path, imported: Callable[[Path], Any]
) -> None:
    write_files(tmp_path, render([autumn]))
    turtle = imported(tmp_path).messages
    assert turtle.GoTo(place=-1).pack(0x01) == bytes.fromhex("01 47 03 FF FF FF 2E")
    assert turtle.MoodReply.unpack(b"Z\7") == turtle.MoodReply(mood=0x5A, strength=7)
    assert turtle.Turn(angle=-1).pack(0x02) == bytes.fromhex("02 54 02 FF FF 2E")
    sent = turtle.PROTOCOL.decode(bytes.fromhex("FE 54"))
    assert sent.message == turtle.Stretch()


# Changes


def test_a_comparison_shows_the_changes_of_an_overlay(
    protocol: Protocol, second: Protocol, overlaid_spec: Path
) -> None:
    third = check(overlaid_spec, overlays=["tiny/third"])[0]
    changes = compare([protocol], [third])
    assert [(c.kind, c.where) for c in changes if c.level.name != "DOC"] == [
        ("layout-length", {"message": "LAMP", "form": "data", "attribute": "length"}),
        ("field-removed", {"message": "LAMP", "form": "data", "field": "force"}),
        ("message-added", {"message": "BELL"}),
    ]
    assert ("document", None, "third") in {(c.kind, c.old, c.new) for c in changes}
    assert compare([third], [third]) == []
    assert ("document", "third", "second") in {
        (c.kind, c.old, c.new) for c in compare([third], [second])
    }


# Files


def test_inputs_include_the_files_of_overlays(overlaid_spec: Path) -> None:
    found = {
        path.relative_to(overlaid_spec).as_posix()
        for path in inputs([find_spec(overlaid_spec)])
        if path.is_relative_to(overlaid_spec)
    }
    assert {"tiny/overlays/second/overlay.yaml", "tiny/overlays/third/messages/extra.yaml"} <= found


def test_a_link_out_of_the_spec_is_refused(spec: Path, tmp_path: Path) -> None:
    secret = tmp_path / "secret.yaml"
    secret.write_text("quantities: {}\n", encoding="utf-8")
    (spec / "tiny" / "overlays" / "third" / "quantities.yaml").symlink_to(secret)
    assert said(spec) == [
        "tiny/overlays/third/quantities.yaml:1:1: SW008 the link leads out of the spec"
    ]


def test_a_folder_that_is_a_link_out_of_the_spec_is_refused(spec: Path, tmp_path: Path) -> None:
    """The files in it are not even listed."""
    elsewhere = shutil.copytree(spec / "tiny" / "overlays" / "third", tmp_path / "elsewhere")
    shutil.rmtree(spec / "tiny" / "overlays" / "third")
    (spec / "tiny" / "overlays" / "third").symlink_to(elsewhere)
    assert said(spec) == ["tiny/overlays/third:1:1: SW008 the link leads out of the spec"]


def test_shared_parts_of_the_schemas_are_the_same() -> None:
    """Our JSON Schemas do not refer to other files, so shared parts are copied."""
    overlay, protocol = (
        json.loads((SCHEMAS / f"{name}.schema.json").read_text(encoding="utf-8"))
        for name in ("overlay", "protocol")
    )
    for key in ("formats", "contexts", "groups"):
        assert overlay["properties"][key] == protocol["properties"][key]
    shape = {"properties", "required", "additionalProperties", "dependentSchemas"}
    mine, theirs = (x["properties"]["document"] for x in (overlay, protocol))
    assert {key: mine[key] for key in shape} == {key: theirs[key] for key in shape}
