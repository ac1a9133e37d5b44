"""Code for some units only: `stagewire generate --unit`."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from checkout import ROOT
from stagewire.protocols import load_protocol
from stagewire_cli.main import main
from stagewire_generator import check, reduced, render
from stagewire_generator.output import write
from stagewire_generator.pipeline import CheckedSpec

SPEC = ROOT / "spec"
REGISTRY: dict[str, Any] = load_protocol("thorlabs_apt").registry()
UNITS = {unit["name"]: unit for unit in REGISTRY["units"]}
ALIASES = sorted(name for name, alias in REGISTRY["aliases"].items() if "like" in alias)
SAMPLE = ("TDC001", "BPC301", "MST601", "KST101", "MS2000")
OTHERS = sorted({*UNITS, *ALIASES, "MFC2000"} - {*SAMPLE})
PROGRAM = """
import sys, {package}
from stagewire_cli.main import main
assert [name for name in {package}.__all__ if name.isupper()] == {exported}
assert {package}.{unit}.__doc__
sys.exit(main(["conformance", "examples", "--protocol", "{protocol}"]))
"""


@pytest.fixture(scope="module")
def spec() -> CheckedSpec:
    return check(SPEC)


@pytest.mark.parametrize(
    "unit", [*SAMPLE, *(pytest.param(unit, marks=pytest.mark.matrix) for unit in OTHERS)]
)
def test_code_for_one_unit_is_complete(spec: CheckedSpec, tmp_path: Path, unit: str) -> None:
    """All targets render, the package has one class, and the remaining examples pass."""
    protocol = spec[0 if unit in ("MS2000", "MFC2000") else 1]
    left = reduced(protocol, [unit])
    render([left], ["c", "c-tests"])
    write(tmp_path, render([left], ["python"]))
    like = REGISTRY["aliases"].get(unit, {}).get("like", unit)
    program = PROGRAM.format(
        package=left.package,
        protocol=left.name,
        unit=like,
        exported=sorted(["PROTOCOL", like]),
    )
    done = subprocess.run(
        [sys.executable, "-c", program],
        env={**os.environ, "PYTHONPATH": str(tmp_path / "python")},
        capture_output=True,
        encoding="utf-8",
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert " 0 failed" in " ".join(done.stdout.split())


def test_a_setting_that_no_message_reports_is_kept(spec: CheckedSpec) -> None:
    setting = {"unit": "mA", "page": 1, "summary": "A range that the user selects.", "told_by": {}}
    protocol = replace(spec[1], settings={**spec[1].settings, "range": setting})
    settings = reduced(protocol, ["MST601"]).settings
    assert "range" in settings
    assert "maximum_volts" not in settings  # only piezo controllers report it


def registry(spec: CheckedSpec, *units: str) -> dict[str, Any]:
    [text] = render([reduced(spec[1], units)], ["registry"]).values()
    loaded: dict[str, Any] = json.loads(text)
    return loaded


def test_the_code_has_the_messages_of_the_units_and_those_of_every_unit(spec: CheckedSpec) -> None:
    left = registry(spec, "TDC001", "TSC001")
    assert [unit["name"] for unit in left["units"]] == ["TDC001", "TSC001"]
    wanted = {*UNITS["TDC001"]["messages"], *UNITS["TSC001"]["messages"], "HW_RICHRESPONSE"}
    assert {message["name"] for message in left["messages"]} == wanted
    whole = {message["name"]: message for message in REGISTRY["messages"]}
    for message in left["messages"]:
        before = {**whole[message["name"]], "exchange": None}
        assert for_any_unit({**message, "exchange": None}) == for_any_unit(before)
    assert {stage["name"] for stage in left["stages"]} == {*UNITS["TDC001"]["stages"]}


@pytest.mark.parametrize(
    ("unit", "sources", "bits"),
    [
        ("KLS635", "kcube_laser_source", "kls_status_bits"),
        ("TLS001", "laser_source", "la_status_bits"),
    ],
)
def test_the_tables_of_the_only_unit_are_those_of_the_fields(
    spec: CheckedSpec, unit: str, sources: str, bits: str
) -> None:
    headers = "".join(render([reduced(spec[1], [unit])], ["c"]).values())
    assert f"enum apt_{sources} {{" in headers
    assert set(re.findall(r"see enum apt_(\w*laser_source)\b", headers)) == {sources}
    assert set(re.findall(r"[Bb]its APT_(\w+)_\.\.\.", headers)) >= {bits.upper()}
    others = {"KLS_STATUS_BITS", "LA_STATUS_BITS"} - {bits.upper()}
    assert not others & set(re.findall(r"[Bb]its APT_(\w+)_\.\.\.", headers))


def for_any_unit(value: Any) -> Any:
    """Return JSON without the tables of other units."""
    if isinstance(value, list):
        return [for_any_unit(item) for item in value]
    if not isinstance(value, dict):
        return value
    return {key: for_any_unit(item) for key, item in value.items() if not key.endswith("_by_unit")}


def names_in(value: Any) -> set[str]:
    """Return all texts in JSON, except keys."""
    if isinstance(value, str):
        return {value}
    items = value.values() if isinstance(value, dict) else value if isinstance(value, list) else ()
    return set().union(*map(names_in, items))


def test_exchanges_and_sets_name_no_message_that_is_left_out(spec: CheckedSpec) -> None:
    left = registry(spec, "TSG001")
    kept = {message["name"] for message in left["messages"]}
    every = {message["name"] for message in REGISTRY["messages"]}
    for part in ([m["exchange"] for m in left["messages"]], left["sets"], left["settings"]):
        assert names_in(part) & every <= kept


def test_the_command_reduces_a_package_with_an_overlay(tmp_path: Path) -> None:
    command = ["generate", "--spec", str(SPEC), "--out", str(tmp_path), "--unit", "kdc101"]
    assert main([*command, "--overlay", "thorlabs_apt/issue_37", "--target", "registry"]) == 0
    [path] = (tmp_path / "registry").iterdir()
    left = json.loads(path.read_text(encoding="utf-8"))
    assert [unit["name"] for unit in left["units"]] == ["KDC101"]
    assert left["known_prefixes"].keys() <= {"27"}
    names = {message["name"] for message in left["messages"]}
    assert "MOT_SET_DCPIDPARAMS" in names
    assert "MOT_SET_PMDPOSITIONLOOPPARAMS" not in names


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--unit", "TDC01"], "--unit TDC01: unknown unit (did you mean TDC001 or "),
        (["--unit", "?"], "--unit ?: unknown unit (choose from BBD101, "),
        (
            ["--unit", "KLC101", "--overlay", "thorlabs_apt/issue_37"],
            "--unit KLC101: this unit is not supported: No known document",
        ),
    ],
)
def test_another_unit_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], options: list[str], words: str
) -> None:
    out = tmp_path / "out"
    assert main(["generate", "--spec", str(SPEC), "--out", str(out), *options]) == 2
    assert words in capsys.readouterr().err
    assert not out.exists()
