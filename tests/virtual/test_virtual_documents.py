"""What the pages and the examples show works as they show it."""

from __future__ import annotations

import re
import runpy
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import stagewire_virtual as virtual
from stagewire_virtual.serving.bench import load_bench

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "examples/python"
TEXT = (ROOT / "docs/virtual.md").read_text(encoding="utf-8")
SESSION = """\
# stagewire capture 1 protocol=thorlabs_apt unit=TDC001
0.000000 > 11 02 01 00 50 01
0.001000 < 12 02 01 01 01 50
"""


def blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", TEXT, re.M | re.S)


@pytest.mark.skipif(sys.platform == "win32", reason="needs pseudo-terminals")
def test_the_programs_of_the_page(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("session.txt").write_text(SESSION)

    def the_driver(controller: virtual.VirtualController) -> None:
        controller.write(bytes.fromhex("11 02 01 00 50 01"))

    names: dict[str, Any] = {"my_driver_does_what_the_user_did": the_driver}
    for block in blocks("python"):
        exec(compile(block, "docs/virtual.md", "exec"), names)
    assert capsys.readouterr().out == "1.5 mm\n"
    names["test_a_completion_without_status"](virtual)


def test_the_bench_of_the_page(tmp_path: Path) -> None:
    [text] = blocks("toml")
    (tmp_path / "bench.toml").write_text(text)
    bench = load_bench(tmp_path / "bench.toml")
    assert [unit.label for unit in bench.units] == ["x stage", "BSC103", "RACK", "MS2000"]


def test_the_faults_of_the_page() -> None:
    listed = next(block for block in blocks("text") if "noise" in block)
    texts = [line.partition("#")[0].strip() for line in listed.splitlines()]
    assert len(texts) == 5
    with virtual.TDC001(faults=texts) as tdc:
        assert tdc.read() == b""


def test_every_action_is_on_the_page() -> None:
    from stagewire_virtual.faults.keys import ACTIONS

    rows = re.findall(r"^\| `([a-z]+)` \|", TEXT, re.M)
    assert rows == [action.value for action in ACTIONS]


def test_the_example_in_memory(capsys: pytest.CaptureFixture[str]) -> None:
    runpy.run_path(str(EXAMPLES / "in_memory.py"), run_name="__main__")
    said = [line.split(maxsplit=2)[2] for line in capsys.readouterr().out.splitlines()]
    assert said[-1] == "< MOT_GET_DCSTATUSUPDATE  1.5000 mm"
    assert "< MOT_MOVE_HOMED" in said


def test_the_example_over_a_line() -> None:
    from stagewire_apt import stages

    with (
        virtual.TDC001(stage=stages.Z8, position=20_000) as tdc,
        tdc.tcp() as served,
    ):
        done = subprocess.run(
            [sys.executable, EXAMPLES / "move.py", served.url, "0.2"],
            capture_output=True,
            text=True,
            timeout=60,
        )
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.splitlines()[1:] == ["homed", "at 0.2000 mm"]
