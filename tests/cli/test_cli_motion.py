"""``stagewire move``, ``home``, ``jog`` and ``stop``: motion, confirmation and refusals."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import threading
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from attached_controller import URL, Written, attached
from served_controller import COMMAND, serving, wait_for

import stagewire_virtual as virtual
from parts import every_nth
from stagewire._devices.synchronous.parts import Motion
from stagewire_apt import stages
from stagewire_apt.devices import BBD102Bay
from stagewire_cli import motion_session
from stagewire_virtual import linking

if TYPE_CHECKING:
    from conftest import Stagewire

MOVE_ABSOLUTE, MOVE_RELATIVE, HOME, STOP = (
    bytes.fromhex(id) for id in ("5304", "4804", "4304", "6504")
)
MOVES = (MOVE_ABSOLUTE, MOVE_RELATIVE, HOME)


Attach = Callable[[virtual.VirtualController], Written]


@pytest.fixture
def attach(monkeypatch: pytest.MonkeyPatch) -> Attach:
    """Return a function that makes the URL of the tests open a virtual controller."""
    return partial(attached, monkeypatch)


@pytest.fixture
def terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pretend that standard input is a terminal, so that a confirmation is possible."""
    monkeypatch.setattr(motion_session, "refuse_unattended", lambda yes: None)


Z8 = ("--unit", "TDC001", "--stage", "Z8", "--yes")


def test_a_move_reports_start_target_and_final_position(
    stagewire: Stagewire, attach: Attach
) -> None:
    with virtual.TDC001(stage=stages.Z8, position=34304) as tdc:
        line = attach(tdc)
        result = stagewire("move", URL, "--to", "1.5", *Z8)
    assert (result.code, result.err) == (0, "")
    first, second = result.out.splitlines()
    assert first.startswith("TDC001, serial number 83")
    assert first.endswith(": will move from 0.0000 mm to 1.5 mm")
    assert second.endswith("it is at 1.5000 mm")
    assert line.count(*MOVES) == line.count(MOVE_ABSOLUTE) == 1


def test_a_rotary_stage_moves_in_degrees(stagewire: Stagewire, attach: Attach) -> None:
    words = ("--unit", "TDC001", "--stage", "CR1-Z7", "--scale-source", "vendor", "--yes")
    with virtual.TDC001(stage=stages.CR1_Z7) as tdc:
        attach(tdc)
        first = stagewire("move", URL, "--to", "0.5deg", "--travel=-1,1deg", *words)
        second = stagewire("move", URL, "--by", "-0.25 deg", *words)
        jog = stagewire("jog", URL, "forward", *words)
    assert (first.code, first.err, second.err, jog.err) == (0, "", "", "")
    assert "will move from 0.0000 deg to 0.5 deg" in first.out
    assert "it is at 0.4999 deg" in first.out  # 819 of 819.2 counts
    assert "will move from 0.4999 deg by -0.25 deg" in second.out
    assert "will jog forward from 0.2496 deg by the stored step of " in jog.out
    assert " deg (SINGLE_STEP)" in jog.out


def test_a_length_can_have_its_unit(stagewire: Stagewire, attach: Attach) -> None:
    with virtual.TDC001(stage=stages.Z8) as tdc:
        attach(tdc)
        result = stagewire("move", URL, "--to", "500um", *Z8)
    assert "to 0.5 mm" in result.out
    assert "it is at 0.5000 mm" in result.out


def test_a_move_can_be_a_distance_in_counts(stagewire: Stagewire, attach: Attach) -> None:
    with virtual.TDC001() as tdc:
        line = attach(tdc)
        first = stagewire("move", URL, "--unit", "TDC001", "--counts", "--by", "2000", "--yes")
        second = stagewire("move", URL, "--unit", "TDC001", "--counts", "--by=-500", "--yes")
    assert (first.code, second.code) == (0, 0)
    assert "will move from 0 counts by 2000 counts" in first.out
    assert "will move from 2000 counts by -500 counts" in second.out
    assert second.out.endswith("it is at 1500 counts\n")
    assert line.count(MOVE_RELATIVE) == 2


