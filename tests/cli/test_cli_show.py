"""``stagewire show``: entries of the registry by name."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from stagewire.protocols import load_protocol

if TYPE_CHECKING:
    from conftest import Stagewire


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("MOT_MOVE_ABSOLUTE", "id 0x0453, to controller, Issue 3, page 45"),
        ("mgmsg_mot_move_absolute", "absolute_distance"),
        ("0x0453", "message MOT_MOVE_ABSOLUTE"),
        ("mot_velparams", "MOT_REQ_VELPARAMS"),
        ("jog_mode", "CONTINUOUS"),
        ("dc_status_bits", "settled"),
        ("servo_cycles", "512/5"),
        ("mls203", "16777216/125"),
        ("MOT_MOVE_JOG", "whether the position counter rises or falls"),
        ("MOT_MOVE_VELOCITY", "whether the position counter rises or falls"),
        ("MOT_MOVE_VELOCITY", "Issue 37, page 87"),
        ("move_direction", "whether the position counter rises or falls"),
        ("apt-clockwise-without-sign", "AlexShkarin/pyLabLib"),
        ("MOT_SET_MOVEVELPARAMS", "without an id"),
        ("k10cr2", "alias K10CR2 (thorlabs_apt)"),
        ("MOT_MOVE_HOME", "evidence: vendor program: Thorlabs/Motion_Control_Examples/Python/"),
        ("MOT_MOVE_HOMED", "evidence: document only"),
        ("TDC001", "evidence: "),
        ("83", "prefix 83 (thorlabs_apt)\nunits: TDC001"),
        ("26", "KST201"),
        ("0453", "message MOT_MOVE_ABSOLUTE"),
        ("453", "message MOT_MOVE_ABSOLUTE"),
        ("KDC101", "unit KDC101"),
        ("Z825B", "stage Z825B"),
        ("LTS300", "unit LTS300"),
        ("LTS300", "stage LTS300"),
        ("absolute_distance", "field absolute_distance"),
        ("MOVE_ABSOLUT", "MOT_MOVE_ABSOLUTE"),
    ],
)
def test_show_prints_an_entry(stagewire: Stagewire, name: str, said: str) -> None:
    result = stagewire("show", name)
    assert result.code == 0, result.err
    assert said in result.out


def test_an_unsupported_unit_is_shown_with_the_reason(
    stagewire: Stagewire, monkeypatch: pytest.MonkeyPatch
) -> None:
    reason = "No document describes its messages."
    entry = {"title": "a liquid crystal controller", "reason": reason, "source": "a catalogue"}
    monkeypatch.setitem(load_protocol("thorlabs_apt").registry(), "unsupported", {"KLC101": entry})
    result = stagewire("show", "klc101")
    assert "unsupported unit KLC101 (thorlabs_apt)" in result.out
    assert reason in result.out


def test_a_prefix_names_all_units_that_have_it(
    stagewire: Stagewire, monkeypatch: pytest.MonkeyPatch
) -> None:
    entry = {"title": "a stage", "reason": "unknown messages", "source": "x", "prefixes": [83]}
    monkeypatch.setitem(load_protocol("thorlabs_apt").registry(), "unsupported", {"M30X": entry})
    assert "units: TDC001, M30X" in stagewire("show", "83").out


def test_json(stagewire: Stagewire) -> None:
    result = stagewire("show", "MOT_MOVE_HOME", "--json")
    assert json.loads(result.out)["id"] == 0x0443


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["MOT_MVOE_ABSOLUTE"], "did you mean MOT_MOVE_ABSOLUTE"),
        (["K10CR3"], "did you mean K10CR2"),
        (["0xZZ"], "nothing in the registry is named 0xZZ"),
        (["velocity", "--protocol", "nothing"], "no protocol nothing is installed"),
        ([""], "nothing in the registry is named"),
    ],
)
def test_wrong_arguments_are_refused(stagewire: Stagewire, arguments: list[str], said: str) -> None:
    result = stagewire("show", *arguments)
    assert result.code == 2
    assert said in result.err


def test_without_a_name_the_kinds_are_counted(stagewire: Stagewire) -> None:
    result = stagewire("show")
    assert result.code == 0
    assert "stagewire show flag-tables" in result.out
    counts = json.loads(stagewire("show", "--json").out)
    assert f" {counts['stages']}   stagewire show stages" in result.out


def test_a_kind_lists_its_entries(stagewire: Stagewire) -> None:
    result = stagewire("show", "flag-tables")
    assert result.out.startswith("flag tables (")
    assert "dc_status_bits" in result.out
    assert "MOT_MOVE_HOME" not in result.out


def test_an_ambiguous_part_lists_candidates_by_kind(stagewire: Stagewire) -> None:
    result = stagewire("show", "kdc10")
    assert result.code == 0
    assert "units (1)\n  KDC101\n" in result.out
    assert "flag tables (1)\n  kdc101_status_bits\n" in result.out
    lines = [json.loads(line) for line in stagewire("show", "kdc10", "--json").out.splitlines()]
    assert {"kind": "unit", "name": "KDC101", "protocol": "thorlabs_apt"} in lines


def test_a_part_finds_bits_and_values(stagewire: Stagewire) -> None:
    assert "dc_status_bits.homing" in stagewire("show", "homing").out
    assert "jog_mode.CONTINUOUS" in stagewire("show", "continuou").out


def test_stages_of_a_file_are_shown(stagewire: Stagewire, tmp_path: Path) -> None:
    path = tmp_path / "stages.toml"
    path.write_text(
        '[slide]\nunit = "mm"\ntravel = 50\n[slide.counts_per_unit]\nposition = "40000/3"\n'
    )
    result = stagewire("show", "slide", "--stages", str(path))
    assert result.out.startswith(f"stage slide ({path})\n")
    assert "position 40000/3 counts per mm" in result.out
    assert "slide" in stagewire("show", "stages", "--stages", str(path)).out


def test_misspelled_units_and_stages_are_suggested(stagewire: Stagewire) -> None:
    for wrong, right in (("KDC110", "KDC101"), ("Z825BB", "Z825B"), ("LTS33", "LTS300")):
        result = stagewire("show", wrong)
        assert result.code == 2
        assert "did you mean " in result.err
        assert right in result.err
