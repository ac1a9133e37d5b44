"""The page on virtual controllers lists every action of faults, and the examples work."""

from __future__ import annotations

import re
import runpy
import subprocess
import sys

import pytest

import stagewire_virtual as virtual
from checkout import ROOT

EXAMPLES = ROOT / "examples/python"
TEXT = (ROOT / "docs/how-to/virtual.md").read_text(encoding="utf-8")


def test_every_action_is_on_the_page() -> None:
    from stagewire_virtual.faults.fault import ACTIONS

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
