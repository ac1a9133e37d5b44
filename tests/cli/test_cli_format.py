"""``stagewire format`` and ``schemas``: files, output, errors and exit codes."""

from __future__ import annotations

import contextlib
import json
import shutil
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from checkout import ROOT, SMALL_SPECS
from stagewire_cli.main import main

if TYPE_CHECKING:
    from conftest import Stagewire

GOOD = SMALL_SPECS / "good_spec"
KINDS = (
    "additions captures decisions errata evidence examples messages overlay printed protocol quantities "
    "rules stages units"
)


@pytest.fixture(scope="module")
def formatted(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a small spec in canonical form, with its schemas."""
    folder = tmp_path_factory.mktemp("formatted")
    shutil.copytree(GOOD, folder / "spec")
    with contextlib.chdir(folder):
        assert main(["schemas", "spec/schema"]) == 0
        assert main(["format"]) == 0
    return folder / "spec"


@pytest.fixture
def spec(formatted: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a copy of that spec below the current folder."""
    monkeypatch.chdir(tmp_path)
    shutil.copytree(formatted, "spec")
    return Path("spec")


def spoil(path: Path, text: str = "\n\n\n") -> bytes:
    path.write_bytes(path.read_bytes() + text.encode())
    return path.read_bytes()


def test_canonical_files_are_not_listed(stagewire: Stagewire, spec: Path) -> None:
    number = len(list(spec.rglob("*.yaml")))
    for arguments in ([], ["spec"], ["--check"], ["--check", "spec"]):
        result = stagewire("format", *arguments)
        assert (result.code, result.err) == (0, "")
        changed = "would change" if "--check" in arguments else "formatted"
        assert result.out == f"{number} files, 0 {changed}\n"


def test_examples_next_to_the_spec_are_formatted(stagewire: Stagewire, spec: Path) -> None:
    """For one release, examples in their places of version 0.1 are also formatted."""
    captures = Path("conformance/captures/tiny.yaml")
    captures.parent.mkdir(parents=True)
    (spec / "tiny" / "captures.yaml").rename(captures)
    result = stagewire("format", "--check", "spec")
    assert result.code == 1
    assert f"would change: {captures}\n" in result.out
    assert "+# yaml-language-server: $schema=../../spec/schema/captures.schema.json" in result.out
    assert stagewire("format").code == 0
    assert stagewire("format", "--check", captures, "spec/tiny").code == 0


def test_check_shows_what_would_change(stagewire: Stagewire, spec: Path) -> None:
    path = spec / "tiny" / "units.yaml"
    text = path.read_text(encoding="utf-8").replace("\nunits:\n", "\nunits:   # all\n")
    path.write_bytes(before := text.encode())
    other = spoil(spec / "tiny" / "stages.yaml")
    result = stagewire("format", "--check")
    assert result.code == 1
    assert f"would change: {path}\n--- {path}\n+++ {path} (canonical)\n@@" in result.out
    assert "\n-units:   # all\n" in result.out
    assert "\n+units:  # all\n" in result.out
    assert result.err.endswith(" files, 2 would change\n")
    assert path.read_bytes() == before
    assert (spec / "tiny" / "stages.yaml").read_bytes() == other
    result = stagewire("format", path)
    assert (result.code, result.out) == (0, f"formatted: {path}\n1 file, 1 formatted\n")
    assert stagewire("format", "--check").err.endswith(" files, 1 would change\n")
    assert stagewire("format").code == 0
    assert stagewire("format", "--check").code == 0


def test_invalid_files_are_reported_and_the_rest_is_formatted(
    stagewire: Stagewire, spec: Path
) -> None:
    broken, other = spec / "tiny" / "units.yaml", spec / "tiny" / "stages.yaml"
    content = spoil(broken, "twice: 1\ntwice: \x1b[2J\n")
    spoil(other)
    for arguments in (["--check"], []):
        result = stagewire("format", *arguments)
        assert result.code == 1
        assert f"{broken}:" in result.out
        assert "SW007" in result.out
        assert "\x1b" not in result.out
        assert result.err.endswith(", 1 left unchanged\n")
        assert broken.read_bytes() == content
    assert stagewire("format", "--check", other).code == 0
    assert stagewire("format", other, broken).code == 1


@pytest.mark.parametrize(
    ("arguments", "code", "said"),
    [
        (["format", "nowhere"], 2, "nowhere does not exist; give a file or folder"),
        (["format", ""], 2, "the name of a folder is empty"),
        (["format", "spec/schema"], 2, "spec/schema contains no file of a spec"),
        (["format", "spec/schema/units.schema.json"], 1, "1 left unchanged"),
        (["format", "--all"], 2, "No such option"),
        (["schemas"], 2, "Missing argument 'FOLDER'"),
        (["schemas", ""], 2, "the name of a folder is empty"),
    ],
)
@pytest.mark.usefixtures("spec")
def test_wrong_arguments_are_refused(
    stagewire: Stagewire, arguments: list[object], code: int, said: str
) -> None:
    result = stagewire(*arguments)
    assert result.code == code
    assert said in result.err


def test_format_reports_missing_schemas(stagewire: Stagewire, spec: Path) -> None:
    shutil.rmtree(spec / "schema")
    result = stagewire("format")
    assert result.code == 0
    assert "editors look for schemas in " in result.err
    assert "run `stagewire schemas` to write them there" in result.err
    assert result.err.count("note:") == 1
    assert stagewire("schemas", spec / "schema").code == 0
    assert stagewire("format").err == ""


def test_schemas_are_written_and_checked(stagewire: Stagewire, tmp_path: Path) -> None:
    out = tmp_path / "spec" / "schema"
    assert stagewire("schemas", out, "--check").code == 1
    assert not out.exists()
    result = stagewire("schemas", out)
    assert result.code == 0
    written = {path.name for path in out.iterdir()} - {"manifest.json"}
    assert written == {f"{kind}.schema.json" for kind in KINDS.split()}
    for name in written:
        assert (out / name).read_bytes() == (ROOT / "spec" / "schema" / name).read_bytes()
    assert stagewire("schemas", out, "--check").out.endswith("14 schemas, up to date\n")
    assert stagewire("schemas", out).out == f"{out}: 14 schemas, 0 files written\n"


def test_only_schemas_are_updated(stagewire: Stagewire, tmp_path: Path) -> None:
    out = tmp_path / "schema"
    assert stagewire("schemas", out).code == 0
    units, mine = out / "units.schema.json", out / "mine.schema.json"
    units.write_text("{}", encoding="utf-8")
    mine.write_text("{}", encoding="utf-8")
    result = stagewire("schemas", out, "--check")
    assert (result.code, result.out) == (1, "changed: units.schema.json\n")
    assert stagewire("schemas", out).code == 0
    assert json.loads(units.read_text(encoding="utf-8"))["title"] == "Units"
    assert mine.read_text(encoding="utf-8") == "{}"


def test_schemas_do_not_overwrite_other_files(stagewire: Stagewire, tmp_path: Path) -> None:
    mine = tmp_path / "units.schema.json"
    mine.write_text('{"title": "Mine"}', encoding="utf-8")
    result = stagewire("schemas", tmp_path)
    assert result.code == 1
    assert "nothing was written" in result.err
    assert [path.name for path in tmp_path.iterdir()] == [mine.name]
    assert json.loads(mine.read_text(encoding="utf-8"))["title"] == "Mine"
