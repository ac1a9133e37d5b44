"""The command with a third-party protocol of packets in addition to the built-in ones."""

from __future__ import annotations

import csv
import io
import json
import sys
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

import pytest
from pyarrow import parquet

from checkout import TESTS
from invented_packets import PROTOCOL, SHAPES, SetAngle, Stop, protocol_of
from stagewire.protocols import Packet, Protocol
from stagewire_cli.errors import CalledWronglyError
from stagewire_cli.framings.packet import PacketTask, parts_table
from stagewire_cli.rendering import frame_line
from stagewire_cli.selection import Selection
from stagewire_conformance.answers import frame_answer

if TYPE_CHECKING:
    from conftest import Stagewire

NAME = "invented_packets"
MOVE = Packet(SetAngle(-90_000, 10), 3).encode()
STOP = Packet(Stop(), 3).encode()
UNKNOWN = PROTOCOL.shape.pack(9, 3, b"")
SHORT = PROTOCOL.shape.pack(2, 3, b"")
STREAM = b"\x00" + MOVE + UNKNOWN + SHORT + Packet(SetAngle(1, 2), 4, b"\x07").encode() + STOP[:4]


@pytest.fixture(autouse=True)
def installed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(TESTS / "support" / "installed"))


@pytest.fixture
def capture(tmp_path: Path) -> Path:
    path = tmp_path / "capture.bin"
    path.write_bytes(STREAM)
    return path


# Encode


@pytest.mark.parametrize(
    ("words", "packet"),
    [
        (["SET_ANGLE", "angle=-90000", "speed=10"], Packet(SetAngle(-90_000, 10), 3)),
        (["set_angle", "angle=1", "speed=0x10", "extra=07"], Packet(SetAngle(1, 16), 3, b"\x07")),
        (["STOP"], Packet(Stop(), 3)),
        (["STATE", "--form", "data:brief", "bits=at_home,too_hot"],
         Packet(PROTOCOL.build("STATE", {"bits": 0x8001}, "data:brief"), 3)),  # type: ignore[arg-type]
    ],
)  # fmt: skip
def test_a_packet_is_encoded_for_an_address(
    stagewire: Stagewire, words: list[str], packet: Packet
) -> None:
    for address in ("3", "0x03"):
        result = stagewire("encode", *words, "--address", address)
        assert (result.code, result.err) == (0, "")
        assert bytes.fromhex(result.out) == packet.encode()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["STOP"], "STOP requires the address of the controller; give it with --address"),
        (["STOP", "--address", "x"], "--address must be an address such as 0x50, not 'x'"),
        (["STOP", "--address", "256"], "address must be 0 to 0xff, not 256"),
        (["STOP", "--address", "3", "--dest", "3"], "--dest does not apply to messages of invented_packets"),
        (["STOP", "--address", "3", "--axis", "X"], "--axis does not apply to"),
        (["STOP", "--address", "3", "--allow-dummy"], "--allow-dummy does not apply to"),
        (["STOP", "--address", "3", "extra=00"], "STOP has no payload to add extra bytes to"),
        (["STOP", "--address", "3", "data=00"], "STOP (header) has no field data"),
        (["STATE", "--address", "3"], "several forms; choose one of header, data:brief, data:full"),
        (["HOME", "--address", "3"], "HOME cannot be used: the document gives it no id"),
        (["MOT_MOVE_HOME", "--address", "3"], "--address does not apply to messages of thorlabs_apt"),
        (["STOP_MOTOR", "--address", "3"], "--address does not apply to messages of asi_ms2000"),
    ],
)  # fmt: skip
def test_invalid_packets_are_not_encoded(stagewire: Stagewire, words: list[str], said: str) -> None:
    result = stagewire("encode", *words)
    assert (result.code, result.out) == (2, "")
    assert said in result.err


