"""``stagewire check --against``: folders and revisions, the evidence for changes, and exit codes."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from repositories import GOOD, commit, edit, git, make_repository

from checkout import ROOT, SMALL_SPECS

if TYPE_CHECKING:
    from conftest import Stagewire

OVERLAYS = SMALL_SPECS / "good_overlays" / "tiny" / "overlays"
WIRE = ("messages/core.yaml", "at_rest: {bit: 1}", "at_rest: {bit: 2}")
PAGE = (
    "messages/core.yaml",
    "page: 5\n    format: dword\n    summary",
    "page: 6\n    format: dword\n    summary",
)
DOC = ("units.yaml", "Tiny coil", "A tiny coil")


@pytest.fixture
def new(tmp_path: Path) -> Path:
    return Path(shutil.copytree(GOOD, tmp_path / "new"))


@pytest.fixture
def repository(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a repository with two commits, the last of which only rewords a text, as current folder."""
    return make_repository(tmp_path / "repository", GOOD, DOC, monkeypatch)


def test_an_unchanged_spec_passes(stagewire: Stagewire, new: Path) -> None:
    result = stagewire("check", new, "--against", GOOD)
    assert (result.code, result.err) == (0, "")
    assert result.out.splitlines()[-1] == f"against {GOOD}: ok; 0 changes: 0 WIRE, 0 SOURCE, 0 DOC"


def test_a_wire_change_without_evidence_is_an_error(stagewire: Stagewire, new: Path) -> None:
    edit(new, *WIRE)
    result = stagewire("check", new, "--against", GOOD)
    assert result.code == 1
    assert result.out == (
        f"{new}/tiny/messages/core.yaml:15:3: SW050 flags state_bits at_rest bit: bit-number, 1 -> 2; "
        "no new or changed erratum, page, witness or example for it\n"
        "    hint: add the page, witness or worked example that shows it, or an erratum with "
        "`flags state_bits` in its subject\n"
    )
    assert result.err == f"{new}: 1 error\n"


def test_a_wire_change_with_evidence_passes(stagewire: Stagewire, new: Path) -> None:
    edit(new, *WIRE)
    edit(new, *PAGE)
    result = stagewire("check", new, "--against", GOOD)
    assert result.code == 0
    assert result.out.endswith("ok; 2 changes: 1 WIRE, 0 SOURCE, 1 DOC\n")


def test_a_spec_with_errors_is_not_compared(stagewire: Stagewire, new: Path) -> None:
    edit(new, *WIRE)
    edit(new, "units.yaml", "units:\n", "units: 7\nunitz:\n")
    result = stagewire("check", new, "--against", "no such thing")
    assert result.code == 1
    assert "SW010" in result.out
    assert "SW050" not in result.out


@pytest.mark.parametrize("format", ["text", "json"])
def test_an_old_spec_with_errors_is_not_compared(
    stagewire: Stagewire, new: Path, format: str
) -> None:
    """If standard output is for programs, the errors go to standard error."""
    edit(new, "units.yaml", "units:\n", "units: 7\nunitz:\n")
    result = stagewire("check", GOOD, "--against", new, "--format", format)
    assert result.code == 2
    assert "tiny/units.yaml:" in (result.out if format == "text" else result.err)
    assert "--against does not pass check, so nothing was compared" in result.err
    assert format == "text" or result.out == ""


@pytest.mark.parametrize(
    ("folder", "arguments"),
    [
        (".", ["spec", "--against", "HEAD"]),
        (".", ["--against", "HEAD"]),
        (".", ["spec", "--against", "HEAD:spec"]),
        (".", ["spec/tiny", "--against", "HEAD"]),
        (".", ["./spec/", "--against", "HEAD~1"]),
        ("spec", [".", "--against", "HEAD"]),
        ("spec/tiny", [".", "--against", "HEAD"]),
        ("spec/tiny", ["../../spec", "--against", "HEAD"]),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else value,
)
def test_folders_and_revisions_can_be_compared(
    stagewire: Stagewire,
    repository: Path,
    monkeypatch: pytest.MonkeyPatch,
    folder: str,
    arguments: list[str],
) -> None:
    """From any current folder, SPEC is the same folder in the work tree and in the revision."""
    monkeypatch.chdir(repository / folder)
    assert stagewire("check", *arguments).code == 0
    edit(repository / "spec", *WIRE)
    result = stagewire("check", *arguments)
    assert result.code == 1
    assert "SW050 flags state_bits" in result.out
    edit(repository / "spec", *PAGE)
    assert stagewire("check", *arguments).code == 0


def test_a_spec_can_be_named_by_its_absolute_path(stagewire: Stagewire, repository: Path) -> None:
    edit(repository / "spec", *WIRE)
    assert stagewire("check", repository / "spec", "--against", "HEAD").code == 1


def test_evidence_of_an_earlier_change_does_not_count(
    stagewire: Stagewire, repository: Path
) -> None:
    edit(repository / "spec", *PAGE)
    commit()
    edit(repository / "spec", *WIRE)
    assert stagewire("check", "spec", "--against", "HEAD").code == 1
    assert stagewire("check", "spec", "--against", "HEAD~1").code == 0


def test_examples_next_to_the_spec_are_evidence(stagewire: Stagewire, repository: Path) -> None:
    edit(repository / "spec", *WIRE)
    path = repository / "spec" / "tiny" / "examples.yaml"
    text = path.read_text(encoding="utf-8")
    claim = "{flag: state_bits.at_rest, bit: 2}"
    path.write_text(text.replace("claim: {prose: true}", f"claim: {claim}"), encoding="utf-8")
    assert stagewire("check", "spec", "--against", "HEAD").code == 0
    commit()
    assert stagewire("check", "spec", "--against", "HEAD~1").code == 0


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["spec", "--against", "nowhere"],
         "--against (nowhere) is neither a folder nor a readable revision: the repository has no"),
        (["spec", "--against", "HEAD:nowhere"], "the revision HEAD has no directory nowhere"),
        (["spec", "--against", ""], "the name of --against is empty"),
        (["spec", "--against", "-x"], "is not a revision"),
        (["spec", "--against"], "requires an argument"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)  # fmt: skip
