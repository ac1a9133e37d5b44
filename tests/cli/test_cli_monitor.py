"""``stagewire monitor``: its lines, tables, pictures and captures, and how it ends."""

from __future__ import annotations

import csv
import json
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
from stagewire_cli.monitor_board import Board, Row, line_of
from stagewire_cli.plots import Track, Tracks, plot
from stagewire_cli.screens import MonitorScreen

if TYPE_CHECKING:
    from conftest import Stagewire

PNG = b"\x89PNG\r\n\x1a\n"


def row(time: float, position: float, velocity: float | None = None, part: str = "") -> Row:
    made: Row = {"time_s": time, "wall_clock": "2026-11-27T09:00:00.000+00:00"}
    made |= {"part": part} if part else {}
    made["position_mm"] = position
    if velocity is not None:
        made["velocity_mm_per_s"] = velocity
    return made | {"moving": False, "homed": True, "settled": True}


def bare(time: float, part: str = "", **values: object) -> Row:
    return {"time_s": time, "wall_clock": "", **({"part": part} if part else {}), **values}


def test_a_row_is_one_line() -> None:
    assert line_of(row(1.25, 3.5, 2.0, "bay 2")) == (
        "    1.250  bay 2  position_mm=3.5000  velocity_mm_per_s=2.0000  [homed, settled]"
    )
    assert (
        line_of(bare(0, position_counts=100, homed=False)) == "    0.000  position_counts=100  [-]"
    )
    assert line_of(bare(0, position_counts=None)) == "    0.000"


@pytest.mark.parametrize(("reading", "shown"), [
    (1.2045258e-05, "1.205e-05"), (-1e-9, "-1e-09"), (0.0, "0.0000"), (0.001, "0.0010"), (12.0, "12.0000"),
])  # fmt: skip
def test_small_numbers_are_not_shown_as_zero(reading: float, shown: str) -> None:
    assert line_of(bare(0, abs_reading=reading)) == f"    0.000  abs_reading={shown}"


def test_the_rate_covers_the_last_two_seconds() -> None:
    board = Board()
    for tenth in range(50):
        board.add(row(tenth / 10, 0))
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
        board.add(row(0.5, 1.25, 2.0, "bay 1"))
        board.add(bare(1.0, "bay 2", position_counts=7))
        board.dropped = 3
        screen.draw(1.5)
    title, heading, _, first, second, counted = capsys.readouterr().out.splitlines()
    assert title == "BBD102, serial number 1"
    assert heading.split() == [
        "part", "position_mm", "velocity_mm_per_s", "position_counts", "state", "age", "per", "second",
    ]  # fmt: skip
    assert first.split("  ")[0] == "bay 1"
    assert first.split()[2:] == ["1.2500", "2.0000", "homed,", "settled", "1.0", "s", "0.7"]
    assert second.split() == ["bay", "2", "7", "0.5", "s", "0.7"]
    assert counted == "1.5 s, 2 status messages, 3 dropped; Ctrl-C ends"


def test_a_velocity_in_units_is_drawn_as_sent() -> None:
    track = Track()
    for time in (0.0, 0.1, 0.2):
        track.add(row(time, time, velocity=7.0))
    assert track.velocity() == ([0.0, 0.1, 0.2], [7.0, 7.0, 7.0])


@pytest.mark.parametrize("sent", [None, 12345], ids=["none", "counts"])
def test_other_velocities_are_derived_from_positions(sent: int | None) -> None:
    track = Track()
    for time, position in ((0.0, 1.0), (0.5, 2.0), (0.5, 9.0), (1.5, 10.0)):
        track.add(bare(time, position_mm=position, velocity_counts=sent))
    assert track.velocity() == ([0.25, 1.0], [2.0, 1.0])


def test_a_row_without_a_position_adds_no_track() -> None:
    tracks = Tracks()
    tracks.add(bare(0.0, op_voltage_volts=1.0))
    assert len(tracks[""].times) == 0