def test_a_flipper_moves_to_a_position(stagewire: Stagewire, attach: Attach) -> None:
    with virtual.MFF101() as flipper:
        attach(flipper)
        result = stagewire("move", URL, "--unit", "MFF101", "--to", "2", "--yes")
        assert (result.code, result.err) == (0, "")
        first, second = result.out.splitlines()
        assert first.endswith("will move from position 1 to position 2")
        assert second.endswith("it is at position 2")


@pytest.mark.parametrize("given", [("--to", "3"), ("--to", "1mm"), ("--by", "1"), ("--to", "1.5")])
def test_a_flipper_refuses_anything_but_its_positions(
    stagewire: Stagewire, attach: Attach, given: tuple[str, str]
) -> None:
    with virtual.MFF101() as flipper:
        line = attach(flipper)
        result = stagewire("move", URL, "--unit", "MFF101", *given, "--yes")
    assert result.code == 2
    assert "positions, such as 1" in result.err or "not one of 1, 2" in result.err
    assert line.count(b"\x6a\x04") == 0


def test_home_moves_to_the_home_position(stagewire: Stagewire, attach: Attach) -> None:
    with virtual.TDC001() as tdc:
        line = attach(tdc)
        result = stagewire("home", URL, "--unit", "TDC001", "--yes")
    assert result.code == 0
    assert "will home from 0 counts" in result.out
    assert line.count(*MOVES) == line.count(HOME) == 1


def test_one_bay_of_a_rack_can_be_selected(stagewire: Stagewire, attach: Attach) -> None:
    with virtual.BBD102() as rack:
        line = attach(rack)
        which = stagewire("move", URL, "--unit", "BBD102", "--counts", "--to", "9", "--yes")
        assert which.code == 2
        assert "BBD102 has bay 1, bay 2; choose one with --bay" in which.err
        none = stagewire(
            "move", URL, "--unit", "BBD102", "--bay", "3", "--counts", "--to", "9", "--yes"
        )
        assert none.code == 2
        assert "BBD102 has no bay 3; it has bay 1, bay 2" in none.err
        assert line.count(*MOVES) == 0
        result = stagewire(
            "move", URL, "--unit", "BBD102", "--bay", "2", "--counts", "--to", "900", "--yes"
        )
    assert result.code == 0
    assert re.search(r", bay 2: will move from 0\S* \S+ to 900 counts", result.out)
    [sent] = [data for data in line.written if MOVE_ABSOLUTE in data]
    assert sent[4] & 0x7F == 0x22


def test_a_channel_of_a_module_can_be_moved(stagewire: Stagewire, attach: Attach) -> None:
    with virtual.rack(None, "MST601") as rack:
        line = attach(rack)
        result = stagewire(
            "move", URL, "--bay", "2", "--channel", "2", "--counts", "--to", "900", "--yes"
        )
    assert result.code == 0, result.err
    [sent] = [data for data in line.written if MOVE_ABSOLUTE in data]
    at = sent.index(MOVE_ABSOLUTE)
    assert (sent[at + 4] & 0x7F, sent[at + 6]) == (0x22, 2)


def test_an_axis_of_an_ms2000_can_be_moved(stagewire: Stagewire, attach: Attach) -> None:
    with virtual.MS2000() as ms2000:
        attach(ms2000)
        result = stagewire("move", URL, "--unit", "MS2000", "--axis", "x", "--to", "0.1mm", "--yes")
        bare = stagewire("move", URL, "--unit", "MS2000", "--axis", "x", "--to", "0.1", "--yes")
    assert result.code == 0, result.err
    assert "axis X: will move from 0.0000 um to 0.1 mm" in result.out
    assert (bare.code, "as in --to 0.1um or --to 0.1mm" in bare.err) == (2, True)
    assert result.out.endswith("it is at 100.0000 um\n")


@pytest.mark.usefixtures("terminal")
@pytest.mark.parametrize(("answer", "moves"), [(b"y\n", 1), (b"n\n", 0), (b"\n", 0), (b"", 0)])
def test_a_move_requires_a_confirmation(
    stagewire: Stagewire, attach: Attach, answer: bytes, moves: int
) -> None:
    with virtual.TDC001() as tdc:
        line = attach(tdc)
        result = stagewire("move", URL, "--unit", "TDC001", "--counts", "--to", "900", input=answer)
    assert line.count(*MOVES) == moves
    assert result.code == (0 if moves else 1)
    assert ("nothing was moved" in result.out) == (not moves)


