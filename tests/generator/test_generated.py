"""Generated files: their JSON Schemas, digests, formatting and canonical form."""

from __future__ import annotations

import hashlib
import json
import subprocess
import sys
from itertools import pairwise
from pathlib import Path
from typing import Any

import jsonschema
import jsonschema_rs
import pytest

from checkout import ROOT
from stagewire_generator import DEFAULT_TARGETS, TARGETS, check, render
from stagewire_generator.model import Protocol
from stagewire_generator.targets.templates import canonical

GENERATED = ROOT / "generated"
COMMITTED = {
    path.relative_to(GENERATED).as_posix(): path.read_bytes()
    for path in sorted(GENERATED.rglob("*"))
    if path.is_file() and "__pycache__" not in path.parts
}


def validate(data: Any, kind: str) -> None:
    text = (ROOT / "spec" / "schema" / f"{kind}.schema.json").read_text("utf-8")
    # The Rust library is fast but rejects lone surrogates, and its messages have fewer details.
    quick = jsonschema_rs.Draft202012Validator(json.loads(text.replace(r"\\uD800-\\uDFFF", "")))
    if not quick.is_valid(data):
        validator = jsonschema.Draft202012Validator(json.loads(text))
        assert [f"{e.json_path}: {e.message}" for e in validator.iter_errors(data)] == []
        raise AssertionError("one library finds an error and the other does not")


@pytest.fixture(params=["files", "command_files", "committed"])
def tree(request: pytest.FixtureRequest) -> dict[str, bytes]:
    if request.param == "committed":
        return COMMITTED
    files = request.getfixturevalue(request.param)
    return {path: text.encode("utf-8") for path, text in files.items()}


def parsed(tree: dict[str, bytes], kind: str) -> list[Any]:
    found = [json.loads(data) for path, data in tree.items() if path.endswith(f"/{kind}.json")]
    assert found
    return found


def test_ruff_format() -> None:
    folder = GENERATED / "python"
    config = ["--config", str(ROOT / "pyproject.toml"), "--no-cache"]
    command = [sys.executable, "-m", "ruff", "format", "--check", *config, str(folder)]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stdout + result.stderr


@pytest.mark.parametrize("kind", ["registry", "vectors"])
def test_json_matches_its_schema(tree: dict[str, bytes], kind: str) -> None:
    for data in parsed(tree, kind):
        validate(data, kind)


def test_manifest(tree: dict[str, bytes]) -> None:
    manifest = json.loads(tree["manifest.json"])
    validate(manifest, "manifest")
    digests = {path: hashlib.sha256(data).hexdigest() for path, data in tree.items()}
    del digests["manifest.json"]
    assert manifest["files"] == digests


def test_json_is_canonical(tree: dict[str, bytes]) -> None:
    """Reading and writing it again gives the same bytes."""
    for path, data in tree.items():
        if path.endswith(".json"):
            lines = ["cases", "errata", "messages", "rules", "stages", "units"]
            assert canonical(json.loads(data), lines).encode("utf-8") == data, path


def test_json_has_no_terminal_control_characters() -> None:
    text = canonical({"b": "\x1b\x7f\x85\xad é", "a": 1})
    assert text == '{\n  "a": 1,\n  "b": "\\u001b\\u007f\\u0085\\u00ad é"\n}\n'
    assert json.loads(text) == {"a": 1, "b": "\x1b\x7f\x85\xad é"}


@pytest.mark.parametrize(
    ("char", "line"), [("\x7f", "\\u007f"), ("\x85", "\\u0085"), ("\xad", "\\u00ad"), ("é", "é")]
)
def test_lists_with_an_item_on_each_line_have_no_terminal_control_characters(
    char: str, line: str
) -> None:
    text = canonical({"a": [{"c": char}, 1], "b": char}, lines=("a",))
    assert text == f'{{\n  "a": [\n    {{"c":"{line}"}},\n    1\n  ],\n  "b": "{line}"\n}}\n'


