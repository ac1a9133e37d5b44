"""Changes in overlays: each is reported once, with its overlay, and needs evidence from its own document."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import jsonschema
import pytest

import plain_yaml
from checkout import SCHEMAS
from stagewire_generator import check
from stagewire_generator.change import Change, Spec, compare_specs, unvouched
from stagewire_generator.change.changes import report

HERE = Path(__file__).parent
SCHEMA = json.loads((SCHEMAS / "changes.schema.json").read_text("utf-8"))

CASES = plain_yaml.read(HERE / "overlay_changes.yaml")
CHANGES, BOTH, EVIDENCE = CASES["changes"], CASES["both"], CASES["evidence"]
SECOND, THIRD = "tiny/overlays/second", "tiny/overlays/third"

Edit = dict[str, str]


@pytest.fixture(scope="module")
def old(overlaid_spec: Path) -> Spec:
    return load(overlaid_spec)


@pytest.fixture
def spec(overlaid_spec: Path, tmp_path: Path) -> Path:
    """A copy of the good specs with their overlays."""
    return Path(shutil.copytree(overlaid_spec, tmp_path / "spec"))


def load(spec: Path) -> Spec:
    return Spec.of(check(spec).checked)


def edited(spec: Path, *edits: Edit) -> Spec:
    """Return a spec after edits of its files."""
    for edit in edits:
        path = spec / edit["in"]
        text = path.read_text(encoding="utf-8") if edit["old"] else ""
        assert text.count(edit["old"]) == 1, edit
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text.replace(edit["old"], edit["new"]), encoding="utf-8")
    return load(spec)


def without(spec: Path, file: str, start: str, end: str = "") -> Edit:
    """Return the edit that removes a part of a file, up to another text or the end of the file."""
    text = (spec / file).read_text(encoding="utf-8")
    at = text.index(start)
    return {"in": file, "old": text[at : text.index(end, at) if end else None], "new": ""}


def told(changes: list[Change], *levels: str) -> list[tuple[str, str, str]]:
    """Return the owner, the kind and the changed thing of each change, in some classes or all."""
    found = [c for c in changes if c.level.name in levels or not levels]
    return [(c.title, c.kind, next(iter(c.where.values()), "")) for c in found]


def left(old: Spec, new: Spec) -> list[str]:
    """Return the changes on the wire without evidence."""
    return [str(d).splitlines()[0] for d in unvouched(compare_specs(old, new), old, new)]


# Reported changes


def test_equal_specs_have_no_changes(old: Spec, overlaid_spec: Path) -> None:
    assert compare_specs(old, load(overlaid_spec)) == []


@pytest.mark.parametrize("name", CHANGES)
def test_a_change_names_its_overlay(old: Spec, spec: Path, name: str) -> None:
    changes = compare_specs(old, edited(spec, *CHANGES[name]["edits"]))
    assert told(changes, "WIRE") == [tuple(change) for change in CHANGES[name]["wire"]]
    assert {change.protocol for change in changes} <= {"tiny", "turtle"}


def test_changes_of_several_overlays_are_reported(old: Spec, spec: Path) -> None:
    new = edited(spec, *CHANGES["unit"]["edits"], *CHANGES["layout"]["edits"])
    wire = CHANGES["unit"]["wire"] + CHANGES["layout"]["wire"]
    assert told(compare_specs(old, new), "WIRE") == [tuple(change) for change in wire]


def test_a_change_of_the_protocol_is_reported_once(old: Spec, spec: Path) -> None:
    """The second overlay leaves LAMP unchanged, and the third replaces it."""
    lamp = "id: 0x0201\n    page: 7\n    spelling: lamp\n    direction: "
    path = "tiny/messages/extra.yaml"
    new = edited(spec, {"in": path, "old": f"{lamp}to_controller", "new": f"{lamp}both"})
    assert told(compare_specs(old, new)) == [("tiny", "message-direction", "LAMP")]


@pytest.mark.parametrize("name", BOTH)
def test_the_same_change_in_an_overlay_is_also_reported(old: Spec, spec: Path, name: str) -> None:
    """The entry of the overlay was changed there, and needs evidence from its own document."""
    kind, thing = name.split(" of ")
    new = edited(spec, *BOTH[name])
    wire = told(compare_specs(old, new), "WIRE")
    assert wire == [("tiny", kind, thing), ("tiny/second", kind, thing)]
    assert len([line for line in left(old, new) if "in the overlay second" in line]) == 1


def test_a_value_that_protocol_and_overlay_lose_is_reported_for_both(old: Spec, spec: Path) -> None:
    """A removed value is located on the old side."""
    files = "tiny/messages/core.yaml", "tiny/printed/core.yaml", f"{SECOND}/messages/core.yaml"
    mine = without(spec, files[0], "\n      CHANNEL_2:", "\nflags")
    printed = without(spec, files[1], ', ["0x02", CHANNEL_2]', "]}")
    lost = ("tiny", "value-removed", "channel")
    assert told(compare_specs(old, edited(spec, mine, printed)), "SOURCE") == [lost]
    theirs = without(spec, files[2], ", CHANNEL_2: {value: 0x02}", ", CHANNEL_3")
    found = told(compare_specs(old, edited(spec, theirs)), "SOURCE")
    assert found == [lost, ("tiny/second", *lost[1:])]


def test_an_entry_that_protocol_and_overlay_lose_is_reported_for_both(
    old: Spec, spec: Path
) -> None:
    new = edited(
        spec,
        without(spec, "tiny/units.yaml", "known_prefixes:", "addresses:"),
        without(spec, f"{SECOND}/units.yaml", '  "73":', '  "74":'),
        without(spec, f"{SECOND}/overlay.yaml", "  known_prefixes:", "  enumerations:"),
    )
    lost = ("prefix-removed", "73")
    found = told(compare_specs(old, new), "SOURCE")
    assert found == [
        ("tiny", *lost),
        ("tiny", "alias-removed", "TP3"),
        ("tiny/second", *lost),
        ("tiny/second", "alias-removed", "TP4"),
    ]


def test_added_and_removed_overlays_are_reported(old: Spec, spec: Path) -> None:
    shutil.rmtree(spec / SECOND)
    less = load(spec)
    assert told(compare_specs(old, less), "WIRE") == [("tiny", "overlay-removed", "second")]
    assert told(compare_specs(less, old), "SOURCE") == [("tiny", "overlay-added", "second")]
    assert left(less, old) == []


def test_one_side_may_have_no_overlays(old: Spec, spec: Path) -> None:
    for folder in ("tiny", "turtle"):
        shutil.rmtree(spec / folder / "overlays")
    bare = load(spec)
    assert compare_specs(bare, bare) == []
    assert told(compare_specs(bare, old)) == [
        ("tiny", "overlay-added", "second"),
        ("tiny", "overlay-added", "third"),
        ("turtle", "overlay-added", "autumn"),
    ]


def test_a_removed_protocol_includes_its_overlays(old: Spec, spec: Path) -> None:
    shutil.rmtree(spec / "tiny")
    assert told(compare_specs(old, load(spec))) == [("tiny", "protocol-removed", "")]
    assert told(compare_specs(load(spec), old)) == [("tiny", "protocol-added", "")]


def test_overlays_of_a_renamed_protocol_are_compared(old: Spec, spec: Path) -> None:
    for path in spec.rglob("*.yaml"):
        text = path.read_text(encoding="utf-8")
        path.write_text(text.replace("protocol: tiny", "protocol: small"), encoding="utf-8")
    new = edited(spec, *CHANGES["message"]["edits"])
    assert told(compare_specs(old, new), "WIRE", "SOURCE") == [
        ("small/second", "field-range", "LAMP_TEST"),
        ("small", "protocol-renamed", ""),
    ]
    assert len(left(old, new)) == 1


def test_added_and_removed_overrides_are_reported(old: Spec, spec: Path) -> None:
    new = edited(
        spec,
        without(spec, f"{THIRD}/messages/extra.yaml", "  LAMP:", "  BELL:"),
        without(spec, f"{THIRD}/overlay.yaml", "overrides:"),
    )
    for one, other, kind in ((old, new, "field-added"), (new, old, "field-removed")):
        wire = told(compare_specs(one, other), "WIRE")
        assert wire == [("tiny/third", "layout-length", "LAMP"), ("tiny/third", kind, "LAMP")]
    assert left(new, old) == []  # the new entry has its own page
    places = [line.partition(" SW")[0] for line in left(old, new)]
    assert places == ["tiny/overlays/third/overlay.yaml:2:1:"] * 2


def test_pages_of_the_protocol_are_not_evidence_for_a_removed_override(
    old: Spec, spec: Path
) -> None:
    """They belong to another document, although the protocol with the overlay now refers to them."""
    new = edited(
        spec,
        without(spec, f"{SECOND}/units.yaml", "  TP9:", "  TP10:"),
        without(spec, f"{SECOND}/overlay.yaml", "  units:", "  lists:"),
        {"in": "tiny/units.yaml", "old": "coil, page: 3", "new": "coil, page: 7"},
    )
    assert [line.partition(":")[0] for line in left(old, new)] == [
        "tiny/overlays/second/overlay.yaml"
    ] * len(told(compare_specs(old, new), "WIRE"))


def test_json_names_the_overlay(old: Spec, spec: Path) -> None:
    lamp = {"in": "tiny/messages/extra.yaml", "old": "Switches the", "new": "Turns the"}
    new = edited(spec, *CHANGES["message"]["edits"], lamp)
    data = report("old", "new", compare_specs(old, new))
    problems = jsonschema.Draft202012Validator(SCHEMA).iter_errors(data)
    assert [f"{error.json_path}: {error.message}" for error in problems] == []
    inside, outside = data["changes"]
    assert (inside["protocol"], inside["overlay"]) == ("tiny", "second")
    assert outside["kind"] == "text"
    assert "overlay" not in outside


# Evidence


ERRATUM = """\
errata:
  {2}-more:
    pages: [1]
    subject: {1}
    messages: [{0}]
    printed: one thing
    encoded: another
    evidence: It is invented.
    class: meaning
    origin: document