@pytest.mark.parametrize("words", [["move", URL, "--to", "1"], ["home", URL]])
def test_without_a_terminal_yes_is_required(
    stagewire: Stagewire, monkeypatch: pytest.MonkeyPatch, words: list[str]
) -> None:
    monkeypatch.setattr(linking, "open_link", lambda *_: pytest.fail("it was opened"))
    result = stagewire(*words)
    assert result.code == 2
    assert "give --yes" in result.err


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--to", "nan"], "not a number"),
        (["--to", "inf"], "number"),
        (["--to", "1e400", "--counts"], "any"),
        (["--to", "x"], "not a number"),
        (["--to", "1", "--by", "1"], "give either --to"),
        ([], "give either --to"),
        (["--to", "0.5", "--counts"], "whole numbers"),
        (["--to", "1"], "--stage or --counts"),
        (["--to", "1", "--stage", "Z9"], "unknown stage Z9"),
        (["--to", "1", "--stage", "Z8", "--scale-source", "vendor"], "no scale of the stage has"),
        (["--to", "13", "--stage", "Z8", "--travel", "12"], "outside the travel"),
        (["--to", "1", "--stage", "Z8", "--channel", "2"], "has no channel 2"),
        (["--to", "1", "--stage", "Z8", "--axis", "X"], "has no axis X"),
        (["--to", "1", "--stage", "Z8", "--travel", "nan"], "nan"),
        (["--to", "1", "--stage", "Z8", "--travel", "1,2,3"], "two ends such as -5,5"),
        (["--to=-6", "--stage", "Z8", "--travel=-5,5"], "outside the travel, -5 to 5 mm"),
        (["--to", "1mm", "--counts"], "whole numbers without a unit"),
        (["--to", "1 km"], "not a number"),
        (["--to", "3deg"], "--stage or --counts"),
        (["--to", "3deg", "--stage", "Z8"], "use a number such as 1.5"),
        (
            ["--to", "3", "--stage", "PRM1_Z8"],
            "PRM1_Z8 is a rotary stage; give degrees, such as --to",
        ),
        (["--by", "3mm", "--stage", "PRM1_Z8"], "such as --by 30deg, or --counts"),
        (["--to", "3deg", "--stage", "PRM1_Z8", "--travel", "9"], "--travel LOW,HIGHdeg"),
        (["--to", "3deg", "--stage", "PRM1_Z8", "--travel", "4,9deg"], "the travel, 4 to 9 deg"),
        (["--to", "3deg", "--stage", "PRM1_Z8", "--travel", "xdeg"], "such as -5,5 or -8,8deg"),
        (
            ["--to", "3", "--stage", "Z8", "--travel", "9deg"],
            "use --travel LOW,HIGH",
        ),
        (
            ["--to", "3deg", "--stage", "CR1_Z7"],
            "use --scale-source document or --scale-source vendor",
        ),
    ],
)
def test_wrong_arguments_move_nothing(
    stagewire: Stagewire, attach: Attach, words: list[str], said: str
) -> None:
    with virtual.TDC001() as tdc:
        line = attach(tdc)
        result = stagewire("move", URL, "--unit", "TDC001", "--yes", *words)
    assert result.code == 2
    assert said in result.err or said == "any"
    assert line.count(*MOVES) == 0


def test_a_unit_that_does_not_move_is_refused(stagewire: Stagewire, attach: Attach) -> None:
    with virtual.TSG001() as reader:
        attach(reader)
        result = stagewire("move", URL, "--unit", "TSG001", "--counts", "--to", "1", "--yes")
    assert result.code == 2
    assert (
        "TSG001 does not support move absolute: its class has no start_move_absolute()"
        in result.err
    )


def test_an_axis_without_relative_moves_suggests_to(stagewire: Stagewire, attach: Attach) -> None:
    with virtual.MS2000() as ms2000:
        attach(ms2000)
        words = ("--unit", "MS2000", "--axis", "X", "--by", "1", "--yes")
        result = stagewire("move", URL, *words)
    assert result.code == 2
    assert "give --to instead" in result.err


