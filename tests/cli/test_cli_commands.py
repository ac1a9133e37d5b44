"""The command with protocols of commands: directions, axes, forms, and errors for invalid bytes."""

from __future__ import annotations

import csv
import io
import json
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from pyarrow import parquet

if TYPE_CHECKING:
    from conftest import Stagewire

MOVE = "18 54 03 A0 86 01 3A"
# A move that lacks a byte and swallows the following command, a setup command, an unknown command,
# a command, and an incomplete one.
STREAM = bytes.fromhex("18 54 03 A0 86 3A 18 3F 3A  FF 42  6A 75 6E 6B 3A  18 3F 3A  18 61")


def test_a_command_is_shown_as_a_table(stagewire: Stagewire) -> None:
    result = stagewire("decode", "--direction", "command", MOVE)
    assert (result.code, result.err) == (0, "")
    lines = result.out.splitlines()
    assert lines[0] == "WRITE_TARGET_POSITION (byte 0x54, section Write Target Position (move))"
    assert lines[1] == "form request, axis 0x18 (X)"
    assert lines[-1].split() == ["0", "target_position", "100000", "10000", "um"]


def test_a_reply_is_decoded_by_its_command_in_any_case(stagewire: Stagewire) -> None:
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
def test_both_forms_and_any_axis_are_decoded(
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
        (["--direction", "command", "18 3A"], "bad_length", "3A"),
        (["--direction", "command", "3A"], "bad_length", "3A"),
        (["--direction", "command", "18 3F 00 FF"], "truncated", ""),
        (["--direction", "command", "FF 41 3A"], "trailing", "3A"),
        (["--command", "READ_STATUS", "42 62"], "trailing", "62"),
        (["--command", "READ_MOTOR_POSITION", "42"], "truncated", ""),
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


def test_wrong_bytes_far_from_the_beginning_are_shown(stagewire: Stagewire) -> None:
    result = stagewire("decode", "--direction", "command", "18 3F 00" + " 11" * 256)
    shown, marks, said = result.out.splitlines()
    assert shown == "... " + " ".join(["11"] * 64)
    assert marks == " " * (4 + 3 * 63) + "^^"
    assert said.startswith("bad_length: READ_STATUS: 0x3a must follow within 259 bytes")


def test_no_byte_is_marked_if_none_is_wrong(stagewire: Stagewire) -> None:
    result = stagewire("decode", "--command", "STOP_MOTOR", "42")
    assert result.code == 1
    assert result.out.splitlines() == ["42", "bad_length: STOP_MOTOR has no reply"]


def test_a_stream_of_commands_is_decoded(stagewire: Stagewire, tmp_path: Path) -> None:
    path = tmp_path / "host.bin"
    path.write_bytes(STREAM)
    result = stagewire("decode", "--direction", "command", path)
    assert result.code == 1  # the end is incomplete
    assert [line.strip() for line in result.out.splitlines()] == [
        "0  axis 0x18 (X) WRITE_TARGET_POSITION target_position=3835552 extra=183f",
        "9  setup SWITCH_TO_LOW_LEVEL",
        "11  unknown: 6A 75 6E 6B 3A",
        "16  axis 0x18 (X) READ_STATUS",
        "19  incomplete at the end: 18 61",
    ]
    assert result.err == "21 bytes: 3 message, 1 unknown, 2 bytes incomplete\n"


def test_a_stream_is_written_as_rows(stagewire: Stagewire) -> None:
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


FORMS = b"18 3F 3A 18 3F 00 3A FF 41 19 3F 3A 1A 3F 00 3A 18 47 3A"


@pytest.mark.parametrize("format", ["jsonl", "csv"])
@pytest.mark.parametrize(
    ("message", "offsets"),
    [
        ("READ_STATUS", [0, 3, 9, 12]),
        ("read_status:request", [0, 9]),
        ("READ_STATUS:request:with_size", [3, 12]),
        ("SWITCH_TO_HIGH_LEVEL:request", [7]),
        ("START_MOTOR", [16]),
        ("START_MOTOR:request:with_size", []),
    ],
)
def test_one_form_of_a_command_can_be_selected(
    stagewire: Stagewire, format: str, message: str, offsets: list[int]
) -> None:
    result = stagewire("decode", "--message", message, "--format", format, "-", input=FORMS)
    assert result.code == 0
    if format == "csv":
        found = [int(row["offset"]) for row in csv.DictReader(io.StringIO(result.out))]
    else:
        found = [json.loads(line)["offset"] for line in result.out.splitlines()]
    assert found == offsets


def test_a_command_has_typed_columns(stagewire: Stagewire, tmp_path: Path) -> None:
    chosen = ["--message", "WRITE_TARGET_POSITION"]
    more = bytes.fromhex("19 54 03 FF FF FF 3A")
    result = stagewire("decode", *chosen, "--format", "csv", "-", input=STREAM[:-2] + more)
    assert result.out.split() == [
        "offset,axis,target_position,extra",
        "0,24,3835552,183f",
        "19,25,-1,",
    ]
    target = tmp_path / "typed.parquet"
    chosen += ["--format", "parquet", "--output", str(target)]
    assert stagewire("decode", *chosen, "-", input=STREAM[:-2] + more).code == 0
    table = parquet.read_table(target)
    assert [str(field.type) for field in table.schema] == ["uint64", "uint8", "int32", "binary"]
    assert table.to_pylist() == [
        {"offset": 0, "axis": 24, "target_position": 3835552, "extra": b"\x18\x3f"},
        {"offset": 19, "axis": 25, "target_position": -1, "extra": None},
    ]


@pytest.mark.parametrize(
    ("command", "replies", "types", "rows"),
    [
        (
            "READ_MOTOR_POSITION_AND_STATUS",
            ["A0860142", "FFFFFF0A"],
            {"position": "int32", "status": "uint8"},
            [{"position": 100000, "status": 0x42}, {"position": -1, "status": 10}],
        ),
        (
            "READ_IDENTIFICATION",
            ["454D4F54203A"],
            {"identification": "string"},
            [{"identification": "EMOT :"}],
        ),
        ("READ_MAXIMUM_SPEED", ["FFFF"], {"maximum_speed": "uint16"}, [{"maximum_speed": 65535}]),
    ],
)
def test_replies_have_typed_columns(
    stagewire: Stagewire,
    tmp_path: Path,
    command: str,
    replies: list[str],
    types: dict[str, str],
    rows: list[dict[str, object]],
) -> None:
    lines = json.dumps(replies).encode()
    chosen = ["--command", command, "--message", command.lower()]
    result = stagewire("decode", *chosen, "--format", "csv", "-", input=lines)
    assert result.code == 0
    found = list(csv.DictReader(io.StringIO(result.out)))
    assert list(found[0]) == ["offset", "axis", *types, "extra"]
    assert [{name: row[name] for name in types} for row in found] == [
        {name: str(value) for name, value in row.items()} for row in rows
    ]
    target = tmp_path / "typed.parquet"
    chosen += ["--format", "parquet", "--output", str(target)]
    assert stagewire("decode", *chosen, "-", input=lines).code == 0
    table = parquet.read_table(target)
    assert {name: str(table.schema.field(name).type) for name in types} == types
    assert table.select(list(types)).to_pylist() == rows


def test_a_refused_reply_is_not_in_typed_columns(stagewire: Stagewire) -> None:
    chosen = ["--command", "READ_STATUS", "--message", "READ_STATUS:reply", "--format", "csv"]
    result = stagewire("decode", *chosen, "-", input=b'["42", "4242"]')
    assert (result.code, result.out.split()) == (1, ["offset,axis,status,extra", "0,,66,"])
    assert result.err.startswith("entry 2: trailing: ")


@pytest.mark.parametrize("format", ["table", "jsonl"])
def test_one_message_of_a_stream_can_be_selected(stagewire: Stagewire, format: str) -> None:
    words = ("--message", "read_status", "--format", format)
    result = stagewire("decode", *words, "-", input=STREAM[:-2])
    assert result.code == 0
    (line,) = result.out.splitlines()
    assert "READ_STATUS" in line


def test_json_captures_can_be_replies(stagewire: Stagewire) -> None:
    lines = b'{"hex": "A08601"}\n{"hex": "FFFFFF"}\n'
    result = stagewire("decode", "--command", "READ_TARGET_POSITION", "--json", "-", input=lines)
    assert result.code == 0
    found = [json.loads(line)["fields"] for line in result.out.splitlines()]
    assert found == [{"target_position": 100000}, {"target_position": -1}]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["decode", "--direction", "reply", "00"], "a reply does not name its command"),
        (["decode", "--direction", "command", "--command", "READ_STATUS", "62"], "contradicts"),
        (["decode", "--command", "NONSENSE", "00"], "--command: no installed protocol has"),
        (["decode", "--command", "READ_STATUS", "--end", "host", "62"], "stream of replies cannot"),
        (["decode", "--direction", "command", "--end", "host", "62"], "stream of replies cannot"),
        (["decode", "--direction", "command", "--protocol", "thorlabs_apt", "00"], "frames of thorlabs"),
        (
            ["decode", "--direction", "command", "--status", "dc", "00"],
            "low-level command set depends on 'status', or on any other context",
        ),
        (
            ["decode", "--direction", "command", "--message", "READ_STATUS:reply", MOVE],
            "READ_STATUS:reply is not a command; decode replies with --command READ_STATUS",
        ),
        (["decode", "--message", "READ_STATUS:reply", MOVE], "READ_STATUS:reply is not a command"),
        (["decode", "--message", "START_MOTOR:reply", MOVE], "START_MOTOR has no form reply"),
        (["decode", "--message", "READ_STATUS:", MOVE], "READ_STATUS has no form"),
        (
            ["decode", "--command", "READ_STATUS", "--message", "READ_MOTOR_POSITION", "42"],
            "replies to READ_STATUS are READ_STATUS:reply, not READ_MOTOR_POSITION",
        ),
        (
            ["decode", "--command", "READ_STATUS", "--message", "READ_STATUS:request", "42"],
            ", not READ_STATUS:request",
        ),
        (
            ["decode", "--command", "READ_STATUS", "--message", "READ_MOTOR_POSITION:reply", "42"],
            ", not READ_MOTOR_POSITION:reply",
        ),
        (["decode", "--command", "STOP_MOTOR", "--message", "STOP_MOTOR", "42"], "has no reply"),
        (["encode", "WRITE_TARGET_POSITION", "target_position=1"], "lacks axis"),
        (
            ["encode", "WRITE_TARGET_POSITION", "--axis", "Q", "target_position=1"],
            "--axis must be X (0x18), Y (0x19), Z (0x1a), ",
        ),
        (["encode", "READ_STATUS", "--axis", "X", "data=00"], "has no field data"),
        (["encode", "READ_STATUS", "--form", "reply", "status=66", "data=00"], "has no field data"),
        (["encode", "SWITCH_TO_LOW_LEVEL", "data=00"], "has no field data"),
        (
            ["encode", "SWITCH_TO_LOW_LEVEL", "--allow-dummy"],
            "a setup command has no allow_dummy; only a command has",
        ),
        (
            ["encode", "READ_STATUS", "--form", "reply", "status=66", "--allow-dummy"],
            "a reply has no allow_dummy; only a command has",
        ),
        (["encode", "WRITE_TARGET_POSITION", "--axis", "58", "target_position=1"], "0x3a"),
        (["encode", "WRITE_TARGET_POSITION", "--axis", "X", "target_position=8388608"], " to 8388607"),
        (["encode", "WRITE_TARGET_POSITION", "--axis", "X"], "lacks target_position"),
        (["encode", "WRITE_TARGET_POSITION", "--dest", "1", "target_position=1"], "--dest does not apply"),
        (["encode", "MOT_MOVE_HOME", "--axis", "X", "chan_ident=1"], "--axis does not apply"),
        (["encode", "WRITE_START_SPEED", "--axis", "X", "start_speed=1"], "dummy"),
        (["encode", "READ_STATUS", "--axis", "X", "--form", "request:without_size"], "no form"),
        (["encode", "NONSENSE"], "no installed protocol has a message NONSENSE"),
        (["encode", "READ_STATU", "--axis", "X"], "did you mean READ_STATUS"),
    ],
)  # fmt: skip
def test_wrong_arguments_are_refused(stagewire: Stagewire, words: list[str], said: str) -> None:
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
def test_a_message_is_encoded(stagewire: Stagewire, words: list[str], hex: str) -> None:
    result = stagewire("encode", *words)
    assert (result.code, result.out.strip(), result.err) == (0, hex, "")