def test_packets_may_have_no_address(stagewire: Stagewire, monkeypatch: pytest.MonkeyPatch) -> None:
    module = ModuleType("stagewire_invented")
    module.PROTOCOL = protocol_of(SHAPES["bare"])  # type: ignore[attr-defined]
    folder = TESTS / "support" / "installed" / "stagewire_invented"
    module.PROTOCOL._loaded["registry.json"] = json.loads((folder / "registry.json").read_text())
    monkeypatch.setitem(sys.modules, "stagewire_invented", module)
    assert stagewire("encode", "STOP").out == "AA 00 01\n"
    result = stagewire("encode", "STOP", "--address", "3")
    assert (result.code, result.out) == (2, "")
    assert "--address does not apply to messages of invented_packets" in result.err
    lines = stagewire("decode", "--protocol", NAME, "--end", "host", "AA 00 01").out.splitlines()
    assert lines == ["        0  STOP"]
    assert stagewire("decode", "--protocol", NAME, "AA 00 01").out.splitlines()[1] == "form header"


# Decode


def test_a_packet_is_shown_as_a_table(stagewire: Stagewire) -> None:
    result = stagewire("decode", "--protocol", NAME, MOVE.hex())
    assert (result.code, result.err) == (0, "")
    lines = result.out.splitlines()
    assert lines[:2] == ["SET_ANGLE (id 0x02, page 1)", "form data, address 0x03"]
    assert lines[4].split() == ["0", "angle", "-90000", "-90", "deg"]


def test_a_packet_is_selected_by_its_message(stagewire: Stagewire) -> None:
    result = stagewire("decode", "--message", "set_angle", "--json", MOVE.hex())
    assert result.code == 0
    assert json.loads(result.out) == {
        "id": 1, "ok": True, "message": "SET_ANGLE", "form": "data", "address": 3,
        "fields": {"angle": -90_000, "speed": 10, "reserved": 0},
    }  # fmt: skip


@pytest.mark.parametrize(
    ("raw", "error", "marked", "hint"),
    [
        (MOVE[:-1], "truncated", "08", ""),
        (MOVE + STOP, "trailing", STOP.hex(" ").upper(), "to decode several packets at once"),
        (b"\x00" + MOVE, "bad_value", "00", "the start of a packet is at byte 1"),
        (MOVE[:5] + b"\x71" + MOVE[6:], "bad_value", MOVE[11:13].hex(" ").upper(), ""),
        (MOVE[:-1] + b"\x0a", "bad_value", "0A", ""),
        (MOVE[:2] + b"\x40" + MOVE[3:], "bad_length", "40", ""),
        (SHORT, "bad_length", "02", ""),
        (UNKNOWN, "unknown_message", "09", ""),
        (bytes.fromhex("183F3A"), "bad_value", "18", "as a command of asi_ms2000 this is READ_STATUS"),
        (bytes.fromhex("430401005001"), "bad_value", "43",
         "in thorlabs_apt this is MOT_MOVE_HOME: use --protocol thorlabs_apt"),
    ],
)  # fmt: skip
def test_the_wrong_bytes_are_marked(
    stagewire: Stagewire, raw: bytes, error: str, marked: str, hint: str
) -> None:
    result = stagewire("decode", "--protocol", NAME, raw.hex())
    assert result.code == 1
    shown, marks, said, *hints = result.out.splitlines()
    assert shown == raw.hex(" ").upper()
    start = marks.index("^")
    assert shown[start : start + len(marked)] == marked
    assert marks.count("^^") == len(marked.split())
    assert said.startswith(f"{error}: ")
    assert [hint in line for line in hints] == [True] * bool(hint)


