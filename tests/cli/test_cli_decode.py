"""``stagewire decode``: single frames are checked strictly, streams are framed, and errors are explained."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from jsonschema import Draft202012Validator

from checkout import SCHEMAS

if TYPE_CHECKING:
    from conftest import Stagewire

MOVE = "53 04 06 00 D0 01 01 00 40 0D 03 00"
HOME = "43 04 01 00 50 01"
COMPLETED = "64 04 0E 00 81 50 01 00 68 AA A0 01 00 00 00 00 30 00 00 80"
SCHEMA = json.loads((SCHEMAS / "testee.schema.json").read_text(encoding="utf-8"))


def validate(name: str, answer: Any) -> None:
    Draft202012Validator({"$ref": f"#/$defs/{name}", "$defs": SCHEMA["$defs"]}).validate(answer)


@pytest.mark.parametrize(
    "words",
    [
        [MOVE],
        MOVE.split(),
        [MOVE.replace(" ", "")],
        [MOVE.lower().replace(" ", ":")],
        [MOVE.replace(" ", ", ")],
        ["0x" + MOVE.replace(" ", ",0x")],
        ["0x" + MOVE.replace(" ", "")],
        ["\\x" + MOVE.replace(" ", "\\x")],
        [f"[{MOVE.replace(' ', '-')}]"],
        ["0x53,0x4,0x6,0x0,0xD0,0x1,0x1,0x0,0x40,0xD,0x3,0x0"],
    ],
    ids=range(10),
)
def test_a_frame_is_read_in_any_notation_of_hex(stagewire: Stagewire, words: list[str]) -> None:
    result = stagewire("decode", *words)
    assert result.code == 0, result
    assert "MOT_MOVE_ABSOLUTE (id 0x0453, Issue 3, page 45)" in result.out
    assert "form data, dest 0x50, source 0x01" in result.out
    assert [line.split() for line in result.out.splitlines()[-1:]] == [
        ["2", "absolute_distance", "200000", "mm,", "depending", "on", "stage", "and", "controller"]
    ]


def test_json_has_the_form_of_the_testees_answers(stagewire: Stagewire) -> None:
    result = stagewire("decode", "--json", MOVE)
    answer = json.loads(result.out)
    validate("decode_answer", answer)
    assert answer["fields"] == {"chan_ident": 1, "absolute_distance": 200000}
    refused = stagewire("decode", "--json", MOVE[:-3])
    assert refused.code == 1
    validate("refusal", json.loads(refused.out))


def test_values_and_flags_are_shown_by_name(stagewire: Stagewire) -> None:
    undecided = stagewire("decode", COMPLETED)
    assert "form data:undecided" in undecided.out
    assert "--status dc or --status stepper" in undecided.out
    result = stagewire("decode", COMPLETED, "--status", "dc")
    assert "CHAN1" in result.out
    assert "moving_forward | moving_reverse | channel_enabled" in result.out


@pytest.mark.parametrize(
    ("words", "marked", "said"),
    [
        ("53 04 06", [3], "truncated"),
        ("53 04 06 00 D0 01 01 00 40 0D", [2, 3], "declare a packet of 6 bytes, but 4 follow"),
        (f"{MOVE} 00 00", [12, 13], "it ends before byte 12"),
        ("53 04 04 00 D0 01 01 00 40 0D", [2, 3], "but a packet has 6 bytes"),
        ("53 04 06 00 50 01 01 00 40 0D 03 00", [4], "lack the bit of a data packet (0xd0)"),
        ("04 53 06 00 D0 01 01 00 40 0D 03 00", [0, 1], "0x0453 is MOT_MOVE_ABSOLUTE"),
        (f"{HOME} {HOME}", [6, 7, 8, 9, 10, 11], "hint: to decode several frames"),
    ],
)
def test_a_broken_frame_is_explained(
    stagewire: Stagewire, words: str, marked: list[int], said: str
) -> None:
    result = stagewire("decode", words)
    assert result.code == 1
    shown, marks, *rest = result.out.splitlines()
    assert shown.split() == words.split()
    assert [i for i in range(20) if marks[3 * i : 3 * i + 2] == "^^"] == marked
    assert said in "\n".join(rest)


@pytest.mark.parametrize("words", ["", " ", "# nothing"])
def test_empty_input_is_not_a_frame(stagewire: Stagewire, words: str) -> None:
    result = stagewire("decode", words)
    assert result.code == 1
    assert "truncated: a frame has at least 6 bytes, not 0" in result.out


def test_several_frames_on_the_command_line_require_end(stagewire: Stagewire) -> None:
    result = stagewire("decode", HOME, HOME, "--end", "device")
    assert result.code == 0
    assert result.out.count("MOT_MOVE_HOME") == 2
    assert result.err == "12 bytes: 2 message\n"


@pytest.mark.parametrize("raw", [False, True], ids=["text", "raw"])
@pytest.mark.parametrize("stdin", [False, True], ids=["file", "stdin"])
def test_streams_are_decoded(stagewire: Stagewire, tmp_path: Path, raw: bool, stdin: bool) -> None:
    text = f"# two frames, noise, one frame\n{HOME}\n{MOVE} ff\n{HOME}\n"
    hexes = "".join(line.split("#")[0] for line in text.splitlines()).replace(" ", "")
    data = bytes.fromhex(hexes) if raw else text.encode()
    path = tmp_path / "capture"
    path.write_bytes(data)
    result = stagewire("decode", "-" if stdin else path, "--json", input=data if stdin else b"")
    events = [json.loads(line) for line in result.out.splitlines()]
    assert [event.pop("offset") for event in events] == [0, 6, 18, 19]
    for event in events:
        validate("event", event)
    assert [event["event"] for event in events] == ["message", "message", "garbage", "message"]
    assert result.code == 1  # because of garbage


def test_a_list_of_captures_is_decoded(stagewire: Stagewire, tmp_path: Path) -> None:
    path = tmp_path / "captures.json"
    path.write_text(json.dumps([{"hex": MOVE, "message": "x"}, {"hex": HOME}]), encoding="utf-8")
    result = stagewire("decode", path)
    assert result.code == 0
    assert f"entry 1: {MOVE}" in result.out
    path.write_text('{"hex": "5304"}\n\n{"hex": "' + HOME + '"}\n', encoding="utf-8")
    result = stagewire("decode", path, "--json")
    assert [json.loads(line)["ok"] for line in result.out.splitlines()] == [False, True]
    assert result.code == 1


def test_an_incomplete_end_is_shown(stagewire: Stagewire) -> None:
    result = stagewire("decode", "-", input=bytes.fromhex(MOVE)[:-2])
    assert result.code == 1
    assert "incomplete at the end: 53 04 06 00 D0 01 01 00 40 0D" in result.out
    assert stagewire("decode", "-").err == "0 bytes: nothing\n"


def test_text_from_a_controller_cannot_control_the_terminal(stagewire: Stagewire) -> None:
    info = bytearray(bytes.fromhex("060054008150") + bytes(84))
    info[10:14] = b"\x1b[2J"
    result = stagewire("decode", info.hex())
    assert result.code == 0
    assert "\x1b" not in result.out
    assert "\\x1b[2J" in result.out


def test_a_long_text_is_read_in_blocks(stagewire: Stagewire, tmp_path: Path) -> None:
    path = tmp_path / "long.txt"
    path.write_text(HOME.replace(" ", "") * 40_000, encoding="utf-8")  # one word of 480,000 digits
    result = stagewire("decode", path, "--end", "device")
    assert result.code == 0
    assert result.err.endswith("240000 bytes: 40000 message\n")


def test_a_word_cut_by_blocks_ends_at_a_space(stagewire: Stagewire) -> None:
    text = HOME.replace(" ", "") * 11_000 + " 43 04 01 00 50 0x01\n" + HOME
    result = stagewire("decode", "-", "--end", "device", input=text.encode())
    assert result.err == "66012 bytes: 11002 message\n"


def test_garbage_cut_by_blocks_counts_once(stagewire: Stagewire) -> None:
    home = bytes.fromhex(HOME)
    result = stagewire("decode", "-", input=home + b"\xee" * 200_000 + home)
    assert result.err == "200012 bytes: 1 garbage, 2 message\n"
    assert result.code == 1


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ([], "Missing argument"),
        (["no such file"], "not an existing file, and not bytes in hex: 'no'"),
        (["5 3 0 4"], "'5' is not a sequence of two-digit hex bytes"),
        ([MOVE, "--status", "ac"], "--status: status must be one of dc, stepper, not 'ac'"),
        ([MOVE, "--end", "top"], "Invalid value"),
        ([MOVE, "--protocol", "nothing"], "no protocol nothing is installed"),
        ([MOVE, "--status", ""], "--status: status must be one of dc, stepper, not ''"),
        (["-", "-"], "- must be the only argument"),
        ([MOVE, __file__], "must be the only argument; give one file at a time"),
        (["/"], "stagewire: "),
        (["x" * 5000], "not an existing file, and not bytes in hex"),
    ],
)
def test_wrong_arguments_are_refused(stagewire: Stagewire, arguments: list[str], said: str) -> None:
    result = stagewire("decode", *arguments)
    assert result.code == 2
    assert said in result.err


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (b"53 04\nhello\n", "line 2: 'hello' is not a sequence of two-digit hex bytes"),
        (b'[{"hex": 5}]', 'entry 1 is neither hex text nor an object with "hex"'),
        (b'[{"hex": "5"}]', "entry 1: "),
        (b'[{"hex": "53"}', "not JSON"),
        (b"[" + b'{"a":[' * 50_000, "nested too deeply"),
        (b"[" * 100_000, "nested too deeply"),
        (b"[[1, 2]]", "entry 1 is neither hex text"),
        (b'{"hex": "53"}\n{', "not JSON"),
        (b"53 \xff\xfe", ""),
    ],
    ids=range(9),
)
def test_invalid_input_is_refused(stagewire: Stagewire, data: bytes, said: str) -> None:
    result = stagewire("decode", "-", input=data)
    assert result.code in (1, 2)
    assert said in result.err


@pytest.mark.parametrize(
    ("name", "begin"), [("out.csv", "offset,event,"), ("out.jsonl", "{"), ("out.txt", "MOT_MOVE")]
)
def test_the_suffix_of_the_output_selects_the_format(
    stagewire: Stagewire, tmp_path: Path, name: str, begin: str
) -> None:
    frame = "53 04 06 00 D0 01 01 00 40 0D 03 00"
    assert stagewire("decode", frame, "--output", tmp_path / name).code == 0
    assert (tmp_path / name).read_text().startswith(begin)