def test_a_move_that_takes_too_long_is_stopped(stagewire: Stagewire, attach: Attach) -> None:
    with virtual.TDC001(stage=stages.Z8) as tdc:
        line = attach(tdc)
        result = stagewire("move", URL, "--to", "10", "--timeout", "1", *Z8)
    assert result.code == 1
    assert "the motion took longer than 1 s: stop was sent; it is at" in result.err
    assert line.count(STOP) == 1


def test_a_stop_has_its_own_timeout(stagewire: Stagewire, attach: Attach) -> None:
    with virtual.TDC001(stage=stages.Z8) as tdc:
        line = attach(tdc)
        result = stagewire("move", URL, "--to", "1", "--timeout", "0.3", *Z8)
    assert result.code == 1
    assert "the motion took longer than 0.3 s: stop was sent; it is at 0." in result.err
    assert len(result.err.splitlines()) == 1  # not also that it may still be moving
    assert line.count(STOP) == 1


def test_a_motor_disabled_by_a_stop_is_reported_as_not_moved(
    stagewire: Stagewire, attach: Attach
) -> None:
    x = ("--unit", "MS2000", "--axis", "X")
    with virtual.MS2000() as ms2000:
        attach(ms2000)
        assert stagewire("stop", URL, *x).code == 0
        there = stagewire("move", URL, *x, "--to", "0um", "--yes")
        result = stagewire("move", URL, *x, "--to", "1mm", "--yes")
        counts = stagewire("move", URL, *x, "--counts", "--to", "5", "--yes")
    assert (there.code, result.code, counts.code) == (0, 1, 1)
    assert "it did not move and is still at 0.0000 um; a stop disables" in result.err