"""
STATEMENT = """\
examples:
  more:
    page: 1
    line: 70
    kind: statement
    says: Something.
    means: Something else.
    claim: {{prose: true}}
    errata: [{0}-more]
"""


def erratum(on: str, folder: str, subject: str = "Something") -> list[Edit]:
    """Return the edits that add an erratum for a message, and the statement that supports it.

    :param folder: the folder of the protocol or of an overlay.
    """
    prefix = folder.partition("/")[0]
    return [
        {"in": f"{folder}/errata/more.yaml", "old": "", "new": ERRATUM.format(on, subject, prefix)},
        {"in": f"{folder}/examples.yaml", "old": "examples:\n", "new": STATEMENT.format(prefix)},
    ]


@pytest.mark.parametrize("case", EVIDENCE, ids=lambda case: case["name"].replace(" ", "-"))
def test_a_change_in_an_overlay_is_accepted_only_with_its_own_evidence(
    old: Spec, spec: Path, case: dict[str, Any]
) -> None:
    edits = [*CHANGES[case["change"]]["edits"], *case.get("with", ())]
    if "erratum" in case:
        edits += erratum(case["naming"], case["erratum"])
    assert (left(old, edited(spec, *edits)) == []) is case["vouched"]


def test_a_withdrawn_erratum_is_evidence(old: Spec, spec: Path) -> None:
    """The document of the overlay and the registry now agree."""
    ids = {"in": f"{SECOND}/messages/heat.yaml", "old": "req: 0x0302", "new": "req: 0x0312"}
    agreed = edited(spec, ids, without(spec, f"{SECOND}/errata/core.yaml", "  tiny-heat-id:"))
    wire = told(compare_specs(old, agreed), "WIRE")
    assert wire == [("tiny/second", "message-id", "AUX_REQ_HEAT")]
    assert left(old, agreed) == []


def test_an_erratum_removed_together_with_its_override_is_not_evidence(spec: Path) -> None:
    """The overlay no longer contains the message, so no agreement was found."""
    files = {name: f"{SECOND}/{name}.yaml" for name in ("overlay", "messages/core", "errata/more")}
    printed = f"{SECOND}/printed/all.yaml"
    entry, _ = erratum("LAMP_TEST", SECOND)
    entry["new"] += '    places:\n      heading/LAMP_TEST/id: ["0x0203", "0x0202"]\n'
    before = edited(spec, {"in": printed, "old": "0x0202", "new": "0x0203"}, entry)
    (spec / files["errata/more"]).unlink()
    after = edited(
        spec,
        without(spec, printed, "  LAMP_TEST:", "  AUX_SET_HEAT:"),
        without(spec, files["overlay"], "LAMP_TEST, ", "POS_ECHO"),
        without(spec, files["messages/core"], "  LAMP_TEST:"),
    )
    [line] = left(before, after)
    assert "LAMP_TEST header: layout-removed" in line


@pytest.mark.parametrize(
    ("edits", "vouched"),
    [
        ([], False),
        (erratum("POS_MOVE", "tiny"), False),
        (erratum("POS_MOVE", "tiny", "The overlay second"), True),
        (erratum("POS_MOVE", THIRD, "The overlay second"), False),
        ([{"in": "tiny/protocol.yaml", "old": 'issue: "1"', "new": 'issue: "2"'}], True),
    ],
    ids=["nothing", "another subject", "subject", "another overlay", "document"],
)
def test_removing_an_overlay_needs_evidence(
    old: Spec, spec: Path, edits: list[Edit], vouched: bool
) -> None:
    shutil.rmtree(spec / SECOND)
    if edits and THIRD in edits[0]["in"]:
        (spec / THIRD / "examples.yaml").write_text("protocol: tiny\nexamples:\n", encoding="utf-8")
    said = (
        "tiny/protocol.yaml:2:1: SW051 overlay second: overlay-removed, second -> nothing; "
        "no new erratum names overlay second in its subject"
    )
    assert left(old, edited(spec, *edits)) == ([] if vouched else [said])


def test_a_change_without_evidence_has_a_place_and_a_message(old: Spec, spec: Path) -> None:
    edits = [*CHANGES["message"]["edits"], *CHANGES["unit"]["edits"]]
    removed = without(spec, f"{THIRD}/messages/extra.yaml", "  BELL:")
    nothing = "no new or changed erratum, page, witness or example for it in the overlay second"
    assert left(old, edited(spec, *edits, removed)) == [
        "tiny/overlays/second/messages/core.yaml:46:14: SW050 LAMP_TEST header seconds: field-range, "
        f"0 to 255 -> 0 to 9; {nothing}",
        f"tiny/overlays/second/units.yaml:6:55: SW050 unit TP9 channels: unit-channels, 2 -> 1; {nothing}",
        "tiny/overlays/third/overlay.yaml:2:1: SW051 BELL: message-removed, BELL -> nothing; "
        "no new erratum in the overlay third names BELL in its subject",
    ]
