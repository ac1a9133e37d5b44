"""``stagewire diff``: folders and revisions, text and JSON, exit codes and errors."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import TYPE_CHECKING, Any

import jsonschema
import pytest
from repositories import GOOD, commit, edit, make_repository

from checkout import ROOT, SMALL_SPECS

if TYPE_CHECKING:
    from conftest import Stagewire

OVERLAYS = SMALL_SPECS / "good_overlays" / "tiny" / "overlays"
EDITS = {
    "wire": ("messages/core.yaml", "at_rest: {bit: 1}", "at_rest: {bit: 2}"),
    "source": ("messages/core.yaml", "coil_bits", "winding_bits"),
    "doc": ("units.yaml", "Tiny coil", "A tiny coil"),
}
LONG = "An invention, for tests only."


@pytest.fixture
def old(tmp_path: Path) -> Path:
    return Path(shutil.copytree(GOOD, tmp_path / "old"))


@pytest.fixture
def new(tmp_path: Path) -> Path:
    return Path(shutil.copytree(GOOD, tmp_path / "new"))


def test_equal_specs_have_no_changes(stagewire: Stagewire, old: Path, new: Path) -> None:
    result = stagewire("diff", old, new, "--fail-on", "doc")
    assert (result.code, result.out) == (0, "no changes\n")


def test_changes_are_printed_by_class(stagewire: Stagewire, old: Path, new: Path) -> None:
    for changes in EDITS.values():
        edit(new, *changes)
    result = stagewire("diff", old, new)
    assert result.code == 0
    assert result.out.splitlines() == [
        "WIRE: bytes change or become ambiguous",
        "  flags state_bits",
        "    bit-number: at_rest bit 1 -> 2; the same name refers to another bit",
        "SOURCE: generated names or types change",
        "  flags winding_bits",
        "    flags-renamed: coil_bits -> winding_bits; "
        "the flag table has another name; its bits are the same",
        "DOC: texts, pages, errata, examples",
        "  unit TP9",
        "    text: title Tiny coil -> A tiny coil",
        "3 changes: 1 WIRE, 1 SOURCE, 1 DOC",
    ]


def test_changes_of_the_protocol_and_additions_are_printed(
    stagewire: Stagewire, old: Path, new: Path
) -> None:
    edit(new, "protocol.yaml", "package: stagewire_tiny", "package: stagewire_minute")
    edit(new, "messages/core.yaml", "at_rest: {bit: 1}", "at_rest: {bit: 1}\n      stuck: {bit: 2}")
    result = stagewire("diff", old, new)
    assert result.out.splitlines()[1:] == [
        "  protocol tiny",
        "    package: package stagewire_tiny -> stagewire_minute; "
        "the Python package is imported under another name",
        "  flags state_bits",
        "    bit-added: stuck; a new name for a bit",
        "2 changes: 0 WIRE, 2 SOURCE, 0 DOC",
    ]


def test_long_texts_are_cut_where_they_differ(stagewire: Stagewire, old: Path, new: Path) -> None:
    edit(old, "protocol.yaml", LONG, "An invention. " * 20 + "One.")
    edit(new, "protocol.yaml", LONG, "An invention. " * 20 + "Two.")
    result = stagewire("diff", old, new)
    [line] = [line for line in result.out.splitlines() if "summary" in line]
    assert "One." in line
    assert "Two." in line
    assert len(line) < 160


def test_a_single_change_is_counted_in_the_singular(
    stagewire: Stagewire, old: Path, new: Path
) -> None:
    edit(new, *EDITS["doc"])
    assert stagewire("diff", old, new).out.endswith("\n1 change: 0 WIRE, 0 SOURCE, 1 DOC\n")


def test_several_protocols_are_distinguished(stagewire: Stagewire, old: Path, new: Path) -> None:
    for spec in (old, new):
        shutil.copytree(spec / "tiny", spec / "other")
        for name in ("examples", "captures", "protocol"):
            path = spec / "other" / f"{name}.yaml"
            text = path.read_text(encoding="utf-8").replace("protocol: tiny", "protocol: other")
            path.write_text(text.replace("stagewire_tiny", "stagewire_other"), encoding="utf-8")
    edit(new, *EDITS["doc"])
    edit(new, "../other/units.yaml", "Tiny coil", "Other coil")
    result = stagewire("diff", old, new)
    assert "  tiny: unit TP9" in result.out
    assert "  other: unit TP9" in result.out


def test_overlays_are_distinguished(stagewire: Stagewire, old: Path, new: Path) -> None:
    for spec in (old, new):
        shutil.copytree(OVERLAYS, spec / "tiny" / "overlays")
    edit(new, "overlays/second/units.yaml", "channels: 2", "channels: 1")
    edit(new, "overlays/second/overlay.yaml", "date: Winter", "date: Late winter")
    assert stagewire("diff", old, new).out.splitlines() == [
        "WIRE: bytes change or become ambiguous",
        "  tiny/second: unit TP9",
        "    unit-channels: channels 2 -> 1; the unit has other channels or bays",
        "DOC: texts, pages, errata, examples",
        "  overlay tiny/second",
        "    document: date Winter -> Late winter",
        "2 changes: 1 WIRE, 0 SOURCE, 1 DOC",
    ]
    shutil.rmtree(new / "tiny" / "overlays" / "third")
    edit(new, *EDITS["doc"])
    lines = stagewire("diff", old, new).out.splitlines()
    assert [line for line in lines if line.startswith("  ") and line[2] != " "] == [
        "  tiny: overlay third",
        "  tiny/second: unit TP9",
        "  tiny: unit TP9",
        "  overlay tiny/second",
    ]


def test_a_new_overlay_is_one_change(stagewire: Stagewire, old: Path, new: Path) -> None:
    shutil.copytree(OVERLAYS, new / "tiny" / "overlays")
    shutil.rmtree(new / "tiny" / "overlays" / "third")
    assert stagewire("diff", old, new).out.splitlines()[1:] == [
        "  overlay second",
        "    overlay-added; new names when the overlay is selected; otherwise nothing changes",
        "1 change: 0 WIRE, 1 SOURCE, 0 DOC",
    ]


def test_json_follows_its_schema(stagewire: Stagewire, old: Path, new: Path) -> None:
    for changes in EDITS.values():
        edit(new, *changes)
    result = stagewire("diff", old, new, "--json")
    assert result.code == 0
    data: Any = json.loads(result.out)
    schema = json.loads((ROOT / "spec/schema/changes.schema.json").read_text(encoding="utf-8"))
    problems = jsonschema.Draft202012Validator(schema).iter_errors(data)
    assert [f"{error.json_path}: {error.message}" for error in problems] == []
    assert data["counts"] == {"WIRE": 1, "SOURCE": 1, "DOC": 1}
    assert (data["old"], data["new"]) == (str(old), str(new))
    assert data["changes"][0] == {
        "class": "WIRE",
        "kind": "bit-number",
        "protocol": "tiny",
        "where": {"flags": "state_bits", "bit": "at_rest", "attribute": "bit"},
        "old": "1",
        "new": "2",
        "text": "the same name refers to another bit",
    }


@pytest.mark.parametrize("made", ["wire", "source", "doc"])
@pytest.mark.parametrize("limit", ["wire", "SOURCE", "doc"])
@pytest.mark.parametrize("output", [[], ["--json"]], ids=["text", "json"])
def test_fail_on_sets_the_exit_code(
    stagewire: Stagewire, old: Path, new: Path, made: str, limit: str, output: list[str]
) -> None:
    edit(new, *EDITS[made])
    order = ["doc", "source", "wire"]
    result = stagewire("diff", old, new, "--fail-on", limit, *output)
    assert result.code == (1 if order.index(made) >= order.index(limit.lower()) else 0)
    assert made.upper() in result.out


@pytest.mark.parametrize("side", ["OLD", "NEW"])
def test_a_side_with_errors_is_not_compared(
    stagewire: Stagewire, old: Path, new: Path, side: str
) -> None:
    wrong = old if side == "OLD" else new
    edit(wrong, "units.yaml", "units:\n", "units: 7\nunitz:\n")
    result = stagewire("diff", old, new, "--fail-on", "wire")
    assert result.code == 2
    assert result.out.startswith(f"{wrong}/tiny/units.yaml:")
    assert "hint: " in result.out
    assert f"{side} does not pass check, so nothing was compared" in result.err
    assert "change" not in result.out


# Revisions


@pytest.fixture
def repository(old: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a repository whose last commit has a WIRE change, as current folder."""
    return make_repository(tmp_path / "repository", old, EDITS["wire"], monkeypatch)


