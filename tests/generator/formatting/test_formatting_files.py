"""Format files: those of the project are canonical, others become so, and no file is lost."""

from __future__ import annotations

import json
import os
import re
import shutil
import stat
from pathlib import Path

import jsonschema
import pytest

from checkout import ROOT
from stagewire_generator import strict_yaml
from stagewire_generator.diagnostics import Diagnostics
from stagewire_generator.formatting import find, format_file
from stagewire_generator.formatting.files import kind_of
from stagewire_generator.schemas import KINDS, schema_folder, schema_texts

SPECS = [
    "spec",
    *(
        f"tests/generator/{name}"
        for name in (
            "good_spec", "good_commands", "good_packets", "good_overlays", "witness_spec",
        )
    ),
]  # fmt: skip
FILES = [path for spec in SPECS for path in find(ROOT / spec)]
COMPLETE = [path for path in FILES if "overlays" not in path.parts or "tests" not in path.parts]


def name(path: Path) -> str:
    return Path(os.path.relpath(path, ROOT)).as_posix()


def test_files_of_every_kind_are_found() -> None:
    kinds = {kind_of(path, path.read_text(encoding="utf-8")) for path in FILES}
    assert kinds == set(KINDS)
    found = {name(path) for path in FILES}
    assert {"spec/thorlabs_apt/protocol.yaml", "spec/thorlabs_apt/captures.yaml"} <= found
    assert {name(path) for path in (ROOT / "spec").rglob("*.yaml")} <= found


@pytest.mark.parametrize("path", FILES, ids=name)
def test_a_file_of_the_project_is_canonical(path: Path) -> None:
    outcome = format_file(path, write=False)
    assert outcome.state == "kept", f"{outcome.diff}{outcome.reason} (run stagewire format)"
    assert outcome.no_schemas is None


