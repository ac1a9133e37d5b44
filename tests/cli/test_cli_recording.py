"""``--csv`` and ``--plot`` of ``move``, ``home`` and ``jog``: the files, however the motion ends."""

from __future__ import annotations

import csv
import re
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from attached_controller import URL, Written, attached

import stagewire_virtual as virtual
from stagewire._devices.synchronous.parts import Motion
from stagewire_apt import stages

if TYPE_CHECKING:
    from conftest import Stagewire

PNG = b"\x89PNG\r\n\x1a\n"
Z8 = ("--unit", "TDC001", "--stage", "Z8", "--yes")
Attach = Callable[[virtual.VirtualController], Written]


@pytest.fixture
def attach(monkeypatch: pytest.MonkeyPatch) -> Attach:
    """Return a function that makes the URL of the tests open a virtual controller."""
    return partial(attached, monkeypatch)


def positions_in(path: Path, unit: str = "mm") -> list[float]:
    with path.open(encoding="utf-8", newline="") as file:
        return [float(row[f"position_{unit}"]) for row in csv.DictReader(file)]


def test_a_move_is_recorded_and_plotted(
    stagewire: Stagewire, attach: Attach, tmp_path: Path
) -> None:
    file, picture = tmp_path / "move.csv", tmp_path / "move.png"
    with virtual.TDC001(stage=stages.Z8) as tdc:
        line = attach(tdc)
        result = stagewire("move", URL, "--by", "1", *Z8, "--csv", file, "--plot", picture)
    assert (result.code, result.err) == (0, "")
    assert result.out.endswith("it is at 1.0000 mm\n")
    positions = positions_in(file)
    assert positions == sorted(positions)
    assert positions[0] == pytest.approx(0, abs=0.01)
    assert positions[-1] == pytest.approx(1, abs=0.05)
    assert len(positions) >= 10
    assert picture.read_bytes().startswith(PNG)
    sent = line.sent()
    assert sent.count("HW_START_UPDATEMSGS") == sent.count("HW_STOP_UPDATEMSGS") == 1


def test_the_plot_shows_the_target_in_the_unit_of_the_stage(
    stagewire: Stagewire, attach: Attach, tmp_path: Path
) -> None:
    picture = tmp_path / "move.svg"
    with virtual.TDC001(stage=stages.Z8) as tdc:
        attach(tdc)
        stagewire("move", URL, "--by", "1", *Z8, "--plot", picture)
    comments = re.findall(r"<!-- (.*?) -->", picture.read_text(encoding="utf-8"))
    assert "position / mm" in comments
    assert "target" in comments
    assert "TDC001, serial number" in next(text for text in comments if "move from" in text)


def test_homing_and_jogging_are_recorded(
    stagewire: Stagewire, attach: Attach, tmp_path: Path
) -> None:
    with virtual.TDC001(stage=stages.Z8) as tdc:
        attach(tdc)
        home = stagewire("home", URL, *Z8, "--csv", tmp_path / "home.csv")
        jog = stagewire(
            "jog", URL, "forward", *Z8, "--csv", tmp_path / "jog.csv", "--plot", tmp_path / "j.png"
        )  # fmt: skip
    assert (home.code, jog.code) == (0, 0), home.err + jog.err
    assert min(positions_in(tmp_path / "home.csv")) < 0
    assert max(positions_in(tmp_path / "jog.csv")) > 0
    assert (tmp_path / "j.png").exists()


def test_a_flipper_is_recorded(stagewire: Stagewire, tmp_path: Path) -> None:
    file = tmp_path / "flip.csv"
    result = stagewire("move", "virtual://MFF101", "--to", "2", "--yes", "--csv", file)
    assert result.code == 0, result.err
    assert file.read_text().startswith("time_s,wall_clock,position,moving,")


def test_ctrl_c_leaves_complete_files(
    stagewire: Stagewire, attach: Attach, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def interrupt(self: Motion, timeout: float | None = None) -> None:
        tdc.advance(1.0)
        raise KeyboardInterrupt

    monkeypatch.setattr(Motion, "wait", interrupt)
    file, picture = tmp_path / "move.csv", tmp_path / "move.png"
    with virtual.TDC001(stage=stages.Z8) as tdc:
        attach(tdc)
        result = stagewire("move", URL, "--to", "10", *Z8, "--csv", file, "--plot", picture)
    assert result.code == 130
    assert "interrupted: stop was sent; it is at " in result.err
    assert file.read_text().endswith("\n")
    assert len(positions_in(file)) >= 9
    assert picture.read_bytes().startswith(PNG)


def test_a_lost_line_leaves_complete_files(
    stagewire: Stagewire, attach: Attach, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    wait = Motion.wait

    def unplug(self: Motion, timeout: float | None = None) -> None:
        tdc.unplug()
        wait(self, timeout)

    monkeypatch.setattr(Motion, "wait", unplug)
    file = tmp_path / "move.csv"
    with virtual.TDC001(stage=stages.Z8) as tdc:
        attach(tdc)
        result = stagewire("move", URL, "--to", "10", *Z8, "--csv", file)
    assert result.code == 1
    assert "unplugged" in result.err
    assert file.read_text().startswith("time_s,")


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--csv", "there.csv"), "there.csv exists; give another name, or --overwrite"),
        (("--csv", "move.txt"), "the file name must end in .csv"),
        (("--csv", "nowhere/move.csv"), "missing folder"),
        (("--plot", "move.jpg"), "the file name must end in .png or .svg"),
    ],
)
def test_a_file_that_cannot_be_written_is_refused_before_the_line_is_opened(
    stagewire: Stagewire,
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    options: tuple[str, str],
    said: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("there.csv").write_text("precious")
    result = stagewire("move", "/dev/there-is-none", "--to", "1", *Z8, *options)
    assert result.code == 2
    assert said in result.err
    assert Path("there.csv").read_text() == "precious"
