"""``stagewire decode`` with a recorded session: both directions, with times."""

from __future__ import annotations

import csv
import io
import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from pyarrow import parquet

if TYPE_CHECKING:
    from conftest import Stagewire

HEADING = "# stagewire capture 1 protocol=thorlabs_apt unit=TDC001\n"
SESSION = f"""{HEADING}# 0.000000 connected
0.000000 > 53 04 06 00 d0 01  # the header of MOT_MOVE_ABSOLUTE
0.010000 > 01 00 40 0d 03 00 43 04 01 00 50 01
0.250000 < 91 04 0e 00 81 50 01 00 10 27 00 00
0.251000 < ff ff 00 00 20 00 00 80
2.000000 < ee ee 44 04 01 00 01 50  # after noise
"""
COMMANDS = """# stagewire capture 1 protocol=asi_ms2000
0.0 > 18 61 03 3a
0.1 < 01 02
0.2 < 03
0.3 > 18 3f 3a 18 61 03 3a  # two commands in one chunk
0.4 < 42 04 05 06
0.5 > 18 61 03 3a  # its reply is lost
1.5 > 18 3f 3a
1.6 < 4e
"""


@pytest.fixture
def decode(stagewire: Stagewire, tmp_path: Path) -> Any:
    """Return a function that decodes a session from a file."""

    def run(text: str, *options: str) -> Any:
        path = tmp_path / "session.txt"
        path.write_text(text, encoding="utf-8")
        return stagewire("decode", path, *options)

    return run


def test_a_table_has_times_and_directions(decode: Any) -> None:
    result = decode(SESSION)
    assert result.out.splitlines() == [
        "    0.010000 >  0x01->0x50 MOT_MOVE_ABSOLUTE chan_ident=1 absolute_distance=200000",
        "    0.010000 >  0x01->0x50 MOT_MOVE_HOME chan_ident=1",
        "    0.251000 <  0x50->0x01 MOT_GET_DCSTATUSUPDATE chan_ident=1 position=10000 velocity=-1 "
        "motor_current=0 status_bits=2147483680",
        "    2.000000 <  garbage: EE EE",
        "    2.000000 <  0x50->0x01 MOT_MOVE_HOMED chan_ident=1",
    ]
    assert result.err == "46 bytes: 1 garbage, 4 message\n"
    assert result.code == 1


def test_a_session_is_read_from_standard_input(stagewire: Stagewire) -> None:
    text = SESSION.replace("ee ee ", "")
    result = stagewire("decode", "-", input=b"\xef\xbb\xbf" + text.encode())
    assert result.code == 0
    assert len(result.out.splitlines()) == 4


def test_comments_may_contain_any_bytes(stagewire: Stagewire) -> None:
    text = SESSION.replace("ee ee ", "").encode().replace(b"after noise", b"\xfcber \x00 \x1b[31m")
    result = stagewire("decode", "-", input=text)
    assert result.code == 0
    assert len(result.out.splitlines()) == 4


def test_json_lines(decode: Any) -> None:
    events = [json.loads(line) for line in decode(SESSION, "--json").out.splitlines()]
    assert [(e["line"], e["time"], e["direction"], e["event"]) for e in events] == [
        (4, 0.01, "to_controller", "message"),
        (4, 0.01, "to_controller", "message"),
        (6, 0.251, "to_host", "message"),
        (7, 2.0, "to_host", "garbage"),
        (7, 2.0, "to_host", "message"),
    ]
    assert not any("offset" in event for event in events)
    assert events[2]["fields"]["position"] == 10000


def test_csv_has_times_and_directions(decode: Any) -> None:
    rows = list(csv.DictReader(io.StringIO(decode(SESSION, "--format", "csv").out)))
    assert [(row["line"], row["time"], row["direction"]) for row in rows] == [
        ("4", "0.01", "to_controller"),
        ("4", "0.01", "to_controller"),
        ("6", "0.251", "to_host"),
        ("7", "2.0", "to_host"),
        ("7", "2.0", "to_host"),
    ]
    assert rows[3]["hex"] == "eeee"


@pytest.mark.parametrize("format", ["csv", "parquet"])
def test_positions_can_be_written_against_time(decode: Any, tmp_path: Path, format: str) -> None:
    """With one message the output has typed columns, and a time for each frame."""
    status = "91 04 0e 00 81 50 01 00 {:02x} 00 00 00 00 00 00 00 00 00 00 80"
    lines = [f"{n / 4} < {status.format(n)} {status.format(n + 100)}" for n in range(5)]
    out = tmp_path / "status"
    options = ["--message", "MOT_GET_DCSTATUSUPDATE", "--format", format, "--output", str(out)]
    assert decode("\n".join([HEADING.strip(), *lines]), *options).code == 0
    if format == "parquet":
        rows = parquet.read_table(out).to_pylist()
    else:
        rows = list(csv.DictReader(io.StringIO(out.read_text(encoding="utf-8"))))
    assert [(float(row["time"]), int(row["position"])) for row in rows] == [
        (n / 4, n + more) for n in range(5) for more in (0, 100)
    ]
    assert {row["direction"] for row in rows} == {"to_host"}


