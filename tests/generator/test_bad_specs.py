"""One broken spec for each diagnostic: exactly the expected messages, exit status 1, nothing written.

The first comments of a broken file give the expected messages (``# expect: file:line:column: code message``)
and the file of the good spec that it replaces (``# replaces: messages/core.yaml``). A folder is copied over
the good spec, and one of its files has the expected messages. The good spec is the one with framed messages,
unless another is named (``# over: good_commands``). A spec that is only wrong as a change is compared with a
good spec (``# against: good_spec``).
"""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest

from stagewire_cli.main import main
from stagewire_generator.codes import CODES
from stagewire_generator.diagnostics import SpecError
from stagewire_generator.pipeline import check

HERE = Path(__file__).parent
BAD = HERE / "bad_specs"
CASES = sorted(BAD.iterdir())
_EXPECT = re.compile(r"^# expect: (.*)$", re.MULTILINE)
_REPLACES = re.compile(r"^# replaces: (\S+)$", re.MULTILINE)
_OVER = re.compile(r"^# over: (\S+)$", re.MULTILINE)
_AGAINST = re.compile(r"^# against: (\S+)$", re.MULTILINE)
PROTOCOLS = {
    "good_spec": "tiny",
    "good_layouts": "laser",
    "good_commands": "turtle",
    "good_packets": "carousel",
}


def texts(case: Path) -> dict[Path, str]:
    files = [case] if case.is_file() else sorted(p for p in case.rglob("*") if p.is_file())
    return {path: path.read_bytes().decode("utf-8", "replace") for path in files}


def expected(case: Path) -> list[str]:
    return [line for text in texts(case).values() for line in _EXPECT.findall(text)]


def over(case: Path) -> str:
    """Return the name of the good spec that a case is copied over."""
    [name] = [n for text in texts(case).values() for n in _OVER.findall(text)] or ["good_spec"]
    return name


def against(case: Path) -> Path | None:
    """Return the good spec to compare a case with; None if the case is wrong on its own."""
    [name] = [n for text in texts(case).values() for n in _AGAINST.findall(text)] or [None]
    return HERE / name if name else None


def apply(case: Path, spec: Path) -> None:
    if case.is_dir():
        shutil.copytree(case, spec, dirs_exist_ok=True)
        return
    found = _REPLACES.findall(texts(case)[case])
    assert len(found) == 1, f"{case.name} does not say what it replaces"
    shutil.copyfile(case, spec / PROTOCOLS[over(case)] / found[0])


@pytest.mark.parametrize("name", PROTOCOLS)
def test_the_good_spec_has_no_errors(name: str) -> None:
    assert [protocol.name for protocol in check(HERE / name)] == [PROTOCOLS[name]]


def test_every_code_has_a_bad_spec() -> None:
    found = {line.split(" ")[1] for case in CASES for line in expected(case)}
    assert found == set(CODES)


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.stem)
def test_a_bad_spec_has_the_expected_messages(
    case: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    spec = Path(shutil.copytree(HERE / over(case), tmp_path / "spec"))
    apply(case, spec)
    monkeypatch.chdir(spec)  # the command prints file names relative to the current folder
    wanted = expected(case)
    assert case.stem.split("-")[0].upper() in {line.split(" ")[1] for line in wanted}
    out = tmp_path / "generated"
    good = against(case)
    command = ["generate", "--spec", str(spec), "--out", str(out)]
    assert main(["check", str(spec), "--against", str(good)] if good else command) == 1
    said = capsys.readouterr().out
    assert [line for line in said.splitlines() if not line.startswith("    ")] == wanted
    assert said.count("\n    hint: ") == len(wanted)
    assert not out.exists()


def test_the_command_check_prints_the_same_messages(
    spec: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(spec)
    assert main(["check", str(spec)]) == 0
    case = BAD / "sw004-plain-words.yaml"
    apply(case, spec)
    capsys.readouterr()
    assert main(["check", str(spec)]) == 1
    said = capsys.readouterr().out
    assert [line for line in said.splitlines() if not line.startswith("    ")] == expected(case)


def test_a_protocol_can_be_given_by_its_own_folder(
    good_spec: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The examples are found and the places are the same, however the folder is given."""
    assert check(good_spec / "tiny")[0].examples
    monkeypatch.chdir(good_spec / "tiny")
    protocol = check(Path())[0]
    assert protocol.examples
    assert protocol.messages[0].place.file == "tiny/messages/core.yaml"


def test_a_folder_without_a_protocol_is_an_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("empty").mkdir()
    with pytest.raises(SpecError) as caught:
        check(Path("empty"))
    assert [str(d).splitlines()[0] for d in caught.value.diagnostics] == [
        "empty:1:1: SW006 no protocol.yaml in this directory or directly below it"
    ]


def test_a_folder_in_the_place_of_a_file_is_an_error(spec: Path) -> None:
    (spec / "tiny" / "units.yaml").unlink()
    (spec / "tiny" / "units.yaml").mkdir()
    with pytest.raises(SpecError) as caught:
        check(spec)
    [found] = caught.value.diagnostics
    assert (str(found.place), found.code) == ("tiny/units.yaml:1:1", "SW008")


def test_a_spec_cannot_bring_looser_schemas(spec: Path) -> None:
    (spec / "schema").mkdir()
    for kind in ("protocol", "messages"):
        (spec / "schema" / f"{kind}.schema.json").write_text("{}")
    case = BAD / "sw010-bad-name.yaml"
    apply(case, spec)
    with pytest.raises(SpecError) as caught:
        check(spec)
    assert [str(d).splitlines()[0] for d in caught.value.diagnostics] == expected(case)


def test_a_run_reports_the_errors_of_all_files(spec: Path) -> None:
    """The errors are sorted by file and line."""
    names = ["sw001-syntax", "sw002-duplicate-key", "sw004-long-number", "sw010-wrong-type"]
    for name in names:
        apply(BAD / f"{name}.yaml", spec)
    with pytest.raises(SpecError) as caught:
        check(spec)
    found = caught.value.diagnostics
    assert {d.code for d in found} == {"SW001", "SW002", "SW004", "SW010"}
    assert found == sorted(found)
    wanted = sorted(line for name in names for line in expected(BAD / f"{name}.yaml"))
    assert sorted(str(d).splitlines()[0] for d in found) == wanted
