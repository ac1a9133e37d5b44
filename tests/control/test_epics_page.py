"""The page about EPICS: its bench runs, its commands work, and its fields are those of the motor record."""

from __future__ import annotations

import configparser
import os
import re
import shlex
import subprocess
import sysconfig
import tomllib
from pathlib import Path

import ca
import pytest

from checkout import ROOT
from markdown_blocks import blocks
from stagewire_cli.main import main
from stagewire_epics.bench import Bench, read_bench
from stagewire_epics.fields import FIELDS
from stagewire_epics.ioc import Ioc
from stagewire_epics.motor import Motor
from stagewire_epics.velocity import MotorSettings

PAGE = ROOT / "docs" / "how-to" / "epics.md"
CODE = {
    language: [b.text for b in blocks(PAGE) if b.language == language]
    for language in ("toml", "sh", "ini")
}
BENCH, ACCESS = CODE["toml"]


def test_the_commands_of_the_page_read_and_move(tmp_path: Path) -> None:
    shown = [line.partition("#")[0].strip() for line in CODE["sh"][1].splitlines()]
    assert shown[0] == "stagewire ioc lab.toml"
    scripts = Path(sysconfig.get_path("scripts"))
    environment = {
        **os.environ,
        "EPICS_CA_SERVER_PORT": str(ca.PORT),
        **dict([shown[1].removeprefix("export ").split("=")]),
    }
    printed = []
    with ca.ioc(tmp_path, BENCH) as one:
        one.wait_for("focus: TDC001")
        one.wait_for("rack: BBD102")
        for line in shown[2:4]:
            name, *arguments = shlex.split(line)
            done = subprocess.run(
                [scripts / name, "-w", "20", *arguments],
                check=True, capture_output=True, text=True, timeout=30, env=environment,
            )  # fmt: skip
            printed.append(done.stdout)
        assert one.end() == 0
    assert re.search(r"LAB:x\.RBV +\[0\]", printed[0])
    assert "mm" in printed[0]
    assert re.search(r"New : +LAB:x .*\[5\.\]", printed[1]), printed[1]


def test_the_bench_and_the_table_of_access_are_valid(tmp_path: Path) -> None:
    (tmp_path / "lab.toml").write_text(BENCH + ACCESS)
    bench = read_bench(tmp_path / "lab.toml")
    assert bench.access.users == ["operator"]
    assert list(Ioc(bench).motors) == ["LAB:x", "LAB:y", "LAB:z"]


def test_the_records_of_parameters_exist_for_the_bench_of_the_page(tmp_path: Path) -> None:
    added = BENCH.replace("bay = 1", 'bay = 1\nparameters = "all"\nstatus = true')
    (tmp_path / "lab.toml").write_text(added)
    names = re.findall(r"^\| `(LAB:x:[A-Z:_]+)` \|", PAGE.read_text("utf-8"), re.MULTILINE)
    assert len(names) == 5
    assert {*names} <= Ioc(read_bench(tmp_path / "lab.toml")).records.keys()


def test_the_service_runs_the_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    unit = configparser.ConfigParser()
    unit.read_string(CODE["ini"][0])
    _, *arguments = shlex.split(unit["Service"]["ExecStart"])
    (tmp_path / "lab.toml").write_text(BENCH)
    arguments[1] = str(tmp_path / "lab.toml")
    assert main([*arguments, "--list-pvs"]) == 0
    assert "LAB:z.RBV" in capsys.readouterr().out.splitlines()


def test_the_page_lists_each_field_and_says_which_are_writable() -> None:
    rows = re.findall(r"^\| ([A-Z, ]+) \| (.*) \|$", PAGE.read_text("utf-8"), re.MULTILINE)
    listed = {field: text for fields, text in rows for field in fields.split(", ")}
    assert listed.keys() == {field.name for field in FIELDS}
    motor = Motor("x", "", MotorSettings(), lambda _: None)
    writable = {name for name, record in motor.records.items() if record.writable}
    assert {name for name, text in listed.items() if "writable" in text} == writable


def test_the_keys_of_the_page_are_those_of_a_motor() -> None:
    table = Bench.model_validate(tomllib.loads(BENCH)).motors["x"]
    rows = re.findall(r"^\| (`.*?) \| ", PAGE.read_text("utf-8"), re.MULTILINE)
    named = {key for row in rows for key in re.findall(r"`(\w+)`", row)}
    assert named >= type(table).model_fields.keys() - {"parameters", "status"}
