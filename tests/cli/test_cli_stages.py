"""Stages of the command: values of ``decode --stage``, and stages of the user in ``--stages FILE``."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from conftest import Stagewire

POSITION = "12 04 06 00 81 50 01 00 00 86 00 00"  # 34304 counts
SLIDE = """
[slide]
unit = "mm"
travel = 50
max_velocity = 2.4
[slide.counts_per_unit]
position = "34304/3"
velocity = 100000
acceleration = "13.7"
"""


@pytest.fixture
def slide(tmp_path: Path) -> str:
    path = tmp_path / "stages.toml"
    path.write_text(SLIDE)
    return str(path)


@pytest.fixture
def stream(tmp_path: Path) -> str:
    path = tmp_path / "stream.bin"
    path.write_bytes(bytes.fromhex(POSITION) * 2)
    return str(path)


def test_a_frame_has_the_position_in_the_unit_of_the_stage(stagewire: Stagewire) -> None:
    result = stagewire("decode", "--stage", "Z8", "--unit", "tdc001", POSITION)
    assert " 1 mm" in result.out
    rotary = stagewire("decode", "--stage", "PRM1-Z8", "--unit", "TDC001", POSITION)
    assert " deg" in rotary.out


def test_each_format_has_values_of_the_stage(stagewire: Stagewire, stream: str, slide: str) -> None:
    def decoded(*options: str) -> str:
        result = stagewire("decode", "--stage", "slide", "--stages", slide, stream, *options)
        assert result.code == 0, result.err
        return result.out

    assert "position=34304 position_mm=3\n" in decoded()
    lines = [json.loads(line) for line in decoded("--json").splitlines()]
    assert [line["engineering"] for line in lines] == [{"position_mm": 3.0}] * 2
    [first, _] = csv.DictReader(decoded("--format", "csv").splitlines())
    assert json.loads(first["engineering"]) == {"position_mm": 3.0}
    typed = decoded("--format", "csv", "--message", "MOT_GET_POSCOUNTER")
    assert [row["position_mm"] for row in csv.DictReader(typed.splitlines())] == ["3.0", "3.0"]


def test_a_capture_names_the_controller_of_the_stage(stagewire: Stagewire, tmp_path: Path) -> None:
    log = tmp_path / "log.txt"
    moved = stagewire("move", "virtual://TDC001?stage=Z8", "--stage", "Z8", "--to", "1", "--yes")
    assert moved.code == 0, moved.err
    watched = stagewire("monitor", "virtual://TDC001?stage=Z8", "--for", "0.3", "--log", str(log))
    assert watched.code == 0, watched.err
    assert "position_mm=" in stagewire("decode", str(log), "--stage", "Z8").out


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (
            ["--stage", "Z8"],
            "--stage: the scales of Z8 depend on the controller; name it with --unit",
        ),
        (["--stage", "Z8", "--unit", "BSC103"], "--stage: the scales of Z8 on BSC103 are unknown"),
        (["--stage", "Z88"], "--stage: unknown stage Z88; did you mean Z8"),
        (["--unit", "TDC001"], "--unit requires --stage"),
        (["--stage", "LTS300", "--unit", "LTS300"], "use --scale-source "),
        (["--stage", "NRT", "--stages", "missing.toml"], "--stages missing.toml: No such file"),
    ],
)
def test_a_stage_without_scales_is_refused(
    stagewire: Stagewire, options: list[str], said: str
) -> None:
    result = stagewire("decode", *options, POSITION)
    assert result.code == 2
    assert said in result.err


def test_commands_use_stages_of_a_file(stagewire: Stagewire, slide: str) -> None:
    own = ("--stages", slide, "--stage", "SLIDE")
    moved = stagewire("move", "virtual://TDC001", *own, "--to", "0.1", "--yes")
    assert moved.out.endswith("it is at 0.1000 mm\n"), moved.err
    homed = stagewire("home", "virtual://TDC001", *own, "--yes")
    assert "will home from 0.0000 mm" in homed.out, homed.err
    watched = stagewire("monitor", "virtual://TDC001", *own, "--for", "0.3")
    assert "position_mm=" in watched.out
    served = stagewire("virtual", "TDC001", *own, "--for", "0.01")
    assert served.code == 0, served.err


def test_a_limit_of_a_stage_of_a_file_is_kept(stagewire: Stagewire, slide: str) -> None:
    result = stagewire(
        "move", "virtual://TDC001", "--stages", slide, "--stage", "slide", "--to", "51", "--yes"
    )
    assert result.code != 0
    assert "51 mm" in result.err


def test_the_environment_names_a_file_of_stages(
    stagewire: Stagewire, slide: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("STAGEWIRE_STAGES", slide)
    assert " 3 mm" in stagewire("decode", "--stage", "slide", POSITION).out
    unknown = stagewire("move", "virtual://TDC001", "--stage", "slid", "--to", "1", "--yes")
    assert "unknown stage slid; did you mean slide?" in unknown.err


def test_an_invalid_file_of_stages_is_refused(stagewire: Stagewire, tmp_path: Path) -> None:
    path = tmp_path / "stages.toml"
    path.write_text(SLIDE.replace("travel", "travle"))
    result = stagewire("decode", "--stages", str(path), "--stage", "slide", POSITION)
    assert result.code == 2
    assert f"--stages {path}: slide.travle: unknown key; did you mean travel?" in result.err


def test_a_pics_names_a_stage_of_a_file(stagewire: Stagewire, slide: str, tmp_path: Path) -> None:
    pics = tmp_path / "pics.toml"
    pics.write_text(
        'schema_version = 1\nunit = "TDC001"\n\n[[channel]]\nstage = "Slide"\ntravel = "0..5mm"\n'
    )
    arguments = (
        "conformance",
        "device",
        "virtual://TDC001",
        "--pics",
        str(pics),
        "--only",
        "status",
    )
    checked = stagewire(*arguments, "--stages", slide)
    assert checked.code == 0, checked.err
    refused = stagewire(*arguments)
    assert refused.code == 2
    assert "unknown stage 'Slide'" in refused.err


def test_a_bench_names_a_stage_of_a_file(stagewire: Stagewire, slide: str, tmp_path: Path) -> None:
    bench = tmp_path / "bench.toml"
    bench.write_text('[[unit]]\nname = "TDC001"\nstage = "Slide"\n')
    arguments = ("virtual", "--bench", str(bench), "--for", "0.01")
    assert stagewire(*arguments, "--stages", slide).code == 0
    refused = stagewire(*arguments)
    assert refused.code == 2
    assert "has no stage Slide" in refused.err


@pytest.mark.parametrize(
    "command",
    [
        ["move", "virtual://TDC001", "--by", "1", "--yes", "--unit"],
        ["conformance", "device", "--list", "--unit"],
        ["decode", POSITION, "--stage", "Z8", "--unit"],
        ["doctor", "virtual://TDC001", "--unit"],
        ["virtual"],
    ],
)
def test_each_command_suggests_units(stagewire: Stagewire, command: list[str]) -> None:
    result = stagewire(*command, "KDC110")
    assert result.code == 2
    assert "unknown unit KDC110; did you mean KDC101" in result.err
