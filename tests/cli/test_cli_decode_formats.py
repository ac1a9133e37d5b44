"""``stagewire decode --format``: every format agrees with the library, and files are written completely."""

from __future__ import annotations

import csv
import io
import json
import math
import os
import random
import struct
import sys
import tracemalloc
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from pyarrow import parquet

from parts import every_nth
from stagewire import Frame
from stagewire.devices import number_of
from stagewire.framing import Received, Undocumented
from stagewire.protocols import CountedMessage, Message, UndocumentedMessage
from stagewire_apt import PROTOCOL
from stagewire_cli import decode, inputs
from stagewire_cli.inputs import Source
from stagewire_conformance.framings import codec_of
from stagewire_conformance.notation import spaced
from stagewire_conformance.registry import registry_of
from sub_messages import selecting

if TYPE_CHECKING:
    from conftest import Stagewire

STATUS = bytes.fromhex("91040e00 8150 0100 10270000 feff 0000 10000080")
HOMED = bytes.fromhex("4404 0100 0150")
COMPLETED = bytes.fromhex("64040e00 8150 0100 68aaa001 feff 0100 30000080")
UNKNOWN = bytes.fromhex("0f0f 0200 8150 abcd")
UNDOCUMENTED = bytes.fromhex("8009 0200 d001 abcd")
LONGER = STATUS[:2] + b"\x11" + STATUS[3:] + b"xyz"
NAME = "MOT_GET_DCSTATUSUPDATE"
GENERAL = [
    "offset", "event", "message", "form", "dest", "source", "fields", "extra", "data", "hex", "error",
]  # fmt: skip


def frames_of(cls: type[Message], rng: random.Random) -> Iterator[bytes]:
    """Yield frames of a layout with the lowest, the highest and other values."""
    layout = cls.layout
    size = layout.length
    if not size:
        for drawn in (b"\0\0",) if layout.only_zero else (b"\0\0", b"\x01\0", b"\x7f\xff"):
            params = selecting(drawn, layout.sub_message, layout.form)
            yield struct.pack("<H2sBB", layout.id, params, 0x01, 0x50)
        return
    for drawn in (bytes(size), b"\xff" * size, b"\x80" * size, rng.randbytes(size)):
        payload = selecting(drawn, layout.sub_message, layout.form)
        yield struct.pack("<HHBB", layout.id, size, 0x81, 0x50) + payload


ROWS = {"array_id": 1, "channels": 0b101, "num_points": 2, "start_ix": 0,
        "time_pos": [10, -5, 7, 20, 2**31 - 1, 0]}  # fmt: skip
"""Two points, each with a time and the positions of two channels."""


def frames_of_all() -> list[bytes]:
    rng = random.Random(7)
    documented = [cls for cls in PROTOCOL.messages if not issubclass(cls, UndocumentedMessage)]
    arrays = [cls.layout.message for cls in documented if issubclass(cls, CountedMessage)]
    with_rows = [PROTOCOL.build(name, ROWS).pack(0x01, 0x50) for name in arrays]
    return [*(raw for cls in documented for raw in frames_of(cls, rng)), *with_rows]