def test_ctrl_c_stops_the_axis_and_reports_it(
    stagewire: Stagewire, attach: Attach, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupt(self: Motion, timeout: float | None = None) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(Motion, "wait", interrupt)
    with virtual.TDC001(stage=stages.Z8) as tdc:
        line = attach(tdc)
        result = stagewire("move", URL, "--to", "10", *Z8)
    assert result.code == 130
    assert "interrupted: stop was sent; it is at 0." in result.err
    assert line.count(STOP) == 1


def test_stop_is_sent_first_without_a_confirmation(stagewire: Stagewire, attach: Attach) -> None:
    with virtual.BBD102() as rack:
        line = attach(rack)
        everything = stagewire("stop", URL, "--unit", "BBD102")
        assert (everything.code, everything.err) == (0, "")
        assert everything.out == "bay 1: stopped\nbay 2: stopped\n"
        sent = [name for name in line.sent() if name != "MOT_ACK_DCSTATUSUPDATE"]
        assert sent == ["MOT_MOVE_STOP", "MOT_MOVE_STOP"]
        one = stagewire("stop", URL, "--unit", "BBD102", "--bay", "2")
        assert one.out == "bay 2: stopped\n"
        assert line.count(STOP) == 3


def test_stop_is_sent_to_every_part_even_if_one_is_silent(
    stagewire: Stagewire, attach: Attach
) -> None:
    with virtual.BBD102(empty_bays=[1]) as rack:
        line = attach(rack)
        result = stagewire("stop", URL, "--unit", "BBD102")
    assert result.code == 1
    assert result.out == "bay 2: stopped\n"
    assert "bay 1: " in result.err
    assert line.count(STOP) == 2


def test_stops_are_sent_to_all_parts_before_waiting(
    stagewire: Stagewire, attach: Attach, monkeypatch: pytest.MonkeyPatch
) -> None:
    both = threading.Barrier(2, timeout=20)
    monkeypatch.setattr(BBD102Bay, "stop", lambda self: both.wait())
    with virtual.BBD102() as rack:
        attach(rack)
        assert stagewire("stop", URL, "--unit", "BBD102").code == 0


def test_stop_without_an_answer_is_reported_as_sent(stagewire: Stagewire, attach: Attach) -> None:
    with virtual.MS2000() as ms2000:
        attach(ms2000)
        result = stagewire("stop", URL, "--unit", "MS2000", "--axis", "y")
    assert (result.code, result.out) == (0, "axis Y: stop was sent\n")


JOG = bytes.fromhex("6a04")


@pytest.mark.parametrize(("direction", "stands"), [("forward", "0.1000"), ("REVERSE", "-0.1000")])
def test_a_jog_moves_by_the_stored_step(
    stagewire: Stagewire, attach: Attach, direction: str, stands: str
) -> None:
    with virtual.TDC001(stage=stages.Z8) as tdc:
        line = attach(tdc)
        result = stagewire("jog", URL, direction, *Z8)
    assert (result.code, result.err) == (0, "")
    assert (
        f"will jog {direction} from 0.0000 mm by the stored step of 0.1000 mm (SINGLE_STEP)"
        in result.out
    )
    assert result.out.endswith(f"it is at {stands} mm\n")
    assert line.count(JOG) == 1


def test_a_jog_that_misses_its_target_fails(stagewire: Stagewire, attach: Attach) -> None:
    with virtual.TDC001(stage=stages.Z8, travel=1000) as tdc:
        attach(tdc)
        result = stagewire("jog", URL, "forward", *Z8)
    assert result.code == 1
    assert "from its target" in result.err


@pytest.mark.parametrize(
    ("words", "why"),
    [
        (("forwards", *Z8), "'forwards' is not one of FORWARD, REVERSE"),
        (("3", *Z8), "jog direction '3' is not one of FORWARD, REVERSE"),
        (("forward", "--unit", "TDC001"), "without a terminal to ask for confirmation, give --yes"),
        (("forward", "--unit", "MS2000", "--axis", "X", "--yes"), "MS2000 does not support jog"),
    ],
)
def test_a_jog_with_wrong_arguments_is_not_sent(
    stagewire: Stagewire, attach: Attach, words: tuple[str, ...], why: str
) -> None:
    with virtual.MS2000() if "MS2000" in words else virtual.TDC001(stage=stages.Z8) as controller:
        line = attach(controller)
        result = stagewire("jog", URL, *words)
    assert result.code == 2
    assert why in result.err
    assert line.count(JOG) == 0


def test_stop_accepts_the_options_of_move(stagewire: Stagewire, attach: Attach) -> None:
    with virtual.TDC001(stage=stages.Z8) as tdc:
        line = attach(tdc)
        words = ("--unit", "TDC001", "--stage", "Z8", "--to", "5", "--timeout", "5", "--yes")
        assert stagewire("stop", URL, *words).code == 0
    assert line.count(STOP) == 1
    assert "--stage" not in stagewire("stop", "--help").out


def test_an_unsent_stop_is_reported(
    stagewire: Stagewire, attach: Attach, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Written, "write", lambda line, data: None)  # bytes are lost
    with virtual.TDC001(stage=stages.Z8) as tdc:
        attach(tdc)
        result = stagewire("stop", URL)
    assert result.code == 1
    assert "no stop was sent, because the unit is unknown" in result.err
    assert "--unit" in result.err


def test_a_moving_stage_is_not_moved(stagewire: Stagewire, attach: Attach) -> None:
    with virtual.TDC001(stage=stages.Z8) as tdc:
        line = attach(tdc)
        tdc.write(
            bytes.fromhex("530406 00d001 0100 c0450400")
        )  # to 280,000 counts, sent by another program
        for words in (("move", URL, "--to", "1", *Z8), ("home", URL, "--unit", "TDC001", "--yes")):
            result = stagewire(*words)
            assert result.code == 1
            assert "is already moving" in result.err
    assert line.count(*MOVES) == 0


def test_a_unit_without_a_stop_is_refused(stagewire: Stagewire, attach: Attach) -> None:
    with virtual.TSG001() as reader:
        attach(reader)
        result = stagewire("stop", URL, "--unit", "TSG001")
    assert result.code == 2
    assert "nothing was sent: TSG001 has no stop: none of its messages ends" in result.err


def test_a_stop_ends_the_waveform_of_a_piezo(stagewire: Stagewire, attach: Attach) -> None:
    with virtual.TPZ001() as piezo:
        line = attach(piezo)
        result = stagewire("stop", URL, "--unit", "TPZ001")
    assert result.code == 0
    assert "TPZ001: stop was sent" in result.out
    assert b"".join(line.written).startswith(bytes.fromhex("070701005001"))


@pytest.mark.skipif(os.name != "posix", reason="sends a signal")
def test_ctrl_c_stops_the_axis_in_a_separate_process(tmp_path: Path) -> None:
    with serving("TDC001", "--stage", "Z8", "--log", tmp_path / "log.txt") as url:
        words = ("move", url, "--unit", "TDC001", "--stage", "Z8", "--to", "50", "--yes")
        with subprocess.Popen(
            [*COMMAND, *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        ) as process:
            wait_for(tmp_path / "log.txt", "MOT_MOVE_ABSOLUTE")
            process.send_signal(signal.SIGINT)
            out, err = process.communicate(timeout=30)
    assert process.returncode == 130
    assert "will move from 0.0000 mm to 50 mm" in out
    assert err.startswith("interrupted: stop was sent; it is at ")
    assert "Traceback" not in err
    assert "MOT_MOVE_STOPPED" in (tmp_path / "log.txt").read_text()


@pytest.mark.skipif(os.name != "posix", reason="sends a signal")
@pytest.mark.parametrize(
    ("words", "signal_name"),
    every_nth(
        [
            (("move", "--to", "50", "--stage", "Z8"), "SIGHUP"),
            (("home",), "SIGHUP"),
            (("home",), "SIGTERM"),
        ],
        3,
    ),
)
def test_a_signal_that_ends_the_command_stops_the_stage(
    tmp_path: Path, words: tuple[str, ...], signal_name: str
) -> None:
    number = signal.Signals[signal_name]
    log = tmp_path / "log.txt"
    with serving("TDC001", "--stage", "Z8", "--log", log) as url:
        command = [*COMMAND, words[0], url, "--unit", "TDC001", *words[1:], "--yes"]
        with subprocess.Popen(command, stdout=subprocess.DEVNULL) as process:
            wait_for(log, "MOT_MOVE_ABSOLUTE" if words[0] == "move" else "MOT_MOVE_HOME")
            process.send_signal(number)
            assert process.wait(30) == -number
        wait_for(log, "MOT_MOVE_STOP")


def test_a_move_that_misses_its_target_fails(stagewire: Stagewire) -> None:
    url = "virtual://TDC001?stage=Z8&travel=171520"
    result = stagewire("move", url, "--stage", "Z8", "--to", "10", "--yes")
    assert (result.code, "done" in result.out) == (1, False)
    assert "ended at 4 mm, 6 mm from its target, 10 mm" in result.err
    assert "the forward hardware limit switch is active" in result.err
    by = stagewire("move", url, "--stage", "Z8", "--by", "10", "--yes")
    assert (by.code, "from its target" in by.err) == (1, True)
    assert stagewire("move", url, "--stage", "Z8", "--to", "3", "--yes").code == 0


def test_a_reported_fault_stops_the_move(stagewire: Stagewire, attach: Attach) -> None:
    with virtual.TDC001(quirks=["rich_responses"], answer_unsupported=True) as tdc:
        attach(tdc)
        instrument: Any = tdc.instrument
        instrument.channel(1).enabled = False
        result = stagewire("move", URL, "--counts", "--to", "10", "--yes")
    assert result.code == 1
    assert "the controller reported a fault: stop was sent" in result.err
    assert "HW_RICHRESPONSE code 1, 'Command refused'" in result.err
    assert "likely cause: the channel is disabled" in result.err


@pytest.mark.parametrize(
    ("words", "shown"),
    [
        (("move", URL, *Z8, "--to", "3"), r"at [12]\.\d{4} mm, target 3\.0000 mm"),
        (("home", URL, "--unit", "TDC001", "--yes"), r"at -?\d+ counts\n"),
    ],
    ids=["move", "home"],
)
def test_a_terminal_shows_the_position_of_a_long_motion(
    stagewire: Stagewire,
    attach: Attach,
    monkeypatch: pytest.MonkeyPatch,
    words: tuple[str, ...],
    shown: str,
) -> None:
    with virtual.TDC001(stage=stages.Z8, position=34304) as tdc:
        attach(tdc)
        assert re.search(shown, stagewire(*words).err) is None
    monkeypatch.setattr("stagewire_cli.output._PATIENCE", 0.0)
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    with virtual.TDC001(stage=stages.Z8, position=34304) as tdc:
        attach(tdc)
        assert re.search(shown, stagewire(*words).err)


def test_a_stop_that_cannot_be_sent_says_so(stagewire: Stagewire) -> None:
    result = stagewire("stop", "/dev/nothing", "--unit", "TDC001")
    assert result.code == 1
    assert result.err.startswith("stagewire: no stop was sent: /dev/nothing cannot be opened: ")
