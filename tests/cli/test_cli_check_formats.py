"""``stagewire check --format``: each format can be parsed, even with hostile names of files and keys."""

from __future__ import annotations

import io
import json
import os
import re
import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import jsonschema
import junitparser
import pytest

from checkout import ROOT, SMALL_SPECS
from stagewire_cli.main import main
from stagewire_cli.reports import Report, ReportFormat, written
from stagewire_generator.codes import CODES
from stagewire_generator.diagnostics import Diagnostic, Place
from stagewire_generator.reader import find_spec

if TYPE_CHECKING:
    from conftest import Stagewire

GOOD = SMALL_SPECS / "good_spec"
SCHEMA = json.loads((ROOT / "spec/schema/diagnostics.schema.json").read_text(encoding="utf-8"))
MACHINE = ("json", "github", "junit")
FILES = 12  # of the good spec
LINES = len((GOOD / "tiny/stages.yaml").read_text(encoding="utf-8").splitlines())
SUMMARY = (
    "tiny: ok; 12 messages, 13 layouts, 32 fields, 2 errata (1 not compared), 52 witness places, "
    "1 examples\n"
)
# Text that could end a line, a command, a property or a section, or control a terminal.
HOSTILE = "a\n::error file=x::b%0A,c]]>&<d>\"'\x1b[2J\u202e.yaml"


