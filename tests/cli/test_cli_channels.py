"""The command for units whose channels are enabled one at a time, paddles, and units that move nothing."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from attached_controller import URL, Written, attached

import stagewire_virtual as virtual
from stagewire_apt import messages as m

if TYPE_CHECKING:
    from conftest import Stagewire

STEPS = bytes.fromhex("d408")  # an absolute move of an inertial motor
STATE = bytes.fromhex("cb04")  # MOT_SET_SOL_STATE
MOVE = bytes.fromhex("5304")
HOME = bytes.fromhex("4304")
ENABLED = bytes.fromhex("c0080600d0012b00")  # PZMOT_SET_KCUBECHANENABLEMODE

Attach = Callable[[virtual.VirtualController], Written]


@pytest.fixture
def attach(monkeypatch: pytest.MonkeyPatch) -> Attach:
    return partial(attached, monkeypatch)


def test_a_disabled_channel_is_not_moved_without_enable(
    stagewire: Stagewire, attach: Attach
) -> None:
    with virtual.KIM101() as kim:
        line = attach(kim)
        result = stagewire(
            "move", URL, "--unit", "KIM101", "--channel", "3", "--counts", "--to", "200", "--yes"
        )
    assert result.code == 1
    assert "give --enable, which disables the others" in result.err
    assert line.count(STEPS) == line.count(ENABLED) == 0


def test_enable_enables_one_channel_and_moves_it(stagewire: Stagewire, attach: Attach) -> None:
    words = ("--unit", "KIM101", "--channel", "3", "--counts", "--enable", "--yes")
    with virtual.KIM101() as kim:
        line = attach(kim)
        first = stagewire("move", URL, *words, "--to", "200")
        second = stagewire("move", URL, *words, "--by", "-50")
    assert (first.code, first.err) == (0, "")
    assert (
        ": will enable the channel, disable the others and move from 0 counts to 200" in first.out
    )
    assert first.out.endswith("it is at 200 counts\n")
    assert second.out.endswith("it is at 150 counts\n")
    [sent] = [data for data in line.written if STEPS in data]
    assert sent[6] == 0x04  # the bit of channel 3


@pytest.mark.parametrize(("direction", "place"), [("forward", "250"), ("reverse", "-250")])
def test_a_jog_names_its_stored_step(
    stagewire: Stagewire, attach: Attach, direction: str, place: str
) -> None:
    with virtual.KIM101() as kim:
        attach(kim)
        result = stagewire(
            "jog", URL, direction, "--unit", "KIM101", "--channel", "2", "--enable", "--yes"
        )
    assert (result.code, result.err) == (0, "")
    assert "from 0 counts by the stored step of 250 counts (SINGLE_STEP)" in result.out
    assert result.out.endswith(f"it is at {place} counts\n")


def test_a_paddle_moves_in_degrees(stagewire: Stagewire, attach: Attach) -> None:
    words = ("--unit", "MPC320", "--channel", "2", "--enable", "--yes")
    with virtual.MPC320() as mpc:
        attach(mpc)
        result = stagewire("move", URL, "--to", "45deg", *words)
    assert (result.code, result.err) == (0, "")
    assert "move from 0.0000 deg to 45 deg" in result.out
    assert "it is at 45.0" in result.out


def test_an_inertial_stage_homes_and_jogs(stagewire: Stagewire, attach: Attach) -> None:
    with virtual.PDXC2() as pdx:
        attach(pdx)
        home = stagewire("home", URL, "--unit", "PDXC2", "--enable", "--yes")
        jog = stagewire("jog", URL, "forward", "--unit", "PDXC2", "--enable", "--yes")
    assert (home.code, jog.code) == (0, 0), home.err + jog.err
    assert "will enable the channel and home from " in home.out
    assert "by the stored step of 100 counts (SINGLE_STEP)" in jog.out
    assert jog.out.endswith("it is at 100 counts\n")


def test_a_move_of_a_unit_with_other_motions_names_them(
    stagewire: Stagewire, attach: Attach
) -> None:
    with virtual.PDXC2() as pdx:
        attach(pdx)
        result = stagewire("move", URL, "--unit", "PDXC2", "--counts", "--by", "5", "--yes")
    assert result.code == 2
    assert "no start_move_relative(); in Python, use home() or jog() or move_start()" in result.err


def test_a_jog_of_a_paddle_prints_its_own_stored_step(stagewire: Stagewire, attach: Attach) -> None:
    with virtual.MPC320() as mpc:
        mpc.write(
            m.PolSetParams(
                velocity=50, home_position=0, jog_step1=8, jog_step2=16, jog_step3=24
            ).pack(dest=0x50, source=0x01)
        )
        attach(mpc)
        words = ("--unit", "MPC320", "--channel", "2", "--enable", "--yes")
        result = stagewire("jog", URL, "forward", *words)
    assert result.code == 0, result.err
    assert "by the stored step of 1.9854 deg" in result.out


@pytest.mark.parametrize("unit", ["KSC101", "TSC001"])
@pytest.mark.parametrize(
    "words", [("--counts", "--to", "1"), ("--counts", "--by", "1"), ("--to", "1")]
)
def test_a_move_does_not_open_a_shutter(
    stagewire: Stagewire, attach: Attach, unit: str, words: tuple[str, ...]
) -> None:
    with getattr(virtual, unit)() as shutter:
        line = attach(shutter)
        result = stagewire("move", URL, "--unit", unit, *words, "--yes")
    assert result.code == 2
    assert "does not support move" in result.err
    assert line.count(STATE) == line.count(MOVE) == 0


def test_the_monitor_has_a_row_for_each_channel_with_its_own_columns(
    stagewire: Stagewire, attach: Attach
) -> None:
    with virtual.KIM101() as kim:
        attach(kim)
        moved = stagewire(
            "move", URL, "--unit", "KIM101", "--channel", "3", "--counts", "--to", "200",
            "--enable", "--yes",
        )  # fmt: skip
        result = stagewire("monitor", URL, "--unit", "KIM101", "--for", "0.3", "--json")
    assert (moved.code, result.code) == (0, 0), moved.err + result.err
    rows = [json.loads(line) for line in result.out.splitlines()]
    positions = {row["part"]: row["position_counts"] for row in rows}
    assert positions == {"channel 1": 0, "channel 2": 0, "channel 3": 200, "channel 4": 0}
    columns = {key for row in rows for key in row}
    assert not {
        key for key in columns if key.startswith(("position_1", "position_4", "chan_ident"))
    }
    assert {row["channel_enabled"] for row in rows if row["part"] == "channel 3"} == {True}
    assert {row["channel_enabled"] for row in rows if row["part"] == "channel 1"} == {False}


def test_the_recording_of_a_move_has_the_columns_of_its_channel(
    stagewire: Stagewire, attach: Attach, tmp_path: Path
) -> None:
    file = tmp_path / "move.csv"
    words = ("--channel", "3", "--counts", "--to", "200", "--enable", "--yes", "--csv", str(file))
    with virtual.KIM101() as kim:
        attach(kim)
        result = stagewire("move", URL, "--unit", "KIM101", *words)
    assert result.code == 0, result.err
    with file.open(encoding="utf-8", newline="") as lines:
        rows = list(csv.DictReader(lines))
    assert "position_3_counts" not in rows[0]
    assert {row["channel_enabled"] for row in rows} == {"True"}
    assert 0 < int(rows[-1]["position_counts"]) <= 200


def test_only_units_whose_channels_exclude_each_other_announce_that_others_are_disabled(
    stagewire: Stagewire, attach: Attach
) -> None:
    words = ("--channel", "1", "--counts", "--by", "100", "--enable", "--yes")
    with virtual.BSC002() as bsc:
        attach(bsc)
        result = stagewire("move", URL, "--unit", "BSC002", *words)
    assert result.code == 0, result.err
    assert ": will enable the channel and move from 0 counts by 100 counts" in result.out


def test_warnings_name_the_option_that_enables_a_channel(
    stagewire: Stagewire, attach: Attach
) -> None:
    with virtual.MPC320() as mpc:
        attach(mpc)
        seen = stagewire("monitor", URL, "--unit", "MPC320", "--for", "0.3")
        homed = stagewire("home", URL, "--unit", "MPC320", "--channel", "2", "--yes")
    assert (
        seen.err.count("refused: the channel is disabled; give --enable to move, home or jog\n")
        == 3
    )
    assert homed.code == 1
    [line] = homed.err.splitlines()  # the error of the motion, and no warnings
    assert line.endswith("; give --enable")


def test_enable_is_refused_for_a_unit_without_channels_to_enable(
    stagewire: Stagewire, attach: Attach
) -> None:
    with virtual.MLJ050() as jack:
        line = attach(jack)
        result = stagewire("home", URL, "--unit", "MLJ050", "--enable", "--yes")
    assert result.code == 2
    assert "no motor channel that can be enabled" in result.err
    assert line.count(HOME) == 0


def test_the_monitor_has_a_row_for_each_paddle(stagewire: Stagewire, attach: Attach) -> None:
    with virtual.MPC320() as mpc:
        attach(mpc)
        result = stagewire("monitor", URL, "--unit", "MPC320", "--for", "0.3", "--json")
    parts = {json.loads(line)["part"] for line in result.out.splitlines()}
    assert parts == {"channel 1", "channel 2", "channel 3"}
