"""The command on protocols of commands: which way, which axis, which form, what is said of wrong bytes."""

from __future__ import annotations

import csv
import io
import json
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from conftest import Stagewire

MOVE = "18 54 03 A0 86 01 3A"
# A move that has lost a byte and swallows the command behind it, a setup command, what no command is,
# a command, and the beginning of one.
STREAM = bytes.fromhex("18 54 03 A0 86 3A 18 3F 3A  FF 42  6A 75 6E 6B 3A  18 3F 3A  18 61")


def test_a_command_as_a_table(stagewire: Stagewire) -> None:
    result = stagewire("decode", "--direction", "command", MOVE)
    assert (result.code, result.err) == (0, "")
    lines = result.out.splitlines()
    assert lines[0] == "WRITE_TARGET_POSITION (byte 0x54, section Write Target Position (move))"
    assert lines[1] == "form request, axis 0x18 (X)"
    assert lines[-1].split() == ["0", "target_position", "100000", "10000", "um"]


def test_a_reply_by_its_command_in_any_case(stagewire: Stagewire) -> None:
    result = stagewire("decode", "--command", "read_motor_position", "--json", "60 79 FE")
    assert result.code == 0
    answer = json.loads(result.out)
    assert answer == {
        "id": 1, "ok": True, "message": "READ_MOTOR_POSITION", "kind": "command", "form": "reply",
        "fields": {"position": -100000},
    }  # fmt: skip


@pytest.mark.parametrize(
    ("hex", "form", "axis"),
    [
        ("18 3F 3A", "request", 24),
        ("02 3F 00 3A", "request:with_size", 2),
        ("18 69 3A", "request:without_size", 24),
        ("FF 41", "request", None),
    ],
)
def test_both_forms_and_any_axis(
    stagewire: Stagewire, hex: str, form: str, axis: int | None
) -> None:
    answer = json.loads(stagewire("decode", "--direction", "command", "--json", hex).out)
    assert (answer["form"], answer.get("axis")) == (form, axis)


@pytest.mark.parametrize(
    ("words", "code", "marked"),
    [
        (["--direction", "command", "18 6C 03 3A"], "bad_length", "03"),
        (["--direction", "command", "18 99 3A"], "unknown_message", "99"),
        (["--direction", "command", "FF 99"], "unknown_message", "99"),
        (["--direction", "command", "18 3F 3A 18 47 3A"], "trailing", "18 47 3A"),
        (["--direction", "command", "18 54 03 A0 86"], "truncated", ""),
        (["--direction", "command", "18 3A"], "truncated", ""),
        (["--command", "READ_STATUS", "42 62"], "trailing", "62"),
        (["--command", "READ_MOTOR_POSITION", "42"], "truncated", ""),
        (["--command", "STOP_MOTOR", "42"], "bad_length", ""),
    ],
)
def test_the_wrong_bytes_are_marked(
    stagewire: Stagewire, words: list[str], code: str, marked: str
) -> None:
    result = stagewire("decode", *words)
    assert result.code == 1
    shown, marks, said = result.out.splitlines()[:3]
    assert said.startswith(f"{code}: ")
    columns = [i for i in range(0, len(marks), 3) if marks[i : i + 2] == "^^"]
    assert columns
    assert " ".join(shown[i : i + 2] for i in columns).strip() == marked


def test_a_stream_of_commands(stagewire: Stagewire, tmp_path: Path) -> None:
    path = tmp_path / "host.bin"
    path.write_bytes(STREAM)
    result = stagewire("decode", "--direction", "command", path)
    assert result.code == 1  # its end is incomplete
    assert [line.strip() for line in result.out.splitlines()] == [
        "0  axis 0x18 (X) WRITE_TARGET_POSITION target_position=3835552 extra=183f",
        "9  setup SWITCH_TO_LOW_LEVEL",
        "11  unknown: 6A 75 6E 6B 3A",
        "16  axis 0x18 (X) READ_STATUS",
        "19  incomplete at the end: 18 61",
    ]
    assert result.err == "21 bytes: 3 message, 1 unknown, 2 bytes incomplete\n"


def test_a_stream_as_rows(stagewire: Stagewire) -> None:
    result = stagewire(
        "decode", "--direction", "command", "--format", "csv", "-", input=STREAM[:-2]
    )
    assert result.code == 0
    rows = list(csv.DictReader(io.StringIO(result.out)))
    assert [(row["offset"], row["event"], row["message"], row["axis"]) for row in rows] == [
        ("0", "message", "WRITE_TARGET_POSITION", "24"),
        ("9", "message", "SWITCH_TO_LOW_LEVEL", ""),
        ("11", "unknown", "", ""),
        ("16", "message", "READ_STATUS", "24"),
    ]
    assert json.loads(rows[0]["fields"]) == {"target_position": 3835552}
    assert (rows[0]["extra"], rows[2]["hex"]) == ("183f", "6a756e6b3a")