def test_bytes_are_decoded_as_frames_by_default(stagewire: Stagewire) -> None:
    """The protocol is not guessed; a hint names the matching protocol and the option for it."""
    frame = stagewire("decode", "43 04 01 00 50 01")
    assert frame.out.startswith("MOT_MOVE_HOME")
    result = stagewire("decode", MOVE.hex())
    assert result.code == 1
    assert result.out.splitlines()[-1] == (
        "hint: in invented_packets this is SET_ANGLE: use --protocol invented_packets"
    )
    assert stagewire("decode", "--direction", "command", "18 3F 3A").code == 0


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--direction", "command"], "--direction applies only to protocols of commands and replies"),
        (["--command", "STOP"], "--command applies only to protocols of commands"),
        (["--status", "dc"], "no layout of Invented packets depends on 'status'"),
        (["--message", "SET_ANGEL"], "did you mean SET_ANGLE?"),
        (["--message", "SET_ANGLE:header"], "SET_ANGLE has no form header"),
        (["--message", "STATE"], "STATE has several forms"),
    ],
)  # fmt: skip
def test_options_that_do_not_apply_are_refused(
    stagewire: Stagewire, words: list[str], said: str
) -> None:
    result = stagewire("decode", "--protocol", NAME, *words, MOVE.hex())
    assert (result.code, result.out) == (2, "")
    assert said in result.err


def test_a_stream_of_packets_is_written_as_lines(stagewire: Stagewire, capture: Path) -> None:
    result = stagewire("decode", "--protocol", NAME, capture)
    assert result.code == 1
    assert [line.split(maxsplit=1)[1] for line in result.out.splitlines()] == [
        "garbage: 00",
        "0x03 SET_ANGLE angle=-90000 speed=10 reserved=0",
        f"unknown: {UNKNOWN.hex(' ').upper()}",
        f"bad_length: {SHORT.hex(' ').upper()}",
        "0x04 SET_ANGLE angle=1 speed=2 reserved=0 extra=07",
        f"incomplete at the end: {STOP[:4].hex(' ').upper()}",
    ]
    assert "1 bad_length, 1 garbage, 2 message, 1 unknown, 4 bytes incomplete" in result.err


def test_a_stream_of_packets_is_written_as_json_and_rows(
    stagewire: Stagewire, capture: Path
) -> None:
    arguments = ("decode", "--protocol", NAME, capture)
    lines = stagewire(*arguments, "--format", "jsonl").out.splitlines()
    answers = [json.loads(line) for line in lines]
    assert answers[1] == {
        "offset": 1, "event": "message", "message": "SET_ANGLE", "form": "data", "address": 3,
        "fields": {"angle": -90_000, "speed": 10, "reserved": 0},
    }  # fmt: skip
    rows = list(csv.DictReader(io.StringIO(stagewire(*arguments, "--format", "csv").out)))
    assert "dest" not in rows[0]
    for answer, row in zip(answers, rows, strict=True):
        assert row["offset"] == str(answer["offset"])
        assert row["event"] == answer.get("event", "pending")
        assert row["address"] == str(answer.get("address", ""))
        assert row["extra"] == answer.get("extra", "")
        assert row["hex"] == answer.get("hex", answer.get("pending", ""))
        assert json.loads(row["fields"] or "null") == answer.get("fields")


def test_one_packet_message_has_typed_columns(
    stagewire: Stagewire, capture: Path, tmp_path: Path
) -> None:
    arguments = ("decode", "--message", "SET_ANGLE", capture)
    assert stagewire(*arguments, "--format", "csv").out.splitlines() == [
        "offset,address,angle,speed,reserved,extra",
        "1,3,-90000,10,0,",
        "31,4,1,2,0,07",
    ]
    target = tmp_path / "moves.parquet"
    stagewire(*arguments, "--format", "parquet", "--output", target)
    found = parquet.read_table(target)
    assert [str(field.type) for field in found.schema] == [
        "uint64", "uint8", "int32", "uint16", "uint8", "binary"
    ]  # fmt: skip
    assert found.column("angle").to_pylist() == [-90_000, 1]
    assert found.column("extra").to_pylist() == [None, b"\x07"]


def test_json_captures_can_be_packets(stagewire: Stagewire, tmp_path: Path) -> None:
    path = tmp_path / "captures.json"
    path.write_text(json.dumps([{"hex": MOVE.hex()}, {"hex": STOP.hex(" ")}]), encoding="utf-8")
    result = stagewire("decode", "--protocol", NAME, path, "--format", "jsonl")
    assert result.code == 0
    assert [json.loads(line)["message"] for line in result.out.splitlines()] == [
        "SET_ANGLE",
        "STOP",
    ]


