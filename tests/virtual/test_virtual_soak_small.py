"""A small soak test: no update is missing. ``make soak`` also checks times, on a quiet machine."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from checkout import ROOT

pytestmark = pytest.mark.matrix


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="reads memory from /proc")
def test_96_controllers_miss_no_update_in_two_seconds() -> None:
    soak = ROOT / "benchmarks" / "virtual_soak.py"
    done = subprocess.run(
        [sys.executable, str(soak), "--controllers", "96", "--seconds", "2", "--quick"],
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    found = re.search(r"96 controllers +(\d+) updates  0 missing", done.stdout)
    assert found, done.stdout
    assert int(found[1]) >= 96 * 19  # the updates of two seconds, give or take one
