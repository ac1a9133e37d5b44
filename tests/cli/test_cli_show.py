"""``stagewire show``: entries of the registry by name."""

from __future__ import annotations

import json
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
        ("0453", "message MOT_MOVE_ABSOLUTE"),
        ("move_absolut", "message MOT_MOVE_ABSOLUTE"),
        ("absolute_dist", "field absolute_distance (thorlabs_apt)\nmessages: MOT_MOVE_ABSOLUTE"),
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
        (["MOT_MOVE_ABSOLTE"], "did you mean MOT_MOVE_ABSOLUTE"),
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


def test_a_part_of_names_lists_them_by_kind(stagewire: Stagewire) -> None:
    assert stagewire("show", "Vel", "params").out == (
        "messages (4)\n"
        "  MOT_SET_VELPARAMS, MOT_REQ_VELPARAMS, MOT_GET_VELPARAMS, MOT_SET_MOVEVELPARAMS\n"
        "parameter sets (1)\n"
        "  MOT_VELPARAMS\n"
    )


def test_names_of_units_and_stages_are_found_by_a_part(stagewire: Stagewire) -> None:
    assert "units (1)\n  KDC101\n" in stagewire("show", "KDC1").out
    assert "stages (4)\n  Z825, Z825B, " in stagewire("show", "Z82").out


def test_without_a_name_every_kind_is_listed(stagewire: Stagewire) -> None:
    said = stagewire("show").out
    registry = load_protocol("thorlabs_apt").registry()
    assert f"stages ({len(registry['stages'])})\n" in said
    assert {"messages", "units", "fields", "enumerations"} <= {
        line.partition(" (")[0] for line in said.splitlines()
    }
    assert all(len(line) <= 100 for line in said.splitlines() if line.startswith("  "))


def test_json_lists_all_names(stagewire: Stagewire) -> None:
    listed = json.loads(stagewire("show", "--json").out)
    assert "MOT_MOVE_ABSOLUTE" in listed["message"]
    assert "LTS300" in listed["stage"]