@pytest.fixture(scope="module")
def capture(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a file with every layout, extra bytes, unknown messages, garbage and an incomplete end."""
    path = tmp_path_factory.mktemp("capture") / "capture.bin"
    others = [UNKNOWN, UNDOCUMENTED, LONGER, COMPLETED, STATUS[:2] + b"\x0c" + STATUS[3:-2]]
    path.write_bytes(b"".join(frames_of_all() + others) + STATUS + b"\xee" * 9 + HOMED + STATUS[:9])
    return path


def events_of(path: Path, status: str | None = None) -> list[dict[str, Any]]:
    """Return the events of the library for a stream, with offsets."""
    framer = PROTOCOL.framer()
    context = {"status": status} if status else None
    offset, answers = 0, []
    for event in framer.feed(path.read_bytes()):
        answer = codec_of(PROTOCOL).event_answer(event, {"context": context})
        if "fields" in answer:
            answer["fields"] = as_json(answer["fields"], answer["message"], answer["form"])
        answers.append({"offset": offset} | answer)
        offset += len(event.raw)
    if framer.pending:
        answers.append({"offset": offset, "pending": framer.pending.hex()})
    return answers


def with_numbers(values: dict[str, Any], message: str, form: str) -> dict[str, Any]:
    """Return the fields of a message, with numbers in place of the bit patterns of real numbers."""
    fields = registry_of(PROTOCOL).fields(message, form)
    return {
        name: number_of(value, 4) if fields.get(name, {}).get("real") else value
        for name, value in values.items()
    }


def as_json(values: dict[str, Any], message: str, form: str) -> dict[str, Any]:
    """Return the fields of a message as in JSON, where NaN and infinity are text."""
    found = with_numbers(values, message, form)
    return {
        name: str(value) if isinstance(value, float) and not math.isfinite(value) else value
        for name, value in found.items()
    }


def general_row(answer: dict[str, Any]) -> dict[str, Any]:
    """Return the row of an event in the general form."""
    row = dict.fromkeys(GENERAL) | answer
    if "pending" in answer:
        row |= {"event": "pending", "hex": row.pop("pending")}
    return row


def read_csv(text: str) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(text, newline="")))


def text_of(value: Any) -> str:
    """Return the text of a value in CSV."""
    if isinstance(value, bytes):
        return value.hex()
    if isinstance(value, list):
        return " ".join(map(str, value))
    return "" if value is None else str(value)


STATUSES = pytest.mark.parametrize("status", [None, "dc"])


def options(status: str | None) -> list[str]:
    return [] if status is None else ["--status", status]


@STATUSES
@pytest.mark.parametrize(
    "option", [["--json"], ["--format", "jsonl"], ["--json", "--format", "jsonl"]]
)
def test_json_lines(
    stagewire: Stagewire, capture: Path, status: str | None, option: list[str]
) -> None:
    result = stagewire("decode", capture, *option, *options(status))
    assert [json.loads(line) for line in result.out.splitlines()] == events_of(capture, status)
    assert result.err == ""
    assert result.code == 1  # garbage


@STATUSES
def test_a_table_has_a_line_for_each_event(
    stagewire: Stagewire, capture: Path, status: str | None
) -> None:
    result = stagewire("decode", capture, *options(status))
    lines = [line.split(maxsplit=1) for line in result.out.splitlines()]
    answers = events_of(capture, status)
    assert [int(offset) for offset, _ in lines] == [answer["offset"] for answer in answers]
    for (_, line), answer in zip(lines, answers, strict=True):
        if "message" not in answer:
            kind = "incomplete at the end" if "pending" in answer else answer["event"]
            raw = bytes.fromhex(answer.get("hex") or answer["pending"])
            assert line == f"{kind}: {spaced(raw)}"
            continue
        where, message, *words = line.split(" ")
        assert where == f"{answer['source']:#04x}->{answer['dest']:#04x}"
        assert message == answer["message"]
        for name, value in answer["fields"].items():
            if isinstance(value, list):
                assert f"{name}={','.join(map(str, value))}" in words
            elif not isinstance(value, str):
                assert f"{name}={str(value).removesuffix('.0')}" in words
        assert (
            (f"extra={answer['extra']}" in words) if answer.get("extra") else "extra=" not in line
        )
        assert (f"({answer['form']})" in words) == (answer["form"] not in ("header", "data"))


@STATUSES
def test_csv_has_a_row_for_each_event(
    stagewire: Stagewire, capture: Path, status: str | None
) -> None:
    result = stagewire("decode", capture, "--format", "csv", *options(status))
    rows = read_csv(result.out)
    expected = [general_row(answer) for answer in events_of(capture, status)]
    assert list(rows[0]) == GENERAL
    for row, wanted in zip(rows, expected, strict=True):
        fields = row.pop("fields")
        assert (json.loads(fields) if fields else None) == wanted.pop("fields")
        assert row == {name: text_of(value) for name, value in wanted.items()}
    assert "9 bytes incomplete" in result.err


@STATUSES
def test_parquet_has_a_row_for_each_event(
    stagewire: Stagewire, capture: Path, tmp_path: Path, status: str | None
) -> None:
    target = tmp_path / "all.parquet"
    result = stagewire(
        "decode", capture, "--format", "parquet", "--output", target, *options(status)
    )
    assert (result.code, result.out) == (1, "")
    rows = parquet.read_table(target).to_pylist()
    for row in rows:
        row["fields"] = row["fields"] and json.loads(row["fields"])
    assert rows == [general_row(answer) for answer in events_of(capture, status)]


TYPED = [
    (cls, status)
    for cls in PROTOCOL.messages
    if not issubclass(cls, UndocumentedMessage)
    for status in ([None, cls.layout.when["status"]] if cls.layout.when else [None])
]


@pytest.mark.parametrize(
    ("cls", "status"), TYPED, ids=[f"{cls.__name__}-{status}" for cls, status in TYPED]
)
def test_one_message_has_typed_columns(
    stagewire: Stagewire, capture: Path, tmp_path: Path, cls: type[Message], status: str | None
) -> None:
    layout = cls.layout
    framer = PROTOCOL.framer()
    expected, offset = [], 0
    for event in framer.feed(capture.read_bytes()):
        if isinstance(event, (Received, Undocumented)):
            frame: Frame = PROTOCOL.decode(event.raw, layout.when or None)
            if type(frame.message) is cls:
                addresses = {"dest": frame.dest, "source": frame.source}
                extra = {"extra": frame.extra or None}
                values = {
                    key: list(value) if isinstance(value, tuple) else value
                    for key, value in frame.message.values().items()
                }
                values = with_numbers(values, layout.message, layout.form)
                named = {f"{key}_value" if key == "offset" else key: values[key] for key in values}
                expected.append({"offset": offset} | addresses | named | extra)
        offset += len(event.raw)
    assert expected
    chosen = ["--message", f"{layout.message}:{layout.form}", *options(status)]
    result = stagewire("decode", capture, "--format", "csv", *chosen)
    assert read_csv(result.out) == [
        {name: text_of(value) for name, value in row.items()} for row in expected
    ]
    target = tmp_path / "typed.parquet"
    stagewire("decode", capture, "--format", "parquet", "--output", target, *chosen)
    table = parquet.read_table(target)
    assert repr(table.to_pylist()) == repr(expected)  # NaN is not equal to itself
    lines = stagewire("decode", capture, "--json", *chosen).out.splitlines()
    assert [json.loads(line)["offset"] for line in lines] == [row["offset"] for row in expected]


def test_parquet_columns_have_the_types_of_fields(
    stagewire: Stagewire, capture: Path, tmp_path: Path
) -> None:
    target = tmp_path / "typed.parquet"

    def types(name: str) -> list[str]:
        stagewire("decode", capture, "--format", "parquet", "--output", target, "--message", name)
        return [str(field.type) for field in parquet.read_schema(target)]

    header = ["uint64", "uint8", "uint8"]
    assert types(NAME) == [*header, "uint16", "int32", "int16", "int16", "uint32", "binary"]
    info = ["int32", "string", "uint16", "binary", "string", "binary", *["uint16"] * 4]
    assert types("hw_get_info") == [*header, *info, "binary"]


def test_no_rows_are_an_empty_table(stagewire: Stagewire, tmp_path: Path) -> None:
    target = tmp_path / "none"
    assert stagewire("decode", "-", "--format", "csv").out == ",".join(GENERAL) + "\r\n"
    for extra in ([], ["--message", "HW_GET_INFO"]):
        result = stagewire("decode", "-", "--format", "parquet", "--output", target, *extra)
        assert result.code == 0
        assert parquet.read_table(target).num_rows == 0


def test_many_rows_are_written_in_several_groups(stagewire: Stagewire, tmp_path: Path) -> None:
    path, target = tmp_path / "long.bin", tmp_path / "long.parquet"
    number = 70_000
    path.write_bytes(STATUS * number)
    for chosen in ([], ["--message", NAME]):
        result = stagewire("decode", path, "--format", "parquet", "--output", target, *chosen)
        assert (result.code, result.err) == (0, f"{number * 20} bytes: {number} message\n")
        file = parquet.ParquetFile(target)
        assert (file.num_row_groups, file.metadata.num_rows) == (2, number)
        assert file.read(["offset"])["offset"].to_pylist() == list(range(0, number * 20, 20))


def test_the_status_selects_the_form(stagewire: Stagewire) -> None:
    chosen = ["--format", "csv", "--message", "mot_move_completed"]
    result = stagewire("decode", "-", *chosen, "--status", "dc", input=COMPLETED)
    (row,) = read_csv(result.out)
    assert row["velocity"] == "-2"
    result = stagewire("decode", "-", *chosen, "--status", "stepper", input=COMPLETED)
    (row,) = read_csv(result.out)
    assert row["enc_count"] == "131070"


# One frame, and JSON captures


def test_one_frame_is_written_as_a_row(stagewire: Stagewire) -> None:
    result = stagewire("decode", STATUS.hex(), "--format", "csv")
    (row,) = read_csv(result.out)
    assert (row["offset"], row["event"], row["message"]) == ("0", "message", NAME)
    assert (result.code, result.err) == (0, "")
    result = stagewire("decode", UNKNOWN.hex(), "--format", "csv")
    (row,) = read_csv(result.out)
    assert (row["event"], row["hex"]) == ("refused", UNKNOWN.hex())
    assert row["error"].startswith("unknown_message: bytes 0 and 1")
    assert result.code == 1


@pytest.mark.parametrize(
    ("frame", "code", "said"),
    [(STATUS, 0, "20 bytes: 1 frame\n"), (STATUS[:9], 1, "9 bytes: 1 refused\n")],
    ids=["whole", "cut"],
)
def test_one_frame_in_a_file_has_a_summary(
    stagewire: Stagewire, tmp_path: Path, frame: bytes, code: int, said: str
) -> None:
    path = tmp_path / "one.csv"
    result = stagewire("decode", frame.hex(), "--format", "csv", "--output", path)
    assert (result.code, result.out, result.err) == (code, "", said)
    assert len(read_csv(path.read_text(encoding="utf-8"))) == 1


def test_captures_are_written_as_rows(stagewire: Stagewire, tmp_path: Path) -> None:
    path = tmp_path / "captures.jsonl"
    frames = [STATUS, STATUS[:9], LONGER, HOMED]
    path.write_text("\n".join(json.dumps({"hex": raw.hex()}) for raw in frames), encoding="utf-8")
    result = stagewire("decode", path, "--format", "csv")
    rows = read_csv(result.out)
    assert [row["offset"] for row in rows] == ["0", "20", "29", "52"]
    assert [row["event"] for row in rows] == ["message", "refused", "message", "message"]
    assert rows[2]["extra"] == b"xyz".hex()
    assert (result.code, result.err) == (1, "58 bytes: 3 frame, 1 refused\n")
    result = stagewire("decode", path, "--format", "csv", "--message", NAME)
    assert [row["offset"] for row in read_csv(result.out)] == ["0", "29"]
    refused, summary = result.err.splitlines()
    assert refused.startswith("entry 2: truncated: ")
    assert summary == "58 bytes: 3 frame, 1 refused"
    assert result.code == 1


@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        (["-"], 0),
        ([UNKNOWN.hex(), "--end", "host"], 0),
        ([UNKNOWN.hex()], 1),
    ],
    ids=["stream", "stream in hex", "frame"],
)
@pytest.mark.parametrize("format", ["table", "jsonl", "csv"])
def test_an_unknown_message_is_an_error_only_as_a_single_frame(
    stagewire: Stagewire, arguments: list[str], code: int, format: str
) -> None:
    assert stagewire("decode", *arguments, "--format", format, input=UNKNOWN).code == code


def test_an_unknown_message_in_captures_is_an_error(stagewire: Stagewire) -> None:
    line = json.dumps({"hex": UNKNOWN.hex()}).encode()
    assert stagewire("decode", "-", input=line).code == 1


@pytest.mark.parametrize(
    "text",
    [
        '{"hex": "%s"}\n\n{"hex": "%s"}\n',
        '["%s",\n"%s"]',
        '["%s", "%s"]\n\n',
        '{"captures":\n [{"hex": "%s"}, {"printed": "%s"}]}',
        '{"captures": [{"hex": "%s"}, {"printed": "%s"}]}',
        '\n\n{"hex": "%s"}\r\n{"hex": "%s"}',
        '\ufeff{"hex": "%s"}\n{"hex": "%s"}',
    ],
    ids=range(7),
)
def test_captures_can_be_lists_or_lines(stagewire: Stagewire, text: str) -> None:
    data = (text % (STATUS.hex(), HOMED.hex())).encode()
    result = stagewire("decode", "-", "--json", input=data)
    names = [json.loads(line)["message"] for line in result.out.splitlines()]
    assert names == [NAME, "MOT_MOVE_HOMED"]
    assert result.code == 0


@pytest.mark.parametrize(
    ("data", "said"),
    [
        ('["53"]\n{"hex": "53"}\n', "line 2: unexpected text after the end of the list"),
        ('{"captures": []}\n\n[]', "line 3: unexpected text after the end of the list"),
        ('{"hex": "53"}\n{"hex": \n', "not JSON: line 2: "),
        ('{"hex": "53"}\n' + "[" * 100_000, "line 2: nested too deeply"),
        (b'{"hex": "53"}\n' * 9_000 + b'["\xff"]\n', "line 9001: not UTF-8 text: byte 2"),
        ('{"hex": "53"}\n["53"]\n', "entry 2 is neither hex text"),
    ],
    ids=range(6),
)
def test_invalid_captures_are_refused(stagewire: Stagewire, data: str | bytes, said: str) -> None:
    raw = data if isinstance(data, bytes) else data.encode()
    result = stagewire("decode", "-", input=raw)
    assert result.code == 2
    assert said in result.err


def test_json_beyond_the_limit_is_refused(
    stagewire: Stagewire, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(inputs, "_MAXIMUM_JSON", 200_000)
    entry = json.dumps({"hex": STATUS.hex()})
    in_lines = stagewire("decode", "-", "--json", input=f"{entry}\n".encode() * 5_000)
    assert in_lines.out.count("\n") == 5_000
    in_list = f"[{entry},\n{f'{entry},' * 10}\n".encode() + f"{entry},\n".encode() * 5_000
    result = stagewire("decode", "-", input=in_list)
    assert result.code == 2
    assert "give one object per line, hex text or raw bytes" in result.err
    in_one_line = f"[{entry}{f',{entry}' * 5_000}]".encode()
    result = stagewire("decode", "-", input=in_one_line)
    assert result.code == 2
    assert "line 1: over 0 MiB of JSON in one line" in result.err


# Files


def files_in(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


@pytest.mark.parametrize("format", ["table", "jsonl", "csv"])
def test_a_file_has_the_same_output_as_standard_output(
    stagewire: Stagewire, capture: Path, tmp_path: Path, format: str
) -> None:
    target = tmp_path / "decoded"
    target.write_text("before", encoding="utf-8")
    shown = stagewire("decode", capture, "--format", format)
    result = stagewire("decode", capture, "--format", format, "--output", target)
    assert result.out == ""
    assert result.err == shown.err or format == "jsonl"
    assert files_in(tmp_path) == {"decoded": shown.out.encode()}
    alone = stagewire("decode", STATUS.hex(), "--format", format)
    stagewire("decode", STATUS.hex(), "--format", format, "--output", target)
    assert files_in(tmp_path) == {"decoded": alone.out.encode()}


def test_writing_through_a_symbolic_link_keeps_it(stagewire: Stagewire, tmp_path: Path) -> None:
    (tmp_path / "link").symlink_to("decoded")
    stagewire("decode", STATUS.hex(), "--json", "--output", tmp_path / "link")
    assert (tmp_path / "link").is_symlink()
    assert json.loads((tmp_path / "decoded").read_bytes())["message"] == NAME


FORMATS = pytest.mark.parametrize(
    "format",
    [["table"], ["jsonl"], ["csv"], ["parquet"], ["csv", "--message", NAME], ["parquet", "--message", NAME]],
    ids="-".join,
)  # fmt: skip


@FORMATS
def test_an_error_leaves_no_file(stagewire: Stagewire, tmp_path: Path, format: list[str]) -> None:
    target = tmp_path / "decoded"
    text = f"{STATUS.hex()}\n".encode() * 5_000 + b"not hex\n"
    words = ["decode", "-", "--output", target, "--format", *format]
    result = stagewire(*words, input=text)
    assert result.code == 2
    assert "line 5001: 'not' is not a sequence of two-digit hex bytes" in result.err
    assert files_in(tmp_path) == {}
    target.write_bytes(b"before")
    stagewire(*words, input=text)
    assert files_in(tmp_path) == {"decoded": b"before"}


@FORMATS
def test_an_interrupt_leaves_no_file(
    stagewire: Stagewire, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, format: list[str]
) -> None:
    block = Source.block

    def interrupted(source: Source) -> bytes:
        if source.read > 200_000:
            raise KeyboardInterrupt
        return block(source)

    monkeypatch.setattr(Source, "block", interrupted)
    words = ["decode", "-", "--output", tmp_path / "decoded", "--format", *format]
    result = stagewire(*words, input=STATUS * 100_000)
    assert result.code == 130
    assert files_in(tmp_path) == {}


@FORMATS
def test_a_full_disk_leaves_no_file(
    stagewire: Stagewire, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, format: list[str]
) -> None:
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "replace", full)
    result = stagewire(
        "decode", "-", "--output", tmp_path / "decoded", "--format", *format, input=STATUS
    )
    assert result.code == 2
    assert "No space left on device" in result.err
    assert files_in(tmp_path) == {}


# Options that do not fit


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--format", "parquet"], "give --output FILE"),
        (["--format", "xml"], "Invalid value"),
        (["--json", "--format", "csv"], "--json means --format jsonl and contradicts --format csv"),
        (["--output", "{tmp}"], "is not a regular file"),
        (["--output", os.devnull], "is not a regular file"),
        (["--output", "{tmp}/no/decoded"], "missing folder"),
        (["--output", "/"], "--output: "),
        (["--message", "MOT_GET_DCSTATUS"], "--message: "),
        (["--message", "MOT_MOVE_ABSOLUTE"], "has several forms; choose one of header, data"),
        (["--message", "MOT_MOVE_ABSOLUTE:middle"], "MOT_MOVE_ABSOLUTE has no form middle"),
        (["--message", "MOT_MOVE_HOMED:"], "MOT_MOVE_HOMED has no form"),
        (["--message", "MOT_SET_MOVEVELPARAMS"], "cannot be used"),
        (["--message", "MOT_MOVE_COMPLETED"], "has several forms"),
        (
            ["--message", "MOT_MOVE_COMPLETED:data:dc", "--status", "stepper"],
            "--message: the form data:dc contradicts --status stepper",
        ),
        (
            ["--message", "MOT_MOVE_COMPLETED:data:undecided", "--status", "dc"],
            "data:undecided excludes --status",
        ),
    ],
    ids=range(15),
)
def test_contradicting_options_are_refused(
    stagewire: Stagewire, tmp_path: Path, arguments: list[str], said: str
) -> None:
    words = [word.replace("{tmp}", str(tmp_path)) for word in arguments]
    result = stagewire("decode", STATUS.hex(), *words)
    assert result.code == 2
    assert said in " ".join(result.err.split())
    assert result.out == ""


def test_the_capture_is_never_overwritten(stagewire: Stagewire, tmp_path: Path) -> None:
    path, link = tmp_path / "capture.bin", tmp_path / "link"
    path.write_bytes(STATUS)
    link.symlink_to(path)
    for target in (path, link):
        result = stagewire("decode", path, "--output", target)
        assert result.code == 2
        assert "is the capture that is being read" in result.err
    assert path.read_bytes() == STATUS


def test_end_requires_a_stream(stagewire: Stagewire) -> None:
    data = json.dumps([STATUS.hex()]).encode()
    result = stagewire("decode", "-", "--end", "host", input=data)
    assert result.code == 2
    assert "--end requires a stream; JSON captures are single frames" in result.err


def test_without_pyarrow_the_error_says_what_to_install(
    stagewire: Stagewire, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("pyarrow", "pyarrow.parquet"):
        monkeypatch.setitem(sys.modules, name, None)
    target = tmp_path / "decoded.parquet"
    result = stagewire("decode", STATUS.hex(), "--format", "parquet", "--output", target)
    assert result.code == 2
    assert "Parquet needs pyarrow: run pip install 'stagewire[parquet]'" in result.err
    assert files_in(tmp_path) == {}
    assert stagewire("decode", STATUS.hex(), "--format", "csv").code == 0


def test_text_in_csv_cannot_control_a_terminal(
    stagewire: Stagewire, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    info = bytearray(bytes.fromhex("060054008150") + bytes(84))
    info[10:14] = b"\x1b[2J"
    words = ["decode", info.hex(), "--format", "csv", "--message", "HW_GET_INFO"]
    assert read_csv(stagewire(*words).out)[0]["model_number"] == "\x1b[2J"
    monkeypatch.setattr(sys.stdout, "isatty", lambda: True)
    assert read_csv(stagewire(*words).out)[0]["model_number"] == "\\x1b[2J"


# Memory and progress


def peak_of(stagewire: Stagewire, *words: object, input: bytes) -> tuple[int, int]:
    """Return the peak of the memory allocated by Python, and the exit code."""
    stagewire(*words, input=input[:4000])  # allocates objects that are made once and kept
    tracemalloc.start()
    try:
        result = stagewire(*words, input=input)
        return tracemalloc.get_traced_memory()[1], result.code
    finally:
        tracemalloc.stop()


INFO = bytes.fromhex("060054008150") + bytes(range(84))


LARGE = {
    "raw": INFO * 26_000,
    "hex in one line": INFO.hex(" ").encode() * 9_000,
    "hex in one word": INFO.hex().encode() * 13_000,
    "a long comment": b"# " + b"x" * 2_300_000,
    "JSON lines": (json.dumps({"hex": INFO.hex(), "note": "x" * 2_000}).encode() + b"\n") * 1_100,
}


@pytest.mark.parametrize("kind", every_nth(LARGE, 4))
def test_a_capture_is_not_held_in_memory(stagewire: Stagewire, tmp_path: Path, kind: str) -> None:
    """A capture of 2.3 MB is read in blocks of 64 KiB; a tenth of it needs about as much memory."""
    input = LARGE[kind]
    words = ["decode", "-", "--format", "csv", "--message", "HW_GET_INFO"]
    words += ["--output", str(tmp_path / "decoded")]
    of_a_part, _ = peak_of(stagewire, *words, input=input[: len(input) // 10])
    peak, code = peak_of(stagewire, *words, input=input)
    assert (peak - of_a_part < 600_000, code) == (True, 0)


def test_garbage_is_not_held_in_memory(stagewire: Stagewire, tmp_path: Path) -> None:
    """12 MB of garbage would be 24 MB in hex; rows for Parquet are collected in large batches."""
    words = ["decode", "-", "--format", "parquet", "--output", tmp_path / "decoded"]
    peak, code = peak_of(stagewire, *words, input=b"\xee" * 12_000_000)
    assert (peak < 20_000_000, code) == (True, 1)
    texts = parquet.read_table(tmp_path / "decoded", columns=["hex"])["hex"].to_pylist()
    assert sum(map(len, texts)) == 24_000_000


def test_progress_is_shown_only_on_a_terminal(
    stagewire: Stagewire, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("stagewire_cli.output._PATIENCE", 0.0)
    path = tmp_path / "capture.bin"
    path.write_bytes(STATUS * 10_000)
    assert stagewire("decode", path).err == "200000 bytes: 10000 message\n"
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    assert "10,000 messages" in stagewire("decode", path).err


@pytest.mark.parametrize("kind", ["raw", "hex", "json"])
def test_progress_shows_how_much_of_the_file_was_read(
    stagewire: Stagewire, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: str
) -> None:
    said: list[str] = []

    @contextmanager
    def recorded(**_: bool) -> Iterator[Any]:
        yield said.append

    monkeypatch.setattr(decode, "progress", recorded)
    texts = {
        "raw": STATUS * 10_240,
        "hex": STATUS.hex(" ").encode() * 10_240,
        "json": b'{"hex": "%b"}\n' % STATUS.hex().encode() * 10_240,
    }
    path = tmp_path / "capture"
    path.write_bytes(texts[kind])
    assert stagewire("decode", path, "--format", "csv").code == 0
    size = len(texts[kind])
    assert said[-1].startswith(f"{size:,} of {size:,} bytes (100 %), 10,240 ")
    assert any(f"65,536 of {size:,} bytes" in text for text in said)
