"""Short soaks of sessions: nothing is lost or mispaired. ``make soak`` judges time and memory."""

from __future__ import annotations

import subprocess
import sys

import pytest

from checkout import ROOT

pytestmark = pytest.mark.matrix

PROGRAMS = {
    "endurance": (["--hours", "0.05", "--quick"], "10 axes for 0.05 h: 18,000 updates"),
    "many_sessions": (
        ["--controllers", "96", "--seconds", "2", "--quick"],
        "96 sessions in one process",
    ),
    "threads": (["--calls", "200"], "8 threads x 200 calls with a reader thread: 0 mispaired"),
}


@pytest.mark.parametrize("program", PROGRAMS)
def test_a_short_soak(program: str) -> None:
    arguments, said = PROGRAMS[program]
    done = subprocess.run(
        [sys.executable, str(ROOT / "benchmarks" / f"{program}.py"), *arguments],
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert said in done.stdout
