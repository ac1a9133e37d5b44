"""``record``: every status becomes a row of a file, while other calls continue."""

from __future__ import annotations

import asyncio
import csv
import errno
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import pytest
from recording_link import RecordingLink

import stagewire_virtual as virtual
from stagewire._devices import row_files
from stagewire._devices.synchronous import recorder
from stagewire.errors import (
    BadValueError,
    RecordingError,
    ReplyTimeoutError,
    SessionClosedError,
    TransportLostError,
    UnsupportedError,
)
from stagewire_apt import BBD102, BPC201, MFF101, PROTOCOL, TDC001, aio, stages
from stagewire_ms2000 import MS2000
from stagewire_virtual import stepped

ON, OFF = "HW_START_UPDATEMSGS", "HW_STOP_UPDATEMSGS"


def rows_of(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def recorded(part: Any, to: Any, *steps: Callable[[], object]) -> None:
    """Take some steps while a part is recorded."""
    with part.record(to, poll=0.01):
        for step in steps:
            step()


@pytest.fixture
def link() -> RecordingLink:
    return RecordingLink(virtual.TDC001(stage=stages.Z8))


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "run.csv"


def test_a_move_is_recorded_in_engineering_units_at_the_rate_of_the_updates(
    link: RecordingLink, file: Path
) -> None:
    with TDC001.open(link, stage="Z8") as tdc:
        with tdc.record(file) as recording:
            tdc.move_relative(mm=1)
            tdc.session.pause(1)
        rows = rows_of(file)
        assert recording.rows == len(rows) > 15
    assert list(rows[0])[:3] == ["time_s", "wall_clock", "position_mm"]
    positions = [float(row["position_mm"]) for row in rows]
    assert positions == sorted(positions)
    assert (positions[0], positions[-1]) == (0, pytest.approx(1, abs=1e-4))
    assert rows[5]["moving"] == "True"
    assert (rows[-1]["moving"], rows[-1]["settled"]) == ("False", "True")
    begun = datetime.fromisoformat(rows[0]["wall_clock"])
    assert abs(datetime.now(UTC) - begun) < timedelta(minutes=5)
    times = [float(row["time_s"]) for row in rows]
    assert times == sorted(times)
    assert times[-1] - times[-2] == pytest.approx(0.1)


def test_a_recording_sends_only_what_switches_updates_on_and_off(
    link: RecordingLink, file: Path
) -> None:
    with TDC001.open(link, stage="Z8") as tdc:
        link.forget()
        with tdc.record(file):
            tdc.session.pause(0.5)
        assert link.names(PROTOCOL) == [ON, OFF]


def test_updates_that_were_on_stay_on(link: RecordingLink, file: Path) -> None:
    with TDC001.open(link, stage="Z8") as tdc:
        tdc.start_updates()
        link.forget()
        with tdc.record(file):
            tdc.session.pause(0.5)
        assert link.names(PROTOCOL) == []
        tdc.stop_updates()


def test_two_recordings_share_the_updates(link: RecordingLink, tmp_path: Path) -> None:
    with TDC001.open(link, stage="Z8") as tdc:
        link.forget()
        with tdc.record(tmp_path / "long.csv") as long:
            with tdc.record(tmp_path / "short.csv") as short:
                tdc.session.pause(0.5)
            tdc.session.pause(0.5)
        assert link.names(PROTOCOL) == [ON, OFF]
    assert long.rows == 2 * short.rows == 10


def test_a_position_without_a_known_stage_is_in_counts(file: Path) -> None:
    with TDC001.open(RecordingLink(virtual.TDC001())) as tdc, tdc.record(file):
        tdc.move_relative(counts=1000)
        tdc.session.pause(0.3)
    assert rows_of(file)[-1]["position_counts"] == "1000"


def test_a_rack_is_recorded_with_the_bay_of_each_row(tmp_path: Path) -> None:
    with (
        BBD102.open(RecordingLink(virtual.BBD102()), stage="MLS203") as rack,
        rack.record(tmp_path / "all.csv"),
        rack.bay(2).record(tmp_path / "one.csv"),
    ):
        rack.bay(2).move_relative(mm=2)
        rack.session.pause(0.2)
    rows = rows_of(tmp_path / "all.csv")
    assert {row["part"] for row in rows} == {"bay 1", "bay 2"}
    last = {row["part"]: float(row["position_mm"]) for row in rows}
    assert last == {"bay 1": 0, "bay 2": pytest.approx(2, abs=1e-3)}
    assert "part" not in (one := rows_of(tmp_path / "one.csv"))[0]
    assert len(one) == sum(row["part"] == "bay 2" for row in rows)


def test_a_piezo_is_recorded_in_its_units(file: Path) -> None:
    with BPC201.open(RecordingLink(virtual.BPC201())) as piezo, piezo.record(file) as recording:
        piezo.session.pause(0.5)
    assert recording.rows >= 4
    assert "op_voltage_volts" in recording.columns


def test_a_flipper_is_polled_and_recorded_by_its_position(file: Path) -> None:
    with MFF101.open("virtual://MFF101") as flipper, flipper.record(file, poll=0.05):
        flipper.move_to(2)
    positions = [row["position"] for row in rows_of(file)]
    assert (positions[0], positions[-1]) == ("1", "2") or "" in positions


def test_an_axis_is_polled(file: Path) -> None:
    with MS2000.open("virtual://MS2000") as ms2000, ms2000.low_level():
        axis = ms2000.axis("X")
        with axis.record(file, poll=0.02) as recording:
            axis.start_move_absolute(um=50)
            while axis.is_moving():
                pass
    assert "part" not in recording.columns
    assert float(rows_of(file)[0]["position_um"]) == 0
    assert recording.rows > 2


def test_axes_that_do_not_answer_are_left_out(file: Path) -> None:
    with (
        MS2000.open("virtual://MS2000", timeout=0.3) as ms2000,
        ms2000.low_level(),
        ms2000.record(file, poll=0.01) as recording,
    ):
        while recording.rows < 30:
            assert recording.error is None
    assert {row["part"] for row in rows_of(file)} == {"axis X", "axis Y", "axis Z"}


def test_a_controller_that_does_not_answer_is_reported(file: Path) -> None:
    link = RecordingLink(virtual.MFF101())
    with MFF101.open(link, timeout=0.05) as flipper:
        link.twist = lambda data: b""
        said = "ends after 0 rows: MOT_REQ_STATUSBITS "
        with pytest.raises(RecordingError, match=said):
            recorded(flipper, file, lambda: time.sleep(0.2))
        link.twist = bytes


def test_a_function_receives_each_row(link: RecordingLink) -> None:
    rows: list[dict[str, Any]] = []
    with TDC001.open(link, stage="Z8") as tdc, tdc.record(rows.append):
        tdc.session.pause(0.5)
    assert [row["position_mm"] for row in rows] == [0.0] * 5
    assert rows[0]["homed"] is False


def test_parquet_has_the_same_columns_and_rows(link: RecordingLink, tmp_path: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    path = tmp_path / "run.parquet"
    with (
        TDC001.open(link, stage="Z8") as tdc,
        tdc.record(path),
        tdc.record(tmp_path / "run.csv") as recording,
    ):
        tdc.session.pause(1)
        assert not path.exists()
    table = parquet.read_table(path)
    assert tuple(table.column_names) == recording.columns
    assert table.num_rows == recording.rows == 10
    assert table.column("position_mm").to_pylist() == [0.0] * 10
    assert {str(field.type) for field in table.schema} == {"double", "string", "bool", "int64"}
    assert [one.name for one in tmp_path.iterdir() if one.name.startswith(".")] == []


def test_parquet_never_replaces_a_file_that_appeared_meanwhile(
    link: RecordingLink, tmp_path: Path
) -> None:
    pytest.importorskip("pyarrow.parquet")
    path = tmp_path / "run.parquet"
    refused = pytest.raises(RecordingError, match="appeared meanwhile; the recording is")
    with TDC001.open(link, stage="Z8") as tdc, refused, tdc.record(path):
        tdc.session.pause(1)
        path.write_text("mine")
    assert path.read_text() == "mine"
    assert [one.suffix for one in tmp_path.iterdir() if one.name.startswith(".run")] == [".part"]


def test_a_recording_that_cannot_begin_keeps_the_file_that_it_would_replace(
    link: RecordingLink, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> None:
        raise ReplyTimeoutError("the controller is silent")

    path = tmp_path / "run.csv"
    path.write_text("the last run")
    with TDC001.open(link, stage="Z8") as tdc:
        monkeypatch.setattr("stagewire._devices.synchronous.recorder.tell", fail)
        with pytest.raises(ReplyTimeoutError), tdc.record(path, overwrite=True):
            pass
    assert path.read_text() == "the last run"


def test_pyarrow_is_imported_only_for_parquet(tmp_path: Path) -> None:
    program = """
import sys
from stagewire_apt import TDC001
with TDC001.open("virtual://TDC001") as tdc, tdc.record(sys.argv[1]):
    pass
print([name for name in ("pyarrow", "pandas", "numpy") if name in sys.modules])
"""
    done = subprocess.run(
        [sys.executable, "-c", program, tmp_path / "run.csv"], capture_output=True, text=True
    )
    assert (done.stdout, done.stderr) == ("[]\n", "")


def test_a_missing_pyarrow_is_explained(
    link: RecordingLink, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with (
        TDC001.open(link) as tdc,
        pytest.raises(RecordingError, match=r"pip install 'stagewire\[parquet\]'"),
    ):
        tdc.record(tmp_path / "run.parquet").__enter__()
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("there.csv", "exists and is not replaced: choose another name, or pass overwrite=True"),
        ("run.txt", "must end in .csv or .parquet"),
        ("nowhere/run.csv", "missing folder"),
        ("folder.csv", "is not a regular file"),
    ],
)
def test_a_file_that_cannot_be_used_is_refused_before_anything_is_sent(
    link: RecordingLink, tmp_path: Path, name: str, said: str
) -> None:
    (tmp_path / "there.csv").write_text("precious")
    (tmp_path / "folder.csv").mkdir()
    with TDC001.open(link) as tdc:
        link.forget()
        with pytest.raises(RecordingError, match=said):
            tdc.record(tmp_path / name).__enter__()
        assert link.names(PROTOCOL) == []
    assert (tmp_path / "there.csv").read_text() == "precious"


def test_a_recording_that_cannot_begin_leaves_no_file(link: RecordingLink, file: Path) -> None:
    tdc = TDC001.open(link)
    tdc.close()
    with pytest.raises(SessionClosedError):
        tdc.record(file).__enter__()
    assert not file.exists()


def test_a_recording_is_used_once(link: RecordingLink, file: Path) -> None:
    with TDC001.open(link) as tdc:
        recording = tdc.record(file)
        with recording:
            pass
        with pytest.raises(BadValueError, match="call record"):
            recording.__enter__()


def test_rows_are_in_the_file_within_a_second_if_polls_are_rare(file: Path) -> None:
    with MFF101.open("virtual://MFF101") as flipper, flipper.record(file, poll=3600):
        while len(rows_of(file)) < 1:
            time.sleep(0.01)


def test_an_existing_file_is_replaced_if_asked(link: RecordingLink, file: Path) -> None:
    file.write_text("old\n" * 1000)
    with TDC001.open(link) as tdc, tdc.record(file, overwrite=True):
        tdc.session.pause(0.3)
    assert len(rows_of(file)) == 3
    assert "old" not in file.read_text()


@pytest.mark.parametrize("poll", [0, -1, True, "1", float("nan")])
def test_an_invalid_time_between_polls_is_refused(link: RecordingLink, poll: Any) -> None:
    with TDC001.open(link) as tdc, pytest.raises(BadValueError, match="poll must be"):
        tdc.record("run.csv", poll=poll)


def test_a_unit_without_any_status_is_refused(file: Path) -> None:
    link = RecordingLink(virtual.TDC001())
    with TDC001.open(link) as tdc:
        at = tdc._at.connection
        at.updates, at.unit = None, replace(at.unit, status_query=None)
        with pytest.raises(UnsupportedError, match="a TDC001 has no status that can be recorded"):
            tdc.record(file).__enter__()
    assert not file.exists()


# Errors


class _FullDisk(row_files.CsvFile):
    """A file on a disk that becomes full after the header."""

    def write(self, rows: Any) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


@pytest.fixture
def full_disk(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(row_files._KINDS, ".csv", _FullDisk)


def test_a_full_disk_is_logged_at_once_and_raised_at_the_end_and_stops_no_motion(
    full_disk: None, file: Path, caplog: pytest.LogCaptureFixture
) -> None:
    reached: list[float] = []
    logged: list[str] = []
    with (
        TDC001.open("virtual://TDC001?stage=Z8", stage="Z8") as tdc,
        pytest.raises(RecordingError, match="ends after 0 rows: No space left on device"),
    ):
        recorded(
            tdc,
            file,
            lambda: tdc.move_relative(mm=2),
            lambda: reached.append(tdc.position),
            lambda: logged.extend(caplog.messages),
        )
    assert reached == [pytest.approx(2, abs=1e-3)]
    assert "run.csv ends after 0 rows: No space left on device" in logged[0]


def test_a_disk_that_hangs_does_not_keep_the_block_from_ending(
    monkeypatch: pytest.MonkeyPatch, link: RecordingLink, file: Path
) -> None:
    released = threading.Event()

    class Hanging(row_files.CsvFile):
        def write(self, rows: Any) -> None:
            released.wait()

    monkeypatch.setitem(row_files._KINDS, ".csv", Hanging)
    monkeypatch.setattr(recorder, "_ENDING", 0.1)
    monkeypatch.setattr(recorder, "_FLUSH", 0.01)
    with TDC001.open(link, stage="Z8") as tdc:
        recording = tdc.record(file)
        recording.__enter__()
        tdc.move_relative(mm=1)
        time.sleep(0.1)
        with pytest.raises(RecordingError, match=r"no write ended within 0\.1 s"):
            recording.__exit__(None, None, None)
        released.set()
        assert recording._worker.join(10)
        assert recording._file is not None
        recording._file.close()


def test_an_error_of_the_block_is_kept_and_gets_a_note(
    full_disk: None, link: RecordingLink, file: Path
) -> None:
    with TDC001.open(link, stage="Z8") as tdc:
        with pytest.raises(ZeroDivisionError) as caught:
            recorded(tdc, file, lambda: tdc.session.pause(0.3), lambda: 1 / 0)
        [note] = caught.value.__notes__
    assert "run.csv ends after 0 rows: No space left on device" in note


LIMITED = """
import resource, sys
from stagewire.errors import RecordingError
from stagewire_apt import TDC001
with TDC001.open("virtual://TDC001?stage=Z8", stage="Z8") as tdc:
    try:
        with tdc.record(sys.argv[1]) as recording:
            resource.setrlimit(resource.RLIMIT_FSIZE, (2_000, resource.RLIM_INFINITY))
            tdc.move_relative(mm=3)
    except RecordingError as error:
        print(recording.rows, tdc.position_mm, error)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="the system has no limit for the size of files")
def test_a_file_that_cannot_grow_keeps_its_whole_lines(file: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-c", LIMITED, file], capture_output=True, text=True, check=True
    )
    rows, position, said = done.stdout.split(maxsplit=2)
    text = file.read_text()
    assert len(text) <= 2000
    assert text.endswith("\n")
    assert int(rows) <= len(rows_of(file))
    assert float(position) == pytest.approx(3, abs=1e-3)
    assert "File too large" in said


def test_a_lost_line_ends_the_recording_with_the_rows_before_it(
    link: RecordingLink, file: Path
) -> None:
    with TDC001.open(link, stage="Z8") as tdc, pytest.raises(TransportLostError) as caught:
        recorded(
            tdc,
            file,
            lambda: tdc.session.pause(0.5),
            link.controller.unplug,
            lambda: tdc.session.pause(1),
        )
    assert "ends after 5 rows" in caught.value.__notes__[0]
    assert len(rows_of(file)) == 5


def test_a_line_lost_while_the_block_does_not_use_it_is_reported(file: Path) -> None:
    def close() -> None:
        served.close()
        while not tdc.session.lost:
            time.sleep(0.01)

    with virtual.TDC001(stage=stages.Z8) as controller, controller.tcp() as served:
        tdc = TDC001.open(served.url, stage="Z8")
        with pytest.raises(RecordingError, match=r"run\.csv ends after \d+ rows: "):
            recorded(tdc, file, close)
        tdc.close()


def test_a_device_may_be_closed_in_the_block(link: RecordingLink, file: Path) -> None:
    tdc = TDC001.open(link, stage="Z8")
    with tdc.record(file):
        tdc.session.pause(0.5)
        tdc.close()
    assert len(rows_of(file)) == 5


def test_an_error_of_a_function_ends_only_the_recording(link: RecordingLink) -> None:
    def fail(row: dict[str, Any]) -> None:
        raise ValueError("no such plot")

    with TDC001.open(link, stage="Z8") as tdc:
        with pytest.raises(RecordingError, match="no such plot"), tdc.record(fail):
            tdc.move_relative(mm=1)
        assert tdc.position == pytest.approx(1, abs=1e-3)


def test_a_written_row_does_not_stay_in_a_buffer_of_the_process(file: Path) -> None:
    out = row_files.create(file, {"time_s": float, "moving": bool}, overwrite=False)
    assert file.read_text() == "time_s,moving\n"
    out.write([{"time_s": 0.5, "moving": True}, {"time_s": 1 / 3, "moving": None}])
    assert file.read_text() == "time_s,moving\n0.5,True\n0.3333333333,\n"
    out.close()


KILLED = """
import sys, time
from stagewire_apt import TDC001
with (
    TDC001.open("virtual://TDC001?stage=Z8", stage="Z8") as tdc,
    tdc.record(sys.argv[1]) as recording,
):
    tdc.start_move_relative(mm=5)
    time.sleep(1)
    rows = recording.rows
    time.sleep(2)
    print(rows, flush=True)
    time.sleep(600)
"""


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="the system has no kill -9")
def test_a_killed_process_leaves_whole_lines_of_all_but_the_last_second(file: Path) -> None:
    with subprocess.Popen(
        [sys.executable, "-c", KILLED, file], stdout=subprocess.PIPE, text=True
    ) as process:
        try:
            assert process.stdout is not None
            old = int(process.stdout.readline())
        finally:
            process.send_signal(signal.SIGKILL)
    assert process.returncode == -signal.SIGKILL
    text = file.read_text(encoding="utf-8")
    assert text.endswith("\n")
    header, *lines = text.splitlines()
    assert len(lines) >= old > 5
    assert {line.count(",") for line in lines} == {header.count(",")}


# asyncio


def test_a_recording_for_asyncio_has_the_same_rows(file: Path) -> None:
    async def main() -> None:
        async with (
            aio.TDC001.open("virtual://TDC001?stage=Z8", stage="Z8") as tdc,
            tdc.record(file) as recording,
        ):
            await tdc.move_relative(mm=0.5)
            await asyncio.sleep(0.5)
        assert recording.rows == len(rows_of(file))

    stepped.run(main())
    positions = [float(row["position_mm"]) for row in rows_of(file)]
    assert (positions[0], positions[-1]) == (0, pytest.approx(0.5, abs=1e-4))
    assert len(positions) > 5


def test_a_cancelled_block_for_asyncio_leaves_a_complete_file(file: Path) -> None:
    async def main() -> None:
        async with (
            aio.KDC101.open("virtual://KDC101?stage=Z8", stage="Z8") as kdc,
            asyncio.timeout(1),
            kdc.record(file),
        ):
            await asyncio.sleep(100)

    with pytest.raises(TimeoutError):
        stepped.run(main())
    assert len(rows_of(file)) == 10
