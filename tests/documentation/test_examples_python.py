"""The scripts and the notebook of ``examples/python`` work without hardware, and their results are right."""

from __future__ import annotations

import csv
import json
import subprocess
import sys
from pathlib import Path

import pytest

import stagewire_virtual as virtual
from checkout import ROOT
from stagewire_apt import stages

EXAMPLES = ROOT / "examples" / "python"
ELSEWHERE = {
    "home_and_move.py": "make demo",
    "in_memory.py": "tests/virtual/test_virtual_documents.py",
    "move.py": "tests/virtual/test_virtual_documents.py",
}
RUN = {
    "two_axes.py": "x 4.000 mm, y 1.000 mm after ",
    "piezo_ramp.py": " 30 V asked,  30.00 V at the output",
    "log_and_plot.py": "plotted in move.png",
    "recover.py": "the line was lost\nhoming again\nat 0.6000 mm\nat 0.8000 mm\n",
    "with_asyncio.py": "rows in axes.csv",
}
"""Script -> a part of its output, without arguments."""


def output_of(script: str, folder: Path, *arguments: str) -> str:
    done = subprocess.run(
        [sys.executable, EXAMPLES / script, *arguments],
        capture_output=True,
        text=True,
        cwd=folder,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_every_script_is_run() -> None:
    assert {path.name for path in EXAMPLES.glob("*.py")} == RUN.keys() | ELSEWHERE.keys() | {
        "scan.py"
    }


@pytest.mark.parametrize("script", RUN)
def test_a_script_works_without_hardware(script: str, tmp_path: Path) -> None:
    if script == "log_and_plot.py":
        pytest.importorskip("matplotlib")
    assert RUN[script] in output_of(script, tmp_path)


def test_the_scan_writes_twenty_rows(tmp_path: Path) -> None:
    output_of("scan.py", tmp_path)
    with (tmp_path / "scan.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 20
    assert max(rows, key=lambda row: float(row["signal"]))["position_mm"][:3] == "1.2"


def test_a_script_takes_the_url_of_a_controller(tmp_path: Path) -> None:
    with virtual.BBD102(stage=stages.MLS203) as rack, rack.tcp() as served:
        output_of("with_asyncio.py", tmp_path, served.url, "mine.csv")
    assert (tmp_path / "mine.csv").read_text().startswith("time_s,wall_clock,part,position_mm,")


def test_the_notebook_is_kept_without_outputs() -> None:
    notebook = json.loads((EXAMPLES / "notebook.ipynb").read_text(encoding="utf-8"))
    cells = [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]
    assert len(cells) >= 4
    assert [(cell["outputs"], cell["execution_count"]) for cell in cells] == [([], None)] * len(
        cells
    )


@pytest.mark.matrix
def test_the_notebook_runs(tmp_path: Path) -> None:
    pytest.importorskip("ipykernel")
    pytest.importorskip("nbconvert")
    command = ("-m", "nbconvert", "--to", "notebook", "--execute", "--output-dir", str(tmp_path))
    done = subprocess.run(
        [sys.executable, *command, EXAMPLES / "notebook.ipynb"], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    text = (tmp_path / "notebook.ipynb").read_text(encoding="utf-8")
    assert "TDC001: One-channel T-Cube DC servo driver" in text
    assert '"image/png"' in text
