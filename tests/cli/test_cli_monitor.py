"""``stagewire monitor``: its lines, tables, pictures and captures, and how it ends."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from attached_controller import URL, Written, attached

import stagewire_virtual as virtual
from stagewire.capture import read_capture
from stagewire_apt import messages as m
from stagewire_apt import stages
from stagewire_cli.monitor_board import Board, Track, plot
from stagewire_cli.screens import MonitorScreen
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


def test_the_rate_covers_the_last_two_seconds() -> None:
    board = Board()
    for tenth in range(50):
        board.add(reading(tenth / 10, 0))
    assert board.rate("", 5.0) == pytest.approx(10, abs=0.5)
    assert board.rate("", 6.0) == pytest.approx(5, abs=0.5)
    assert board.rate("", 9.0) == 0
    assert board.count == 50


def test_the_table_has_a_row_for_each_part_and_counts_dropped_messages(
    capsys: pytest.CaptureFixture[str],
) -> None:
    board = Board()
    with MonitorScreen("BBD102, serial number 1", board) as screen:
        screen.draw(0.0)
        board.add(reading(0.5, 1.25, 2.0, "bay 1"))
        board.add(Reading("bay 2", 1.0, {"position": Value(7)}, None))
        board.dropped = 3
        screen.draw(1.5)
    title, heading, _, first, second, counted = capsys.readouterr().out.splitlines()
    assert title == "BBD102, serial number 1"
    assert heading.split() == ["part", "position", "velocity", "state", "age", "per", "second"]
    assert first.split("  ")[0] == "bay 1"
    assert " 1.2500 mm   2.0000 mm/s   homed, settled   1.0 s " in first
    assert second.split() == ["bay", "2", "7", "0.5", "s", "0.7"]
    assert counted == "1.5 s, 2 status messages, 3 dropped; Ctrl-C ends"


def test_a_velocity_in_units_is_drawn_as_sent() -> None:
    track = Track()
    for time in (0.0, 0.1, 0.2):
        track.add(reading(time, time, velocity=7.0))
    assert track.velocity() == ([0.0, 0.1, 0.2], [7.0, 7.0, 7.0])


@pytest.mark.parametrize("sent", [None, Value(12345)], ids=["none", "counts"])
def test_other_velocities_are_derived_from_positions(sent: Value | None) -> None:
    track = Track()
    for time, position in ((0.0, 1.0), (0.5, 2.0), (0.5, 9.0), (1.5, 10.0)):
        values = {"position": Value(position, MM)} | ({"velocity": sent} if sent else {})
        track.add(Reading("", time, values))
    assert track.velocity() == ([0.25, 1.0], [2.0, 1.0])


def test_a_reading_without_a_position_adds_no_track() -> None:
    board = Board(track=True)
    board.add(Reading("", 0.0, {"op_voltage": Value(1, "V")}))
    assert len(board.tracks[""].times) == 0


@pytest.mark.parametrize(("name", "begin"), [("a.png", PNG), ("a.SVG", b"<?xml")])
def test_a_picture_is_drawn(tmp_path: Path, name: str, begin: bytes) -> None:
    board = Board(track=True)
    for time in range(5):
        board.add(reading(time, time, 1.0, "bay 1"))
        board.add(Reading("bay 2", time, {"position": Value(1000 * time)}))
    plot(tmp_path / name, "BBD102", board.tracks)
    assert (tmp_path / name).read_bytes().startswith(begin)


@pytest.mark.parametrize(
    ("file", "said"),
    [
        ("a.jpg", "the file name must end in .png or .svg"),
        ("nowhere/a.png", "missing folder"),
        ("folder.png", "not a regular file"),
    ],
)
def test_an_invalid_picture_is_refused_before_the_line_is_opened(
    stagewire: Stagewire, tmp_path: Path, file: str, said: str
) -> None:
    (tmp_path / "folder.png").mkdir()
    result = stagewire("monitor", "/dev/there-is-none", "--plot", tmp_path / file)
    assert result.code == 2
    assert said in result.err


def test_a_missing_matplotlib_is_explained(
    stagewire: Stagewire, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    result = stagewire("monitor", "/dev/there-is-none", "--plot", tmp_path / "a.png")
    assert result.code == 2
    assert "pip install 'stagewire[plot]'" in result.err


@pytest.fixture
def moving(monkeypatch: pytest.MonkeyPatch) -> Iterator[Written]:
    """Yield a controller that has just begun to move by 1 mm, as if from its panel."""
    with virtual.TDC001(stage=stages.Z8) as tdc:
        tdc.write(m.MotMoveRelative(chan_ident=1, relative_distance=34304).pack(0x50, 0x01))
        yield attached(monkeypatch, tdc)


def test_statuses_are_printed_as_lines_in_units(stagewire: Stagewire, moving: Written) -> None:
    result = stagewire("monitor", URL, "--unit", "TDC001", "--stage", "Z8", "--for", "3")
    assert result.code == 0
    title, *lines = result.out.splitlines()
    assert title.startswith("TDC001, serial number 83")
    assert len(lines) == 30  # ten per second
    assert "moving_forward" in lines[0]
    assert "position=0.0" in lines[0]
    assert "position=1.0000 mm" in lines[-1]
    assert "[tracking, settled, channel_enabled]" in lines[-1]
    assert result.err == "30 status messages, 0 dropped\n"


def test_monitoring_only_switches_updates_on_and_off(stagewire: Stagewire, moving: Written) -> None:
    stagewire("monitor", URL, "--unit", "TDC001", "--for", "0.5")
    sent = [name for name in moving.sent() if name != "MOT_ACK_DCSTATUSUPDATE"]
    assert [name for name in sent if "_REQ_" not in name] == [
        "HW_START_UPDATEMSGS",
        "HW_STOP_UPDATEMSGS",
    ]


def test_without_a_stage_values_are_in_counts(stagewire: Stagewire, moving: Written) -> None:
    result = stagewire("monitor", URL, "--unit", "TDC001", "--for", "3")
    assert "position=34304" in result.out.splitlines()[-1]


def test_a_picture_and_a_capture_can_be_written(
    stagewire: Stagewire, moving: Written, tmp_path: Path
) -> None:
    picture, log = tmp_path / "move.png", tmp_path / "log.txt"
    result = stagewire(
        "monitor", URL, "--unit", "TDC001", "--stage", "Z8", "--for", "2",
        "--plot", picture, "--log", log,
    )  # fmt: skip
    assert result.code == 0
    assert picture.read_bytes().startswith(PNG)
    capture = read_capture(log)
    assert capture.heading.unit == "TDC001"
    assert sum("MOT_GET_DCSTATUSUPDATE" in one.comment for one in capture.recorded) >= 19


def test_every_bay_is_a_part(stagewire: Stagewire, monkeypatch: pytest.MonkeyPatch) -> None:
    with virtual.BBD102() as rack:
        attached(monkeypatch, rack)
        result = stagewire("monitor", URL, "--unit", "BBD102", "--for", "0.35")
    assert result.out.count("  bay 1  ") == result.out.count("  bay 2  ") == 3


def test_one_bay_of_a_rack_can_be_selected(
    stagewire: Stagewire, monkeypatch: pytest.MonkeyPatch
) -> None:
    with virtual.BBD102() as rack:
        attached(monkeypatch, rack)
        one = stagewire("monitor", URL, "--bay", "2", "--for", "0.35")
        none = stagewire("monitor", URL, "--bay", "3", "--for", "0.35")
    assert (one.code, none.code) == (0, 2)
    assert one.out.count("  bay 2  ") == 3
    assert "bay 1" not in one.out
    assert "BBD102 has no bay 3; it has bay 1, bay 2" in none.err


def test_missing_axes_do_not_extend_the_time(
    stagewire: Stagewire, monkeypatch: pytest.MonkeyPatch
) -> None:
    with virtual.MS2000() as ms2000:
        attached(monkeypatch, ms2000)
        begin = ms2000.clock.now
        stagewire("monitor", URL, "--unit", "MS2000", "--for", "1")
        assert (ms2000.clock.now - begin) / 1e9 < 2.5


def test_a_unit_without_updates_is_polled(
    stagewire: Stagewire, monkeypatch: pytest.MonkeyPatch
) -> None:
    with virtual.MS2000() as ms2000:
        attached(monkeypatch, ms2000)
        result = stagewire("monitor", URL, "--unit", "MS2000", "--for", "20")
    assert result.code == 0, result.err
    assert result.out.count("axis X") == result.out.count("axis Z") > 10
    assert "axis SCAN" not in result.out


def test_ctrl_c_ends_monitoring_and_the_picture_is_drawn(
    stagewire: Stagewire, moving: Written, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    add = Board.add

    def interrupt(self: Board, reading: Reading) -> None:
        add(self, reading)
        if self.count == 5:
            raise KeyboardInterrupt

    monkeypatch.setattr(Board, "add", interrupt)
    result = stagewire("monitor", URL, "--unit", "TDC001", "--plot", tmp_path / "a.svg")
    assert result.code == 0
    assert result.err == "5 status messages, 0 dropped\n"
    assert (tmp_path / "a.svg").exists()
    assert moving.sent()[-1] == "HW_STOP_UPDATEMSGS"


def test_a_lost_line_ends_monitoring_with_an_error(
    stagewire: Stagewire, monkeypatch: pytest.MonkeyPatch
) -> None:
    with virtual.TDC001() as tdc:
        attached(monkeypatch, tdc)
        add = Board.add

        def unplug(self: Board, reading: Reading) -> None:
            add(self, reading)
            tdc.unplug()

        monkeypatch.setattr(Board, "add", unplug)
        result = stagewire("monitor", URL, "--unit", "TDC001")
    assert result.code == 1
    assert "unplugged" in result.err


@pytest.mark.parametrize("seconds", ["0", "-1", "nan", "inf", "x"])
def test_an_invalid_time_is_refused(stagewire: Stagewire, seconds: str) -> None:
    assert stagewire("monitor", "virtual://TDC001", "--for", seconds).code == 2


def test_a_flipper_is_polled_for_its_position_bits(stagewire: Stagewire) -> None:
    result = stagewire("monitor", "virtual://MFF101", "--for", "1")
    assert result.code == 0
    assert "[forward_hardware_limit]" in result.out.splitlines()[-1]