@pytest.mark.parametrize("path", COMPLETE, ids=name)
def test_a_file_of_the_project_is_valid_by_the_schema_that_it_names(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    first = text.splitlines()[0]
    found = re.fullmatch(r"# yaml-language-server: \$schema=([./\w]+)", first)
    assert found, first
    named = path.parent / found[1]
    kind = kind_of(path, "")
    assert named.resolve() == (ROOT / "spec" / "schema" / f"{kind}.schema.json").resolve()
    document = strict_yaml.parse(text, "", Diagnostics(), any_byte=True)
    assert document is not None
    data = document.data
    if kind == "units" and "overlays" in path.parts:  # the addresses are those of the protocol
        base = strict_yaml.parse(
            (path.parents[2] / "units.yaml").read_text(encoding="utf-8"), "", Diagnostics()
        )
        assert base is not None
        data = {"addresses": base.data["addresses"], **data}
    jsonschema.Draft202012Validator(json.loads(named.read_text(encoding="utf-8"))).validate(data)


@pytest.fixture
def spec(tmp_path: Path, good_spec: Path) -> Path:
    """A copy of the small good spec, with the schemas in the place that it names."""
    copy = Path(shutil.copytree(good_spec, tmp_path / "a" / "b" / "spec"))
    shutil.copytree(schema_folder(), tmp_path / "spec" / "schema")
    assert all(format_file(path, write=False).state == "kept" for path in find(copy))
    return copy


def test_formatting_restores_a_spec_with_a_damaged_style(spec: Path) -> None:
    """Line endings, indentation, quotes, digits and the first line are restored."""
    paths = find(spec)
    before = {path: path.read_bytes() for path in paths}
    for path in paths:
        text = path.read_text(encoding="utf-8")
        text = re.sub(r"^# yaml-language.*\n", "", text)
        text = re.sub(r"^( *)- ", r"\1-   ", text, flags=re.MULTILINE)
        text = re.sub(r"^( +)", r"\1\1", text, flags=re.MULTILINE)
        text = re.sub(r"(?<![\w\"])0x0+([0-9A-F])", lambda found: f"0x{found[1].lower()}", text)
        text = re.sub(r"^( *)(-   )?(\w+):", r"\1\2'\3':", text, flags=re.MULTILINE)
        path.write_bytes(text.replace("\n", "  \r\n").encode())
    outcomes = [format_file(path, write=False) for path in paths]
    assert [outcome for outcome in outcomes if outcome.state != "formatted"] == []
    assert {path: path.read_bytes() for path in paths} != before
    for path in paths:
        assert format_file(path, write=True).state == "formatted"
        assert path.read_bytes().decode() == before[path].decode()
        assert format_file(path, write=True).state == "kept"


def test_a_file_keeps_its_mode_and_leaves_no_other_file(spec: Path) -> None:
    path = spec / "tiny" / "units.yaml"
    beside = sorted(path.parent.iterdir())
    path.write_bytes(path.read_bytes() + b"\n\n")
    path.chmod(0o640)
    assert format_file(path, write=True).state == "formatted"
    assert stat.S_IMODE(path.stat().st_mode) == 0o640
    assert sorted(path.parent.iterdir()) == beside


def test_a_failed_write_leaves_the_file_unchanged(
    spec: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = spec / "tiny" / "units.yaml"
    path.write_bytes(before := path.read_bytes() + b"\n\n")
    beside = sorted(path.parent.iterdir())

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.replace", full)
    with pytest.raises(OSError, match="No space"):
        format_file(path, write=True)
    assert path.read_bytes() == before
    assert sorted(path.parent.iterdir()) == beside


@pytest.mark.parametrize(
    ("content", "code"),
    [
        (b"units: [", "SW001"),
        (b"units: 1\nunits: 2\n", "SW002"),
        (b"units: on\n", "SW004"),
        (b"units: \xff\n", "SW006"),
        (b"units: \x1b\n", "SW007"),
        (b'units: "\\x1b"\n', "SW007"),
    ],
)
def test_an_unreadable_file_is_left_unchanged(spec: Path, content: bytes, code: str) -> None:
    path = spec / "tiny" / "units.yaml"
    path.write_bytes(content)
    outcome = format_file(path, write=True)
    assert outcome.state == "left"
    assert [diagnostic.code for diagnostic in outcome.diagnostics] == [code]
    assert path.read_bytes() == content


def test_links_are_not_followed(spec: Path, tmp_path: Path) -> None:
    """Links to files and folders are skipped, because their targets may not belong to the spec."""
    outside = tmp_path / "outside.yaml"
    outside.write_bytes(before := b"units:   {}\n")
    link = spec / "tiny" / "errata" / "link.yaml"
    link.symlink_to(outside)
    (spec / "tiny" / "messages" / "folder").symlink_to(tmp_path)
    assert link not in find(spec)
    assert not any("folder" in path.parts for path in find(spec))
    outcome = format_file(link, write=True)
    assert (outcome.state, link.is_symlink()) == ("left", True)
    assert "link" in outcome.reason
    assert outside.read_bytes() == before


def test_a_file_outside_a_spec_is_skipped(spec: Path) -> None:
    for other in (".hidden/protocol.yaml", "tiny/pipeline.yaml", "tiny/notes.txt"):
        path = spec / other
        path.parent.mkdir(exist_ok=True)
        path.write_text("a:   1\n", encoding="utf-8")
        assert path not in find(spec)
    outcome = format_file(spec / "tiny/pipeline.yaml", write=True)
    assert outcome.state == "left"
    assert "not a file of a spec" in outcome.reason


def test_the_place_for_missing_schemas_is_reported(tmp_path: Path, good_spec: Path) -> None:
    copy = Path(shutil.copytree(good_spec, tmp_path / "mine"))
    path = copy / "tiny" / "messages" / "core.yaml"
    outcome = format_file(path, write=True)
    assert outcome.no_schemas == copy / "schema"
    assert "$schema=../../schema/messages.schema.json\n" in path.read_text(encoding="utf-8")
    (copy / "schema").mkdir()
    for file, text in schema_texts().items():
        (copy / "schema" / file).write_text(text, encoding="utf-8")
    assert format_file(path, write=True).state == "kept"
    assert format_file(path, write=True).no_schemas is None
