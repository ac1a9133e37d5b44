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
        ([], "Missing argument"),
        (["MOT_MOVE_ABSOLUT"], "did you mean MOT_MOVE_ABSOLUTE"),
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