@pytest.mark.parametrize("format", ["table", "jsonl", "csv"])
def test_one_message_of_a_stream(stagewire: Stagewire, format: str) -> None:
    words = ("--message", "read_status", "--format", format)
    result = stagewire("decode", *words, "-", input=STREAM[:-2])
    assert result.code == 0
    lines = [line for line in result.out.splitlines() if not line.startswith("offset,")]
    assert len(lines) == 1
    assert "READ_STATUS" in lines[0]


def test_captures_of_replies(stagewire: Stagewire) -> None:
    lines = b'{"hex": "A08601"}\n{"hex": "FFFFFF"}\n'
    result = stagewire("decode", "--command", "READ_TARGET_POSITION", "--json", "-", input=lines)
    assert result.code == 0
    found = [json.loads(line)["fields"] for line in result.out.splitlines()]
    assert found == [{"target_position": 100000}, {"target_position": -1}]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["decode", "--direction", "reply", "00"], "name its command by --command"),
        (["decode", "--direction", "command", "--command", "READ_STATUS", "62"], "contradicts"),
        (["decode", "--command", "NONSENSE", "00"], "--command: no installed protocol has"),
        (["decode", "--command", "READ_STATUS", "--end", "host", "62"], "cannot be cut"),
        (["decode", "--direction", "command", "--end", "host", "62"], "cannot be cut"),
        (["decode", "--direction", "command", "--protocol", "thorlabs_apt", "00"], "frames of thorlabs"),
        (["decode", "--direction", "command", "--status", "dc", "00"], "--status: "),
        (["encode", "WRITE_TARGET_POSITION", "target_position=1"], "lacks axis"),
        (["encode", "WRITE_TARGET_POSITION", "--axis", "W", "target_position=1"], "--axis takes"),
        (["encode", "WRITE_TARGET_POSITION", "--axis", "58", "target_position=1"], "0x3a"),
        (["encode", "WRITE_TARGET_POSITION", "--axis", "X", "target_position=8388608"], " to 8388607"),
        (["encode", "WRITE_TARGET_POSITION", "--axis", "X"], "lacks target_position"),
        (["encode", "WRITE_TARGET_POSITION", "--dest", "1", "target_position=1"], "--dest says nothing"),
        (["encode", "MOT_MOVE_HOME", "--axis", "X", "chan_ident=1"], "--axis says nothing"),
        (["encode", "WRITE_START_SPEED", "--axis", "X", "start_speed=1"], "dummy"),
        (["encode", "READ_STATUS", "--axis", "X", "--form", "request:without_size"], "no form"),
        (["encode", "NONSENSE"], "no installed protocol has a message NONSENSE"),
        (["encode", "READ_STATU", "--axis", "X"], "did you mean READ_STATUS"),
    ],
)  # fmt: skip
def test_called_wrongly(stagewire: Stagewire, words: list[str], said: str) -> None:
    result = stagewire(*words)
    assert (result.code, result.out) == (2, "")
    assert said in " ".join(result.err.split())


@pytest.mark.parametrize(
    ("words", "hex"),
    [
        (["write_target_position", "--axis", "x", "target_position=100000"], MOVE),
        (["WRITE_TARGET_POSITION", "--axis", "0x02", "target_position=-1"], "02 54 03 FF FF FF 3A"),
        (["READ_STATUS", "--axis", "X"], "18 3F 3A"),
        (["READ_STATUS", "--axis", "X", "--form", "request:with_size"], "18 3F 00 3A"),
        (["READ_STATUS", "--form", "reply", "status=NOT_BUSY"], "62"),
        (["READ_IDENTIFICATION", "--form", "reply", "identification=EMOT :"], "45 4D 4F 54 20 3A"),
        (["RESET_CONTROLLER"], "FF 52"),
        (["READ_START_SPEED", "--axis", "X", "--allow-dummy"], "18 72 02 3A"),
        (["MOT_MOVE_HOME", "chan_ident=1"], "43 04 01 00 50 01"),
    ],
)
def test_encode(stagewire: Stagewire, words: list[str], hex: str) -> None:
    result = stagewire("encode", *words)
    assert (result.code, result.out.strip(), result.err) == (0, hex, "")


def test_a_value_that_looks_like_a_setup_command(stagewire: Stagewire) -> None:
    words = ("encode", "WRITE_TARGET_POSITION", "--axis", "X", "target_position=16895")
    assert stagewire(*words).out.strip() == "18 54 03 FF 41 00 3A"
    result = stagewire(*words, "--refuse-prefix-bytes")
    assert result.code == 2
    for part in ("SWITCH_TO_HIGH_LEVEL", "16894", "16896"):
        assert part in result.err


def test_show(stagewire: Stagewire) -> None:
    result = stagewire("show", "READ_MOTOR_POSITION_AND_STATUS")
    assert result.code == 0
    for part in (
        "byte 0x6c",
        "section Read Motor Position and Status",
        "keyboard: l",
        "size: 4",
        "s24",
    ):
        assert part in result.out
    both = stagewire("show", "0x42").out
    assert "message STOP_MOTOR (asi_ms2000)" in both
    assert "message SWITCH_TO_LOW_LEVEL (asi_ms2000)" in both
    assert "no size slot" in both
    assert "dummy: True" in stagewire("show", "READ_START_SPEED").out
