"""``stagewire check`` and ``generate``: all diagnostics, no output for a broken spec, no lost files."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from checkout import ROOT
from quick_specs import quick_specs
from stagewire_generator import TARGETS

if TYPE_CHECKING:
    from conftest import Stagewire

SPEC = ROOT / "spec"


@pytest.fixture(scope="module", autouse=True)
def _quick() -> Iterator[None]:
    with quick_specs():
        yield


@pytest.fixture
def spec(tmp_path: Path) -> Path:
    """Return a copy of the spec that a test can break."""
    shutil.copytree(SPEC, tmp_path / "spec")
    return tmp_path / "spec"


def break_it(spec: Path) -> None:
    for name in ("generic", "motor"):
        path = spec / "thorlabs_apt" / "messages" / f"{name}.yaml"
        path.write_text(path.read_text(encoding="utf-8") + "twice: 1\ntwice: 2\n", encoding="utf-8")


def test_check_summarises_a_valid_spec(stagewire: Stagewire) -> None:
    result = stagewire("check", SPEC)
    assert result.code == 0, result.out
    assert [line.split(";")[0] for line in result.out.splitlines()] == [
        "asi_ms2000: ok",
        "thorlabs_apt: ok",
        "thorlabs_apt/issue_37: ok",
        "thorlabs_apt/later_issues: ok",
        "thorlabs_apt/vendor_software: ok",
    ]
    for what in ("messages", "layouts", "fields", "errata", "witness places", "examples"):
        assert f" {what}" in result.out


def test_check_reports_all_errors(stagewire: Stagewire, spec: Path) -> None:
    break_it(spec)
    result = stagewire("check", spec)
    assert result.code == 1
    assert "messages/generic.yaml:" in result.out
    assert "messages/motor.yaml:" in result.out
    assert "hint: " in result.out
    assert result.err.endswith(" errors\n")


@pytest.mark.parametrize(
    ("arguments", "code", "said"),
    [
        (["check", "nowhere"], 2, "nowhere is not a folder"),
        (["check", ROOT / "pyproject.toml"], 2, "is not a folder"),
        (["check", SPEC, SPEC], 2, "unexpected extra argument"),
        (["check", Path(__file__).parent], 1, "error"),
        (["generate", "--spec", "nowhere"], 2, "nowhere is not a folder"),
        (["generate", "--target", "cobol"], 2, "unknown target cobol (choose from "),
        (
            ["generate", "--spec", SPEC, "--spec", SPEC, "--check"],
            2,
            "more than one of the folders has the protocol",
        ),
        (["generate", "--all"], 2, "No such option"),
        (["check", ""], 2, "the name of a folder is empty"),
        (["generate", "--spec", ""], 2, "the name of a folder is empty"),
        (["generate", "--spec", SPEC, "--out", ""], 2, "the name of a folder is empty"),
    ],
)
def test_wrong_arguments_are_refused(
    stagewire: Stagewire, arguments: list[object], code: int, said: str
) -> None:
    result = stagewire(*arguments)
    assert result.code == code
    assert said in result.err


def test_the_generated_files_are_up_to_date(stagewire: Stagewire) -> None:
    result = stagewire("generate", "--spec", SPEC, "--out", ROOT / "generated", "--check")
    assert result.code == 0, result.out
    assert "files, up to date" in result.out


def test_a_broken_spec_writes_nothing(stagewire: Stagewire, spec: Path, tmp_path: Path) -> None:
    break_it(spec)
    result = stagewire("generate", "--spec", spec, "--out", tmp_path / "out")
    assert result.code == 1
    assert "nothing was written" in result.err
    assert not (tmp_path / "out").exists()


def test_generate_compare_and_write_again(stagewire: Stagewire, tmp_path: Path) -> None:
    out = tmp_path / "out with a blank"
    command = ("generate", "--spec", SPEC, "--out", out)
    assert stagewire(*command, "--check").code == 1
    assert stagewire(*command).code == 0
    assert stagewire(*command, "--check").code == 0
    manifest = json.loads((out / "manifest.json").read_text(encoding="utf-8"))
    edited, missing = sorted(manifest["files"])[:2]
    (out / edited).write_text("edited by hand\n", encoding="utf-8")
    (out / missing).unlink()
    (out / "mine.txt").write_text("my own\n", encoding="utf-8")
    result = stagewire(*command, "--check")
    assert result.code == 1
    assert f"changed: {edited}" in result.out
    assert "-edited by hand" in result.out
    assert f"missing: {missing}" in result.out
    assert "orphaned: mine.txt" in result.out
    assert result.err.endswith("1 changed, 1 missing, 1 orphaned\n")


def test_changed_files_cannot_control_a_terminal(stagewire: Stagewire, tmp_path: Path) -> None:
    path = tmp_path / "python" / "stagewire_apt" / "registry.json"
    path.parent.mkdir(parents=True)
    path.write_text("\x1b[2J\u202egone\n", encoding="utf-8")
    (tmp_path / "\x1b[2J.txt").write_text("", encoding="utf-8")
    result = stagewire("generate", "--spec", SPEC, "--out", tmp_path, "--check")
    assert "-\\x1b[2J\\u202egone\n" in result.out
    assert "orphaned: \\x1b[2J.txt\n" in result.out
    assert all(c.isprintable() or c == "\n" for c in result.out)


def test_generate_does_not_delete_other_files(stagewire: Stagewire, tmp_path: Path) -> None:
    out = tmp_path / "out"
    target = out / "python" / "stagewire_apt" / "registry.json"
    target.parent.mkdir(parents=True)
    target.write_text("my own notes\n", encoding="utf-8")
    result = stagewire("generate", "--spec", SPEC, "--out", out)
    assert result.code == 1
    assert "python/stagewire_apt/registry.json" in result.err
    assert target.read_text(encoding="utf-8") == "my own notes\n"
    assert [path for path in out.rglob("*") if path.is_file()] == [target]


def test_one_target_does_not_touch_the_others(stagewire: Stagewire, tmp_path: Path) -> None:
    out = tmp_path / "out"
    command = ("generate", "--spec", SPEC, "--out", out)
    assert stagewire(*command).code == 0
    before = {path: path.read_bytes() for path in out.rglob("*") if path.is_file()}
    (out / "c" / "stagewire_apt" / "flags.h").unlink()
    assert stagewire(*command, "--target", "python", "--check").code == 0
    assert stagewire(*command, "--target", "c", "--check").code == 1
    result = stagewire(*command, "--target", "c")
    assert result.code == 0
    assert {path: path.read_bytes() for path in out.rglob("*") if path.is_file()} == before


def test_other_targets_can_be_added(stagewire: Stagewire, tmp_path: Path) -> None:
    """``--target`` adds it to the folder; without ``--target`` the folder has only the default targets."""
    out = tmp_path / "out"
    command = ("generate", "--spec", SPEC, "--out", out)
    others = ("--target", "registry", "--target", "vectors", "--target", "c-tests")
    assert stagewire(*command).code == 0
    assert stagewire(*command, *others).code == 0
    assert stagewire(*command, *others, "--check").code == 0
    for kind in ("registry", "vectors"):
        alone, packed = (
            out / kind / "thorlabs_apt.json",
            out / "python/stagewire_apt" / f"{kind}.json",
        )
        assert alone.read_bytes() == packed.read_bytes()
    assert (out / "c" / "stagewire_apt" / "testing" / "cases.c").is_file()
    assert "orphaned: registry/thorlabs_apt.json\n" in stagewire(*command, "--check").out
    assert stagewire(*command).code == 0
    assert sorted(path.name for path in out.iterdir()) == ["c", "manifest.json", "python"]


def test_the_help_names_every_target(stagewire: Stagewire) -> None:
    *others, last = TARGETS
    said = " ".join(stagewire("generate", "--help").out.replace("│", " ").split())
    assert f"{', '.join(others)} or {last}; may be repeated" in said