def test_lists_are_sorted(tree: dict[str, bytes]) -> None:
    for data in parsed(tree, "registry"):
        keys = [
            (m["id"] is None, m["id"] or 0, m.get("sub_message", 0), m["name"])
            for m in data["messages"]
        ]
        assert keys == sorted(keys)
        for kind in ("units", "stages"):
            names = [entry["name"] for entry in data[kind]]
            assert names == sorted(names)
        slugs = [erratum["id"] for erratum in data["errata"]]
        assert slugs == sorted(slugs)
        for message in data["messages"]:
            assert message["errata"] == sorted(message["errata"])
            if data["framing"]["kind"] == "slots":
                assert [layout["form"] for layout in message["layouts"]] in (
                    ["request"],
                    ["request", "reply"],
                )
            for layout in message["layouts"]:
                ends = [(f["offset"], f["offset"] + f["size"]) for f in layout["fields"]]
                assert all(left[1] == right[0] for left, right in pairwise(ends))
                assert (ends[-1][1] if ends else 0) == layout["length"]
    for data in parsed(tree, "vectors"):
        places = [(e["page"], e["line"], e["id"]) for e in data["examples"]]
        assert places == sorted(places)


def test_no_floats(tree: dict[str, bytes]) -> None:
    def refuse(text: str) -> None:
        raise AssertionError(f"a float: {text}")

    for path, data in tree.items():
        if path.endswith("/registry.json"):
            json.loads(data, parse_float=refuse)


def test_exact_scales(files: dict[str, str]) -> None:
    data = json.loads(files["python/stagewire_tiny/registry.json"])
    quantities = data["quantities"]
    assert quantities["interval"]["scale"] == {
        "us_per_count": {"numerator": 512, "denominator": 5},
        "printed": "102.4",
        "source": "the crystal",
    }
    assert quantities["distance"]["scale"] == {"by": "stage"}
    assert quantities["samples"]["scale"]["units"]["TP1"]["ms_per_count"] == {
        "numerator": 1,
        "denominator": 7,
    }
    cases = quantities["reading"]["scale"]["cases"]
    assert cases["VOLTAGE"]["scale"] == {"counts_per_v": {"numerator": 10, "denominator": 3}}
    assert cases["DISTANCE"]["scale"]["counts_at_setting"] == 4095
    assert cases["FORCE"]["scale"] == {"unknown": "no page says so"}
    [stage] = data["stages"]
    assert stage["controllers"]["TP9"]["speed"] == {"unknown": "no page says so"}
    velocity = stage["controllers"]["TPx"]["speed"]["counts_per_mm_per_s"]
    assert velocity == {"numerator": 16777216, "denominator": 125}


@pytest.mark.parametrize("name", ["files", "command_files"])
def test_each_target_is_a_part_of_the_output(
    protocol: Protocol, commands: Protocol, request: pytest.FixtureRequest, name: str
) -> None:
    protocols = [protocol if name == "files" else commands]
    files = request.getfixturevalue(name)
    left = {path: text for path, text in files.items() if path != "manifest.json"}
    for target in TARGETS:
        part = render(protocols, [target])
        assert part
        assert (part.items() <= left.items()) is (target in DEFAULT_TARGETS)
        assert (part.keys() & left.keys() == set()) is (target not in DEFAULT_TARGETS)
        left = {path: text for path, text in left.items() if path not in part}
    assert left == {}


def test_committed_files_are_up_to_date() -> None:
    """Generating them from the registry gives the same bytes."""
    made = {path: text.encode("utf-8") for path, text in render(check(ROOT / "spec")).items()}
    assert made.keys() == COMMITTED.keys()
    assert [path for path in made if made[path] != COMMITTED[path]] == []


def test_both_protocols_are_committed() -> None:
    kinds = {d["protocol"]: d["framing"]["kind"] for d in parsed(COMMITTED, "registry")}
    assert kinds == {"thorlabs_apt": "header", "asi_ms2000": "slots"}