@pytest.fixture
def spec(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a copy of the good spec in the layout of a project, below the current folder."""
    top = tmp_path / "project"
    shutil.copytree(GOOD / "tiny", top / "spec" / "tiny")
    monkeypatch.chdir(top)
    return Path("spec")


@pytest.fixture
def broken(spec: Path) -> Path:
    """Return the copy with two errors in one file and one in another."""
    path = spec / "tiny" / "stages.yaml"
    path.write_text(
        path.read_text(encoding="utf-8") + "stages: {}\ncontrollers: {}\n", encoding="utf-8"
    )
    Path("spec/tiny/captures.yaml").write_text("]", encoding="utf-8")
    return spec


@pytest.fixture
def hostile(spec: Path) -> Path:
    """Return the copy with hostile names of a file and of keys."""
    path = spec / "tiny" / "messages" / HOSTILE
    key = json.dumps(HOSTILE)  # YAML has the escapes of JSON
    path.write_text(f"{key}: 1\n{key}: 2\n", encoding="utf-8")
    return spec


@dataclass(frozen=True)
class Command:
    """A workflow command, parsed like GitHub's runner does."""

    name: str
    properties: dict[str, str]
    message: str


def workflow_commands(text: str) -> list[Command]:
    """Parse workflow commands as documented by GitHub: lines that begin with two colons."""
    found = []
    for line in text.split("\n")[:-1]:
        match = re.fullmatch(r"::(\w+)(?: ([^:]*))?::(.*)", line)
        assert match, line
        pairs = (pair.partition("=") for pair in (match[2] or "").split(","))
        properties = {key: unescaped(value, more=True) for key, _, value in pairs}
        found.append(Command(match[1], properties, unescaped(match[3])))
    assert text == "" or text.endswith("\n")
    return found


def unescaped(text: str, *, more: bool = False) -> str:
    table = {"%0D": "\r", "%0A": "\n", **({"%3A": ":", "%2C": ","} if more else {}), "%25": "%"}
    assert not re.search("%(?!" + "|".join(key[1:] for key in table) + ")", text), text
    return re.sub("|".join(table), lambda match: table[match[0]], text)


def as_data(text: str) -> Any:
    assert text.isascii()
    data = json.loads(text)
    problems = jsonschema.Draft202012Validator(SCHEMA).iter_errors(data)
    assert [f"{error.json_path}: {error.message}" for error in problems] == []
    return data


def as_cases(text: str) -> dict[str, junitparser.TestCase]:
    xml = junitparser.JUnitXml.fromstring(text.encode())
    cases = [case for suite in xml for case in suite]
    assert (xml.tests, xml.failures) == (len(cases), sum(not case.is_passed for case in cases))
    assert len({case.name for case in cases}) == len(cases)
    return {case.name: case for case in cases}


@pytest.mark.parametrize("format", MACHINE)
def test_a_valid_spec_passes_in_every_format(stagewire: Stagewire, spec: Path, format: str) -> None:
    result = stagewire("check", spec, "--format", format)
    assert (result.code, result.err) == (0, SUMMARY)


def test_a_valid_spec_is_summarised_as_text(stagewire: Stagewire, spec: Path) -> None:
    assert stagewire("check", spec, "--format", "text") == stagewire("check", spec)
    assert stagewire("check", spec).out == SUMMARY


def test_a_valid_spec_is_described_as_json(stagewire: Stagewire, spec: Path) -> None:
    assert as_data(stagewire("check", spec, "--format", "json").out) == {
        "schema_version": 1,
        "spec": "spec",
        "ok": True,
        "protocols": {
            "tiny": {
                "messages": 12,
                "layouts": 13,
                "fields": 32,
                "errata": 2,
                "not_compared": 1,
                "places": 52,
                "examples": 1,
            }
        },
        "against": None,
        "changes": None,
        "diagnostics": [],
    }


def test_json(stagewire: Stagewire, broken: Path) -> None:
    result = stagewire("check", broken, "--format", "json")
    assert (result.code, result.err) == (1, "spec: 3 errors\n")
    data = as_data(result.out)
    assert (data["ok"], data["protocols"]) == (False, {})
    assert [(d["file"], d["line"], d["column"], d["code"]) for d in data["diagnostics"]] == [
        ("spec/tiny/captures.yaml", 1, 1, "SW001"),
        ("spec/tiny/stages.yaml", LINES + 1, 1, "SW002"),
        ("spec/tiny/stages.yaml", LINES + 2, 1, "SW002"),
    ]
    assert data["diagnostics"][1] == {
        "file": "spec/tiny/stages.yaml",
        "line": LINES + 1,
        "column": 1,
        "code": "SW002",
        "title": "duplicate key",
        "message": "duplicate key stages (first on line 5)",
        "hint": "keep one of the two entries",
        "docs": "docs/diagnostics.md#sw002",
    }


def test_github_gets_an_annotation_for_each_diagnostic(stagewire: Stagewire, broken: Path) -> None:
    Path(".git").mkdir()
    result = stagewire("check", broken, "--format", "github")
    assert (result.code, result.err) == (1, "spec: 3 errors\n")
    commands = workflow_commands(result.out)
    assert [command.name for command in commands] == ["error"] * 3
    assert commands[1].properties == {
        "file": "spec/tiny/stages.yaml",
        "line": str(LINES + 1),
        "col": "1",
        "title": "SW002: duplicate key",
    }
    assert commands[1].message.endswith("\nhint: keep one of the two entries")
    assert commands[0].properties["file"] == "spec/tiny/captures.yaml"


def test_a_valid_spec_has_no_annotations(stagewire: Stagewire, spec: Path) -> None:
    assert stagewire("check", spec, "--format", "github").out == ""


@pytest.mark.parametrize(
    ("folder", "argument"),
    [
        (".", "spec"),
        (".", "./spec/tiny"),
        ("spec", "."),
        ("spec", "tiny"),
        ("spec/tiny", "."),
        ("spec/tiny", "../../spec"),
    ],
)
def test_paths_are_relative_to_the_repository_or_the_current_folder(
    stagewire: Stagewire,
    broken: Path,
    monkeypatch: pytest.MonkeyPatch,
    folder: str,
    argument: str,
) -> None:
    """Annotations have paths from the top of the repository; text and JSON from the current folder."""
    top = Path.cwd()
    (top / ".git").mkdir()
    monkeypatch.chdir(folder)
    wanted = ["spec/tiny/captures.yaml", "spec/tiny/stages.yaml"]
    out = stagewire("check", argument, "--format", "github").out
    files = [command.properties["file"] for command in workflow_commands(out)]
    assert sorted(set(files)) == wanted
    data = as_data(stagewire("check", argument, "--format", "json").out)
    for found in data["diagnostics"]:
        assert Path(found["file"]).resolve().relative_to(top).as_posix() in wanted
    text = stagewire("check", argument).out
    named = re.findall(r"^(.+):\d+:\d+: SW", text, re.M)
    assert named == [found["file"] for found in data["diagnostics"]]


def test_annotations_have_absolute_paths_without_a_repository(
    stagewire: Stagewire, broken: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without a repository, annotations have absolute paths."""
    if any((folder / ".git").exists() for folder in Path.cwd().parents):
        pytest.fail("temporary folders are within a repository")
    out = stagewire("check", broken, "--format", "github").out
    [file] = {command.properties["file"] for command in workflow_commands(out)[1:]}
    assert file == (Path.cwd() / "spec/tiny/stages.yaml").as_posix()


def test_junit_has_a_passed_case_for_each_file(stagewire: Stagewire, spec: Path) -> None:
    """Every file has a passed case."""
    cases = as_cases(stagewire("check", spec, "--format", "junit").out)
    assert len(cases) == FILES
    assert all(case.is_passed for case in cases.values())
    assert {case.classname for case in cases.values()} == {"stagewire.tiny"}
    for name in cases:
        assert Path(name).is_file()


def test_junit_has_a_failure_for_each_file_with_errors(stagewire: Stagewire, broken: Path) -> None:
    result = stagewire("check", broken, "--format", "junit")
    assert (result.code, result.err) == (1, "spec: 3 errors\n")
    cases = as_cases(result.out)
    assert len(cases) == FILES
    failed = {name: case.result for name, case in cases.items() if not case.is_passed}
    assert set(failed) == {"spec/tiny/captures.yaml", "spec/tiny/stages.yaml"}
    [failure] = failed["spec/tiny/stages.yaml"]
    assert failure.message.startswith("SW002 ")
    assert failure.message.endswith(" (and 1 more)")
    assert failure.type == "SW002"
    assert failure.text.count("hint: ") == 2
    assert f"\nspec/tiny/stages.yaml:{LINES + 2}:1: SW002 duplicate key controllers" in failure.text


@pytest.mark.parametrize("format", MACHINE)
def test_a_missing_protocol_is_reported_in_every_format(
    stagewire: Stagewire, spec: Path, format: str
) -> None:
    """A diagnostic about something that is not a file of the spec is not lost."""
    Path("empty").mkdir()
    result = stagewire("check", "empty", "--format", format)
    assert result.code == 1
    if format == "json":
        [found] = as_data(result.out)["diagnostics"]
        assert (found["file"], found["code"]) == ("empty", "SW006")
    elif format == "github":
        [command] = workflow_commands(result.out)
        assert command.properties["title"].startswith("SW006: ")
    else:
        [case] = as_cases(result.out).values()
        assert (case.name, case.is_passed) == ("empty", False)


def test_hostile_names_are_escaped_in_json(stagewire: Stagewire, hostile: Path) -> None:
    out = stagewire("check", hostile, "--format", "json").out
    assert all(c.isprintable() or c == "\n" for c in out)
    [found] = [d for d in as_data(out)["diagnostics"] if d["code"] == "SW002"]
    assert found["file"] == f"spec/tiny/messages/{HOSTILE}"
    assert found["message"].startswith(f"duplicate key {HOSTILE}")


def test_hostile_names_are_escaped_on_github(stagewire: Stagewire, hostile: Path) -> None:
    Path(".git").mkdir()
    out = stagewire("check", hostile, "--format", "github").out
    assert all(c.isprintable() or c == "\n" for c in out)
    [command] = [c for c in workflow_commands(out) if c.properties["title"].startswith("SW002")]
    assert set(command.properties) == {"file", "line", "col", "title"}
    assert command.properties["file"] == "spec/tiny/messages/" + HOSTILE.replace(
        "\n", "\\n"
    ).replace("\x1b", "\\x1b").replace("\u202e", "\\u202e")
    assert command.message.startswith("duplicate key a\\n::error file=x::b%0A,c]]>&<d>\"'\\x1b[2J")


def test_hostile_names_are_escaped_in_junit(stagewire: Stagewire, hostile: Path) -> None:
    out = stagewire("check", hostile, "--format", "junit").out
    assert all(c.isprintable() or c == "\n" for c in out)
    cases = as_cases(out)
    [name] = [name for name, case in cases.items() if not case.is_passed]
    assert name.startswith("spec/tiny/messages/a\\n::error file=x::b%0A,c]]>&<d>\"'\\x1b[2J")
    [failure] = cases[name].result
    assert "::error file=x::b%0A,c]]>&<d>" in failure.text


@pytest.mark.parametrize("format", MACHINE)
def test_a_hostile_message_is_escaped(spec: Path, format: str) -> None:
    found = [Diagnostic(Place("spec/tiny/units.yaml"), "SW002", HOSTILE, HOSTILE)] * 2
    out = written(Report(find_spec(spec), found), ReportFormat(format))
    assert all(c.isprintable() or c == "\n" for c in out)
    if format == "json":
        said = [(d["message"], d["hint"]) for d in as_data(out)["diagnostics"]]
        assert said == [(HOSTILE, HOSTILE)] * 2
    elif format == "github":
        assert len(workflow_commands(out)) == 2
    else:
        [failure] = as_cases(out)["spec/tiny/units.yaml"].result
        assert "]]>&<d>\"'\\x1b[2J\\u202e.yaml (and 1 more)" in failure.message


@pytest.mark.parametrize("format", MACHINE)
def test_a_file_name_that_is_not_text_is_reported(
    stagewire: Stagewire, spec: Path, format: str
) -> None:
    """Some systems have file names that are not valid text."""
    folder = os.fsencode(spec / "tiny" / "messages")
    with open(os.path.join(folder, b"\xff\xfe.yaml"), "wb") as file:
        file.write(b"{")
    result = stagewire("check", spec, "--format", format)
    assert result.code == 1
    assert result.out.isascii()
    parse = {"json": as_data, "github": workflow_commands, "junit": as_cases}[format]
    assert parse(result.out)


@pytest.mark.parametrize("encoding", ["latin-1", "ascii"])
@pytest.mark.parametrize("format", MACHINE)
def test_reports_do_not_depend_on_the_encoding(
    spec: Path, monkeypatch: pytest.MonkeyPatch, format: str, encoding: str
) -> None:
    """JSON and XML are the same bytes on every terminal."""
    (spec / "tiny" / "messages" / "größe µ.yaml").write_text("{", encoding="utf-8")
    raw = io.BytesIO()
    monkeypatch.setattr("sys.stdout", stream := io.TextIOWrapper(raw, encoding=encoding))
    assert main(["check", str(spec), "--format", format]) == 1
    stream.flush()
    if format == "json":
        [found] = json.loads(raw.getvalue())["diagnostics"]
        assert found["file"].endswith("größe µ.yaml")
    elif format == "junit":
        assert "spec/tiny/messages/größe µ.yaml" in as_cases(raw.getvalue().decode("ascii"))
    else:
        assert len(workflow_commands(raw.getvalue().decode(encoding))) == 1


@pytest.mark.parametrize("format", ["text", *MACHINE])
def test_a_report_can_be_written_to_a_file(stagewire: Stagewire, broken: Path, format: str) -> None:
    """Standard output stays empty, and the file has the whole report."""
    wanted = stagewire("check", broken, "--format", format)
    result = stagewire("check", broken, "--format", format, "--output", "report")
    assert (result.code, result.out, result.err) == (1, "", wanted.err)
    assert Path("report").read_text(encoding="utf-8") == wanted.out
    assert not list(Path().glob(".report*"))


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--format", "xml"], "'xml' is not one of"),
        (["--output", "."], "--output"),
        (["--output", "nowhere/report"], "missing folder"),
        (["--explain", "SW999"], "unknown code SW999; did you mean SW"),
        (["--explain", "31"], "unknown code 31; codes are SW001 to SW"),
        (["--explain", "\x1b[2J"], "unknown code \\x1b[2J"),
        (["--explain", "SW0311"], "SW031"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_wrong_arguments_are_refused(
    stagewire: Stagewire, spec: Path, arguments: list[str], said: str
) -> None:
    result = stagewire("check", spec, *arguments)
    assert (result.code, result.out) == (2, "")
    assert said in result.err


@pytest.mark.parametrize("name", CODES)
def test_explain_prints_the_cause_and_the_cure(stagewire: Stagewire, name: str) -> None:
    """No spec is read, and codes are accepted in any case."""
    code = CODES[name]
    result = stagewire("check", "nowhere", "--explain", name.lower())
    assert result.code == 0
    assert result.out.splitlines() == [
        f"{name}: {code.title}",
        f"cause: {code.cause}",
        f"cure: {code.hint}",
        f"docs/diagnostics.md#{name.lower()}",
    ]


def test_a_file_in_its_old_place_is_named_in_one_line(stagewire: Stagewire, spec: Path) -> None:
    old = Path("conformance/captures/tiny.yaml")
    old.parent.mkdir(parents=True)
    (spec / "tiny" / "captures.yaml").rename(old)
    done = stagewire("check", "spec")
    assert done.code == 0
    assert done.err == (
        "warning: move conformance/captures/tiny.yaml to spec/tiny/captures.yaml; the next release will not "
        "read the old place\n"
    )