def test_replies_are_decoded_by_their_requests(decode: Any) -> None:
    result = decode(COMMANDS)
    assert [line.split(None, 2)[2] for line in result.out.splitlines()] == [
        "axis 0x18 (X) READ_MOTOR_POSITION",
        "command READ_MOTOR_POSITION (reply) position=197121",
        "axis 0x18 (X) READ_STATUS",
        "axis 0x18 (X) READ_MOTOR_POSITION",
        "command READ_STATUS (reply) status=66",
        "command READ_MOTOR_POSITION (reply) position=394500",
        "axis 0x18 (X) READ_MOTOR_POSITION",
        "axis 0x18 (X) READ_STATUS",
        "command READ_STATUS (reply) status=78",
    ]
    assert result.code == 0


def test_an_incomplete_reply_is_shown(decode: Any) -> None:
    text = "# stagewire capture 1 protocol=asi_ms2000\n"
    text += "0 > 18 61 03 3a\n0.1 < 01 02\n1 > 18 3f 3a\n1.1 < 42\n2 > 18 61 03 3a\n2.1 < 07\n"
    result = decode(f"{text}3 > 18 61 03 3a\n")
    assert [line.split(None, 2)[2] for line in result.out.splitlines() if "<" in line] == [
        "garbage: 01 02",
        "command READ_STATUS (reply) status=66",
        "incomplete at the end: 07",
    ]
    assert "1 garbage" in result.err
    assert result.code == 1


def test_text_is_decoded_before_the_low_level_format(decode: Any) -> None:
    text = "# stagewire capture 1 protocol=asi_ms2000\n"
    text += "0 > 57 20 58 0d\n1 < 3a 41 20 30 0d 0a\n2 > ff 42 18 61 03 3a\n3 < 01 02 03\n"
    result = decode(text)
    assert result.code == 0
    assert [line.split(maxsplit=2)[2] for line in result.out.splitlines()] == [
        r"text: 'W X\r'",
        r"text: ':A 0\r\n'",
        "setup SWITCH_TO_LOW_LEVEL",
        "axis 0x18 (X) READ_MOTOR_POSITION",
        "command READ_MOTOR_POSITION (reply) position=197121",
    ]


def test_one_reply_of_a_session_has_typed_columns(decode: Any) -> None:
    options = ["--message", "READ_MOTOR_POSITION:reply", "--format", "csv"]
    rows = list(csv.DictReader(io.StringIO(decode(COMMANDS, *options).out)))
    assert [(row["line"], row["time"], row["position"]) for row in rows] == [
        ("4", "0.2", "197121"),
        ("6", "0.4", "394500"),
    ]


def test_the_unit_determines_the_status_block(decode: Any) -> None:
    stopped = "0 < 66 04 0e 00 81 50 01 00 10 27 00 00 ff ff 00 00 20 00 00 80\n"
    assert "velocity=-1" in decode(HEADING + stopped).out
    assert "enc_count=65535" in decode(HEADING + stopped, "--status", "stepper").out
    assert "undecided" in decode(HEADING.replace(" unit=TDC001", "") + stopped).out
    assert "undecided" in decode(HEADING.replace("TDC001", "KPC101") + stopped).out
    assert "enc_count=65535" in decode(HEADING.replace("TDC001", "BSC103") + stopped).out


def test_an_incomplete_end_is_shown_for_each_direction(decode: Any) -> None:
    result = decode(f"{HEADING}1 > 43 04\n2 < 44\n3 < 04 01\n")
    assert result.out.splitlines() == [
        "    1.000000 >  incomplete at the end: 43 04",
        "    3.000000 <  incomplete at the end: 44 04 01",
    ]
    assert result.err == "5 bytes: 5 bytes incomplete\n"
    assert result.code == 1


def test_garbage_is_counted_in_each_direction(decode: Any) -> None:
    text = "".join(f"{n} {'><'[n % 2]} ee ee ee ee ee ee ee ee\n" for n in range(4))
    assert "2 garbage" in decode(HEADING + text).err


@pytest.mark.parametrize(
    ("text", "options", "said"),
    [
        (SESSION, ["--direction", "command"], "--direction does not apply to a capture"),
        (SESSION, ["--command", "READ_STATUS"], "--command does not apply to a capture"),
        (SESSION, ["--end", "host"], "--end requires a stream; a recorded session has both ends"),
        (
            SESSION,
            ["--protocol", "asi_ms2000"],
            "contradicts the capture, which is of thorlabs",
        ),
        (SESSION.replace("2.0", "x"), [], "line 7: 'x00000' is not a time in seconds"),
        (f"{SESSION}1 > 00\n", [], "line 8: its time is earlier than that of a line above"),
        ("# stagewire capture 7\n", [], "line 1: capture version 7 is unsupported (supported: 1)"),
        ("# stagewire capture 1 protocol=nothing\n", [], "no protocol nothing is installed"),
        (SESSION, ["--message", "NONSENSE"], "has no message NONSENSE"),
    ],
)
def test_wrong_arguments_are_refused(decode: Any, text: str, options: list[str], said: str) -> None:
    result = decode(text, *options)
    assert result.code == 2
    assert said in result.err


def test_a_session_may_be_empty(decode: Any) -> None:
    result = decode(HEADING)
    assert (result.code, result.out, result.err) == (0, "", "0 bytes: nothing\n")