def test_order_of_files_and_entries_does_not_matter(
    spec: Path, files: dict[str, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Moving a message within the file of its chapter, or renaming the file, changes nothing."""
    path = spec / "tiny" / "messages" / "extra.yaml"
    text = path.read_text(encoding="utf-8")
    start, middle, end = (text.index(f"  {n}:\n") for n in ("LAMP", "LAMP_TEST", "LAMP_BROKEN"))
    text = text[:start] + text[end:] + text[middle:end] + text[start:middle]
    path.unlink()
    (path.parent / "a.yaml").write_text(text, encoding="utf-8")
    assert render(check(spec)) == files


def test_order_of_commands_does_not_matter(
    commands_spec: Path, command_files: dict[str, str]
) -> None:
    path = commands_spec / "turtle" / "messages" / "walk.yaml"
    text = path.read_text(encoding="utf-8")
    start, end = text.index("  GO_TO:\n"), text.index("  WHERE:\n")
    path.write_text(text[:start] + text[end:] + text[start:end], encoding="utf-8")
    assert render(check(commands_spec)) == command_files


def test_facts_of_commands(command_files: dict[str, str]) -> None:
    data = json.loads(command_files["python/stagewire_turtle/registry.json"])
    assert data["framing"] == {
        "kind": "slots", "page": 2, "prefix": 0xFE, "terminator": 0x2E, "maximum_length": 255,
        "axes": "axis",
    }  # fmt: skip
    messages = {message["name"]: message for message in data["messages"]}
    facts = {
        "WAKE": {
            "kind": "setup", "id": 0x57, "keyboard": "W", "direction": "to_controller",
            "firmware": [{"version": "1.3", "note": "at once", "page": 1}], "switches_to": "low_level",
        },
        "MOOD": {"kind": "command", "id": 0x3F, "size": None, "dummy": False, "firmware": []},
        "SPIN": {"kind": "command", "id": 0x53, "size": 2, "dummy": True, "title": "Spin (about)"},
    }  # fmt: skip
    for name, wanted in facts.items():
        assert {key: messages[name][key] for key in wanted} == wanted
    assert {"size", "dummy"}.isdisjoint(messages["WAKE"])  # without a size slot
    assert "switches_to" not in messages["MOOD"]
    tail = data["enumerations"]["axis"]["values"]["TAIL"]
    assert (tail["value"], tail["keyboard"], tail["reserved"]) == (0x1B, "ESC", True)
    assert data["quantities"]["distance"]["scale"]["counts_per_um"] == {
        "numerator": 10, "denominator": 1
    }  # fmt: skip
    assert data["units"][0]["baud_rates"]["values"] == [300, 9600]


def test_stages_import_what_they_use(spec: Path, files: dict[str, str]) -> None:
    module = "python/stagewire_tiny/stages.py"
    line = "from stagewire.support import "
    assert f"{line}Limit, Scale, Stage, UnknownLimit, UnknownScale\n" in files[module]
    path = spec / "tiny" / "stages.yaml"
    text = path.read_text(encoding="utf-8")
    unknown = "        speed: {unknown: no page says so}\n"
    assert unknown in text
    without = text.replace(unknown, "").partition("    limits:")[0]
    path.write_text(without, encoding="utf-8")
    assert f"{line}Scale, Stage\n" in render(check(spec))[module]


def test_negative_values_and_signed_bytes(spec: Path) -> None:
    """The spec language allows them, but our protocols have none."""
    tiny = spec / "tiny"
    head = (tiny / "protocol.yaml").read_text(encoding="utf-8")
    head = head.replace("byte: {size: 1, signed: false", "byte: {size: 1, signed: true")
    head = head.replace("  word: {", "  huge: {size: 8, signed: true}\n  word: {", 1)
    (tiny / "protocol.yaml").write_text(head, encoding="utf-8")
    extra = (tiny / "messages" / "extra.yaml").read_text(encoding="utf-8")
    extra = extra.replace("messages:\n", "enumerations:\n" + SIGNS + "messages:\n", 1)
    extra = extra.replace("length: 0x04", "length: 0x0A")
    extra = extra.replace("{format: word, quantity: pressure}", "{format: huge, enum: tilt}")
    (tiny / "messages" / "extra.yaml").write_text(extra, encoding="utf-8")
    files = render(check(spec))
    modules = {
        path: compile(text, path, "exec") for path, text in files.items() if path.endswith(".py")
    }
    scope: dict[str, Any] = {"__name__": "enumerations"}
    exec(modules["python/stagewire_tiny/enumerations.py"], scope)
    assert [int(value) for value in scope["Tilt"]] == [-1, -32768, 300]
    chapter = files["python/stagewire_tiny/messages/extra.py"]
    assert 'Struct("<LBBHq")' in chapter
    assert 'Struct("<HbbBB")' in files["python/stagewire_tiny/messages/core.py"]


SIGNS = """\
  tilt:
    page: 7
    values:
      DOWN: {value: -1}
      FAR_DOWN: {value: -32768}
      UP: {value: 300}
"""
