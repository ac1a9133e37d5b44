"""``stagewire monitor``: what it makes of status messages, what it prints and draws, and how it ends."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from stagewire_cli.monitor_plot import plot
from stagewire_cli.monitor_readings import Board, Track
from stagewire_cli.status import Reading, Value

if TYPE_CHECKING:
    from conftest import Stagewire

PNG = b"\x89PNG\r\n\x1a\n"
MM = "mm"


def reading(time: float, position: float, velocity: float | None = None, part: str = "") -> Reading:
    values = {"position": Value(position, MM)}
    if velocity is not None:
        values["velocity"] = Value(velocity, "mm/s")
    return Reading(part, time, values, ("homed", "settled"))


def test_a_reading_is_one_line() -> None:
    assert reading(1.25, 3.5, 2.0, "bay 2").line() == (
        "    1.250  bay 2  position=3.5000 mm  velocity=2.0000 mm/s  [homed, settled]"
    )
    assert Reading("", 0, {"position": Value(100)}, ()).line() == "    0.000  position=100  [-]"
    assert Reading("", 0, {}, None).line() == "    0.000"


def test_the_rate_is_that_of_the_last_two_seconds() -> None:
    board = Board()
    for tenth in range(50):
        board.add(reading(tenth / 10, 0))
    assert board.rate("", 5.0) == pytest.approx(10, abs=0.5)
    assert board.rate("", 6.0) == pytest.approx(5, abs=0.5)
    assert board.rate("", 9.0) == 0
    assert board.count == 50


def test_a_velocity_that_was_sent_in_units_is_drawn_as_it_was_sent() -> None:
    track = Track()
    for time in (0.0, 0.1, 0.2):
        track.add(reading(time, time, velocity=7.0))
    assert track.velocity() == ([0.0, 0.1, 0.2], [7.0, 7.0, 7.0])


@pytest.mark.parametrize("sent", [None, Value(12345)], ids=["none", "counts"])
def test_otherwise_it_is_that_between_two_positions(sent: Value | None) -> None:
    track = Track()
    for time, position in ((0.0, 1.0), (0.5, 2.0), (0.5, 9.0), (1.5, 10.0)):
        values = {"position": Value(position, MM)} | ({"velocity": sent} if sent else {})
        track.add(Reading("", time, values))
    assert track.velocity() == ([0.25, 1.0], [2.0, 1.0])


def test_what_has_no_position_leaves_no_track() -> None:
    board = Board(track=True)
    board.add(Reading("", 0.0, {"op_voltage": Value(1, "V")}))
    assert len(board.tracks[""].times) == 0


@pytest.mark.parametrize(("name", "begin"), [("a.png", PNG), ("a.SVG", b"<?xml")])
def test_a_picture(tmp_path: Path, name: str, begin: bytes) -> None:
    board = Board(track=True)
    for time in range(5):
        board.add(reading(time, time, 1.0, "bay 1"))
        board.add(Reading("bay 2", time, {"position": Value(1000 * time)}))
    plot(tmp_path / name, "BBD102", board.tracks)
    assert (tmp_path / name).read_bytes().startswith(begin)


@pytest.mark.parametrize(
    ("file", "said"),
    [
        ("a.jpg", "a picture ends in .png or .svg"),
        ("nowhere/a.png", "there is no folder"),
        ("folder.png", "no regular file"),
    ],
)
def test_a_picture_that_cannot_be_drawn_is_refused_before_anything_is_opened(
    stagewire: Stagewire, tmp_path: Path, file: str, said: str
) -> None:
    (tmp_path / "folder.png").mkdir()
    result = stagewire("monitor", "/dev/there-is-none", "--plot", tmp_path / file)
    assert result.code == 2
    assert said in result.err


def test_without_matplotlib(
    stagewire: Stagewire, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    result = stagewire("monitor", "/dev/there-is-none", "--plot", tmp_path / "a.png")
    assert result.code == 2
    assert "pip install 'stagewire[plot]'" in result.err


@pytest.mark.parametrize("seconds", ["0", "-1", "nan", "inf", "x"])
def test_a_time_that_is_none(stagewire: Stagewire, seconds: str) -> None:
    assert stagewire("monitor", "virtual://TDC001", "--for", seconds).code == 2