def test_the_address_column_has_the_size_of_addresses() -> None:
    types = {}
    for name, shape in SHAPES.items():
        task = PacketTask(protocol_of(shape))
        types[name] = [(column.name, column.type) for column in task.addresses]
    assert types["usual"] == [("address", "uint8")]
    assert types["odd"] == [("address", "uint16")]
    assert types["bare"] == []


# Show, and the runner


def test_show_prints_the_parts_of_a_packet(stagewire: Stagewire) -> None:
    result = stagewire("show", "set_angle")
    assert result.code == 0
    lines = [line.split() for line in result.out.splitlines()]
    assert lines[1] == ["id", "0x02,", "to", "controller,", "page", "1"]
    assert ["0", "angle", "s24", "-180000", "to", "180000", "deg"] in lines
    packet = lines[lines.index(["packet", "with", "a", "payload", "of", "n", "bytes"]) + 3 :]
    assert [line[:3] for line in packet] == [
        ["0", "start", "2"], ["2", "length", "1"], ["3", "address", "1"], ["4", "id", "1"],
        ["5", "payload", "n"], ["5+n", "check", "2"], ["7+n", "end", "1"],
    ]  # fmt: skip
    assert packet[3][3] == "0x02"
    assert "polynomial 0x1021, initial 0xffff, not reflected" in result.out
    assert json.loads(stagewire("show", "SET_ANGLE", "--json").out)["id"] == 2
    assert "packet" not in stagewire("show", "MOT_MOVE_HOME").out.partition("header")[2]


@pytest.mark.parametrize(
    ("shape", "check"),
    [("small", "exclusive or"), ("ended", "twos' complement of the sum"), ("odd", "sum"), ("bare", None)],
)  # fmt: skip
def test_show_describes_the_checksum(shape: str, check: str | None) -> None:
    found = SHAPES[shape]
    shown = parts_table(found, 1)
    parts, holds = (list(shown.columns[number].cells) for number in (1, 3))
    assert parts == list(found.order)
    if check is not None:
        assert holds[parts.index("check")] == f"{check} of {', '.join(found.covers)}"


def test_the_worked_examples_of_packets_pass(stagewire: Stagewire) -> None:
    result = stagewire("conformance", "examples", "--protocol", NAME)
    assert result.code == 0
    assert "5 passed, 0 failed" in result.out


# A protocol with an unknown kind of framing


def test_an_unknown_framing_is_refused(
    stagewire: Stagewire, monkeypatch: pytest.MonkeyPatch
) -> None:
    odd = Protocol(NAME, "Odd", "stagewire_invented", messages=(Stop,), nameless={})
    module = ModuleType("stagewire_invented")
    module.PROTOCOL = odd  # type: ignore[attr-defined]
    folder = TESTS / "support" / "installed" / "stagewire_invented"
    odd._loaded["registry.json"] = json.loads((folder / "registry.json").read_text("utf-8"))
    monkeypatch.setitem(sys.modules, "stagewire_invented", module)
    assert stagewire("show", "SET_ANGLE").code == 0
    for words in (["decode", "--protocol", NAME, "00"], ["encode", "STOP"]):
        result = stagewire(*words)
        assert result.code == 2
        assert "a Protocol" in result.err or "of the class Protocol" in result.err
    line = b'{"id":1,"op":"decode","protocol":"invented_packets","hex":""}\n'
    (answer,) = (json.loads(text) for text in asked(line).splitlines())
    assert answer["error"] == "unsupported"
    assert stagewire("decode", "43 04 01 00 50 01").code == 0
    with pytest.raises(CalledWronglyError, match="cannot decode protocols of the class Protocol"):
        Selection(protocol=NAME).task()


def asked(line: bytes) -> str:
    from stagewire_conformance.testee import serve

    answers: list[str] = []
    serve([line], answers.append)
    return "".join(answers)


def test_a_packet_of_a_stream_is_one_line() -> None:
    answer = frame_answer(Packet(Stop(), 200))
    assert frame_line(PROTOCOL, answer) == "0xc8 STOP"