def test_a_value_that_looks_like_a_setup_command_can_be_refused(stagewire: Stagewire) -> None:
    words = ("encode", "WRITE_TARGET_POSITION", "--axis", "X", "target_position=16895")
    assert stagewire(*words).out.strip() == "18 54 03 FF 41 00 3A"
    result = stagewire(*words, "--refuse-prefix-bytes")
    assert result.code == 2
    for part in ("SWITCH_TO_HIGH_LEVEL", "16894", "16896"):
        assert part in result.err


def test_show_prints_an_entry(stagewire: Stagewire) -> None:
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
    assert "switches_to: low_level" in both
    assert "dummy: True" in stagewire("show", "READ_START_SPEED").out


def test_show_names_sections_of_a_document_without_pages(stagewire: Stagewire) -> None:
    assert "section Read Status Byte" in stagewire("show", "status_bits").out
    assert (
        "section Read Ramp Time, Write Ramping Time"
        in stagewire("show", "ms2000-ramp-time-range").out
    )
    assert "place: Issue 3, page 79" in stagewire("show", "dc_status_bits").out


def test_show_prints_keys_masks_and_firmware(stagewire: Stagewire) -> None:
    axes = stagewire("show", "axis").out
    assert "typed" in axes
    assert "Ctrl<X>" in axes
    assert " 0x01 " in stagewire("show", "status_bits").out
    assert " 0x00000001 " in stagewire("show", "dc_status_bits").out
    assert "\nfirmware 3.3: From this version on" in stagewire("show", "READ_STATUS").out


@pytest.mark.parametrize(
    ("hex", "name"),
    [
        (MOVE, "WRITE_TARGET_POSITION"),
        ("FF 41", "SWITCH_TO_HIGH_LEVEL"),
        ("18 3F 3A", "READ_STATUS"),
    ],
)
def test_a_command_decoded_as_a_frame_has_a_hint(stagewire: Stagewire, hex: str, name: str) -> None:
    result = stagewire("decode", hex)
    assert result.code == 1
    assert f"hint: as a command of asi_ms2000 this is {name}: use --direction command" in result.out