def test_wrong_arguments_are_refused(
    stagewire: Stagewire, repository: Path, arguments: list[str], said: str
) -> None:
    result = stagewire("check", *arguments)
    assert (result.code, result.out) == (2, "")
    assert said in result.err


def test_a_spec_missing_in_the_revision_is_an_error(stagewire: Stagewire, repository: Path) -> None:
    shutil.copytree("spec", "other")
    result = stagewire("check", "other", "--against", "HEAD")
    assert result.code == 2
    assert "the revision HEAD has no directory other" in result.err


@pytest.mark.parametrize("command", [["check", "spec", "--against"], ["diff", "HEAD"]])
def test_a_revision_missing_in_a_shallow_clone_can_be_fetched(
    stagewire: Stagewire,
    repository: Path,
    monkeypatch: pytest.MonkeyPatch,
    command: list[str],
) -> None:
    """Most CI servers make shallow clones; the error says how to fetch the missing revision."""
    git("clone", "--quiet", "--depth", "1", repository.as_uri(), "../shallow")
    monkeypatch.chdir(repository.parent / "shallow")
    assert stagewire(*command, "HEAD").code == 0
    result = stagewire(*command, "HEAD~1")
    assert result.code == 2
    assert "this clone is shallow: fetch the revision" in result.err
    monkeypatch.chdir(repository)
    assert "shallow" not in stagewire(*command, "HEAD~9").err


def test_json_contains_the_comparison(stagewire: Stagewire, repository: Path) -> None:
    edit(repository / "spec", *WIRE)
    result = stagewire("check", "--against", "HEAD", "--format", "json")
    assert result.code == 1
    data = json.loads(result.out)
    assert (data["against"], data["changes"]) == ("HEAD", {"WIRE": 1, "SOURCE": 0, "DOC": 0})
    assert [d["file"] for d in data["diagnostics"]] == ["spec/tiny/messages/core.yaml"]
    assert list(data["protocols"]) == ["tiny"]


SECONDS = ("overlays/second/messages/core.yaml", "{name: seconds}", "{name: seconds, maximum: 9}")
EDITION = ("overlays/second/overlay.yaml", "date: Winter", "date: Late winter")


def test_overlays_are_compared(stagewire: Stagewire, repository: Path) -> None:
    """A revision without overlays, one with overlays, and a change in one of them."""
    shutil.copytree(OVERLAYS, repository / "spec" / "tiny" / "overlays")
    result = stagewire("check", "--against", "HEAD")
    assert result.code == 0
    assert result.out.endswith("against HEAD: ok; 2 changes: 0 WIRE, 2 SOURCE, 0 DOC\n")
    commit()
    edit(repository / "spec", *SECONDS)
    result = stagewire("check", "--against", "HEAD")
    assert result.code == 1
    assert result.out.startswith(
        "spec/tiny/overlays/second/messages/core.yaml:46:14: SW050 LAMP_TEST header "
    )
    assert "in the overlay second" in result.out
    edit(repository / "spec", *EDITION)
    assert stagewire("check", "--against", "HEAD").code == 0
    shutil.rmtree(repository / "spec" / "tiny" / "overlays" / "third")
    result = stagewire("check", "--against", "HEAD")
    assert result.code == 1
    assert result.out.startswith(
        "spec/tiny/protocol.yaml:2:1: SW051 overlay third: overlay-removed"
    )
    assert result.err == "spec: 1 error\n"
    assert stagewire("check", "--against", "HEAD~1").code == 0  # the old revision has no overlay


def test_json_contains_the_changes_of_overlays(stagewire: Stagewire, repository: Path) -> None:
    shutil.copytree(OVERLAYS, repository / "spec" / "tiny" / "overlays")
    commit()
    edit(repository / "spec", *SECONDS)
    data = json.loads(stagewire("check", "--against", "HEAD", "--format", "json").out)
    assert data["changes"] == {"WIRE": 1, "SOURCE": 0, "DOC": 0}
    [found] = data["diagnostics"]
    assert found["file"] == "spec/tiny/overlays/second/messages/core.yaml"


def test_combined_overlays_are_not_compared(stagewire: Stagewire, repository: Path) -> None:
    shutil.copytree(OVERLAYS, repository / "spec" / "tiny" / "overlays")
    result = stagewire("check", "--against", "HEAD", "--overlay", "tiny/second")
    assert (result.code, result.out) == (2, "")
    assert "--against compares each overlay on its own" in result.err


def test_the_spec_of_the_project_equals_itself(stagewire: Stagewire) -> None:
    assert stagewire("check", ROOT / "spec", "--against", ROOT / "spec").code == 0