@pytest.mark.parametrize(("name", "begin"), [("a.png", PNG), ("a.SVG", b"<?xml")])
def test_a_picture_is_drawn(tmp_path: Path, name: str, begin: bytes) -> None:
    tracks = Tracks()
    for time in range(5):
        tracks.add(row(time, time, 1.0, "bay 1"))
        tracks.add(bare(time, "bay 2", position_counts=1000 * time))
    tracks["bay 1"].target = 4.0
    plot(tmp_path / name, "BBD102", tracks)
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
    assert "position_mm=0.0" in lines[0]
    assert "position_mm=1.0000" in lines[-1]
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
    assert "position_counts=34304" in result.out.splitlines()[-1]


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
    assert len(one.out.splitlines()) == 1 + 3
    assert "BBD102 has no bay 3; it has bay 1, bay 2" in none.err


def test_a_unit_without_updates_is_polled(stagewire: Stagewire) -> None:
    result = stagewire("monitor", "virtual://MS2000", "--for", "0.2")
    assert result.code == 0, result.err
    assert result.out.count("axis X") == result.out.count("axis Z") > 0
    assert "axis SCAN" not in result.out


def test_ctrl_c_ends_monitoring_and_the_picture_is_drawn(
    stagewire: Stagewire, moving: Written, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    add = Board.add

    def interrupt(self: Board, row: Row) -> None:
        add(self, row)
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

        def unplug(self: Board, row: Row) -> None:
            add(self, row)
            tdc.unplug()

        monkeypatch.setattr(Board, "add", unplug)
        result = stagewire("monitor", URL, "--unit", "TDC001")
    assert result.code == 1
    assert "unplugged" in result.err


def test_csv_and_json_have_the_same_columns_and_rows(
    stagewire: Stagewire, moving: Written, tmp_path: Path
) -> None:
    file = tmp_path / "run.csv"
    result = stagewire(
        "monitor", URL, "--unit", "TDC001", "--stage", "Z8", "--for", "3", "--csv", file, "--json"
    )  # fmt: skip
    assert result.code == 0, result.err
    printed = [json.loads(line) for line in result.out.splitlines()]
    with file.open(encoding="utf-8", newline="") as opened:
        written = list(csv.DictReader(opened))
    assert len(printed) == len(written) == 30
    assert list(printed[0]) == list(written[0])
    assert printed[-1]["position_mm"] == pytest.approx(1, abs=1e-4)
    assert (printed[-1]["homed"], written[-1]["homed"]) == (False, "False")


def test_an_existing_csv_file_is_replaced_only_if_asked(
    stagewire: Stagewire, moving: Written, tmp_path: Path
) -> None:
    file = tmp_path / "run.csv"
    file.write_text("precious")
    refused = stagewire("monitor", URL, "--unit", "TDC001", "--for", "1", "--csv", file)
    assert refused.code == 2
    assert "run.csv exists; give another name, or --overwrite to replace it" in refused.err
    assert file.read_text() == "precious"
    assert moving.sent() == []
    replaced = stagewire(
        "monitor", URL, "--unit", "TDC001", "--for", "1", "--csv", file, "--overwrite"
    )  # fmt: skip
    assert replaced.code == 0, replaced.err
    assert len(file.read_text().splitlines()) == 11


def test_two_outputs_cannot_be_one_file(stagewire: Stagewire, tmp_path: Path) -> None:
    file = tmp_path / "run.csv"
    result = stagewire("monitor", "virtual://TDC001", "--csv", file, "--log", file)
    assert result.code == 2
    assert "--csv, --plot and --log must name different files" in result.err


@pytest.mark.parametrize("seconds", ["0", "-1", "nan", "inf", "x"])
def test_an_invalid_time_is_refused(stagewire: Stagewire, seconds: str) -> None:
    assert stagewire("monitor", "virtual://TDC001", "--for", seconds).code == 2


def test_a_flipper_is_polled_for_its_position_bits(stagewire: Stagewire) -> None:
    result = stagewire("monitor", "virtual://MFF101", "--for", "1")
    assert result.code == 0
    assert "[forward_hardware_limit]" in result.out.splitlines()[-1]