@pytest.mark.parametrize(
    ("arguments", "changes"),
    [
        (["HEAD~1", "HEAD"], "1 change: 1 WIRE"),
        (["HEAD", "HEAD~1"], "1 change: 1 WIRE"),
        (["HEAD~1", "spec"], "2 changes: 1 WIRE, 0 SOURCE, 1 DOC"),
        (["HEAD", "spec"], "1 change: 0 WIRE, 0 SOURCE, 1 DOC"),
        (["HEAD", "HEAD:spec/tiny", "--spec", "spec/tiny"], "no changes"),
        (["HEAD", "HEAD:spec"], "no changes"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_folders_and_revisions_can_be_compared(
    stagewire: Stagewire, repository: Path, arguments: list[str], changes: str
) -> None:
    edit(repository / "spec", *EDITS["doc"])
    result = stagewire("diff", *arguments)
    assert result.code == 0
    assert result.out.splitlines()[-1].startswith(changes)


def test_a_folder_takes_precedence_over_a_revision(stagewire: Stagewire, repository: Path) -> None:
    shutil.copytree("spec", "HEAD")
    edit(repository / "HEAD", *EDITS["doc"])
    assert "1 DOC" in stagewire("diff", "HEAD~0", "HEAD").out


def test_errors_in_a_revision_name_its_files(stagewire: Stagewire, repository: Path) -> None:
    edit(repository / "spec", "units.yaml", "units:\n", "units: 7\nunitz:\n")
    commit()
    result = stagewire("diff", "HEAD", "HEAD~1")
    assert result.code == 2
    assert result.out.startswith("HEAD:spec/tiny/units.yaml:")
    assert "HEAD: 2 errors\nOLD does not pass check" in result.err
    assert "with the rules of this version of Stagewire" in result.err


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (
            ["nowhere", "HEAD"],
            "OLD (nowhere) is neither a folder nor a readable revision: ",
        ),
        (
            ["HEAD", "nowhere"],
            "NEW (nowhere) is neither a folder nor a readable revision: ",
        ),
        (["HEAD", "HEAD:nowhere"], "the revision HEAD has no directory nowhere"),
        (["HEAD", "HEAD~1", "--spec", "nowhere"], "the revision HEAD has no directory nowhere"),
        (["HEAD", "HEAD~1", "--spec", " "], "the folder of --spec is empty"),
        (["--", "--help", "HEAD"], "is not a revision"),
        (["--", "HEAD", "-x"], "is not a revision"),
        (["", "HEAD"], "the name of OLD is empty"),
        (["HEAD", " "], "the name of NEW is empty"),
        (["HEAD"], "Missing argument 'NEW'"),
        (["HEAD", "HEAD", "--fail-on", "all"], "'all' is not one of"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_wrong_arguments_are_refused(
    stagewire: Stagewire, repository: Path, arguments: list[str], said: str
) -> None:
    result = stagewire("diff", *arguments)
    assert (result.code, result.out) == (2, "")
    assert said in result.err


def test_a_revision_outside_a_repository_is_refused(
    stagewire: Stagewire, repository: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(repository.parent)
    result = stagewire("diff", "HEAD", "old")
    assert result.code == 2
    assert "not in a git repository" in result.err


def test_the_spec_of_the_project_equals_itself(stagewire: Stagewire) -> None:
    assert stagewire("diff", ROOT / "spec", ROOT / "spec", "--fail-on", "doc").code == 0
