"""The testee answers every line, in order, in the shape of its schema."""

from __future__ import annotations

import io
import json
from typing import Any

import pytest
from hypothesis import given, seed, settings
from hypothesis import strategies as st
from jsonschema import Draft202012Validator
from testee_calls import SCHEMA, ask, code, one, refused

from stagewire_conformance import testee
from stagewire_conformance.testee import MAXIMUM_LINE, lines_of
from undocumented import NAME as UNPRINTED
from undocumented import PROTOCOL as WITH_UNPRINTED

APT = "thorlabs_apt"
MOVE = "53040600d0010100400d0300"
COMPLETED = "64040e008150010068aaa0010000000030000080"


def encode(**request: Any) -> dict[str, Any]:
    return {"op": "encode", "protocol": APT, "dest": 0x50, "source": 1, **request}


def test_the_schema_is_valid() -> None:
    Draft202012Validator.check_schema(SCHEMA)


def test_hello() -> None:
    answer = one(op="hello")
    assert answer["implementation"] == "stagewire-python"
    assert answer["testee"] == 1
    assert APT in answer["protocols"]
    assert answer["operations"] == ["hello", "decode", "encode", "stream"]


def test_decode_and_encode_the_documented_examples() -> None:
    decoded = one(op="decode", protocol=APT, hex=MOVE)
    assert decoded == {
        "ok": True,
        "message": "MOT_MOVE_ABSOLUTE",
        "form": "data",
        "dest": 0x50,
        "source": 1,
        "fields": {"chan_ident": 1, "absolute_distance": 200000},
    }
    del decoded["ok"]
    assert one(op="encode", protocol=APT, **decoded) == {"ok": True, "hex": MOVE}


def test_a_layout_that_depends_on_the_context() -> None:
    undecided = one(op="decode", protocol=APT, hex=COMPLETED)
    assert undecided["form"] == "data:undecided"
    assert undecided["data"] == COMPLETED[12:]
    assert undecided["fields"]["chan_ident"] == 1
    again = encode(
        message="MOT_MOVE_COMPLETED",
        form="data:undecided",
        data=undecided["data"],
        dest=1,
        source=80,
    )
    assert one(**again) == {"ok": True, "hex": COMPLETED}
    assert one(**again, fields={"chan_ident": 1}) == {"ok": True, "hex": COMPLETED}
    for other in (2, True, 1.0, "1", None):
        assert refused(**again, fields={"chan_ident": other}) == "bad_value"
    for status in ("dc", "stepper"):
        decided = one(op="decode", protocol=APT, hex=COMPLETED, context={"status": status})
        assert decided["form"] == f"data:{status}"
        assert "data" not in decided
        del decided["ok"]
        assert one(op="encode", protocol=APT, **decided)["hex"] == COMPLETED
        del decided["form"]
        context = {"status": status}
        assert one(op="encode", protocol=APT, context=context, **decided)["hex"] == COMPLETED
    assert (
        refused(op="decode", protocol=APT, hex=COMPLETED, context={"status": "ac"}) == "bad_value"
    )
    assert refused(op="decode", protocol=APT, hex=COMPLETED, context={"stat": "dc"}) == "bad_value"


def test_bytes_beyond_the_layout() -> None:
    longer = "53040800d0010100400d0300beef"
    decoded = one(op="decode", protocol=APT, hex=longer)
    assert decoded["extra"] == "beef"
    del decoded["ok"]
    assert one(op="encode", protocol=APT, **decoded)["hex"] == longer
    undecided = one(op="decode", protocol=APT, hex=f"{COMPLETED[:4]}10{COMPLETED[6:]}beef")
    assert undecided["data"] == f"{COMPLETED[12:]}beef"
    del undecided["ok"]
    raw = one(op="encode", protocol=APT, **undecided)["hex"]
    assert raw == f"{COMPLETED[:4]}10{COMPLETED[6:]}beef"


@pytest.fixture
def unprinted(monkeypatch: pytest.MonkeyPatch) -> None:
    """Load Thorlabs APT with a message without a layout."""
    monkeypatch.setattr(testee, "load_protocol", {APT: WITH_UNPRINTED}.__getitem__)


@pytest.mark.usefixtures("unprinted")
@pytest.mark.parametrize(
    "raw", ["f10005000150", "f10000000150", "f1000400815001020304", "f10000008150"]
)
def test_a_message_without_a_layout(raw: str) -> None:
    decoded = one(op="decode", protocol=APT, hex=raw)
    assert (decoded["message"], decoded["form"]) == (UNPRINTED, "undocumented")
    del decoded["ok"]
    assert one(op="encode", protocol=APT, **decoded)["hex"] == raw


def test_unnamed_parameters_are_included_if_they_are_not_zero() -> None:
    assert one(op="decode", protocol=APT, hex="050000005001")["fields"] == {}
    odd = one(op="decode", protocol=APT, hex="050000075001")
    assert odd["fields"] == {"param2": 7}
    del odd["ok"]
    assert one(op="encode", protocol=APT, **odd)["hex"] == "050000075001"


@pytest.mark.parametrize(
    ("raw", "error"),
    [
        ("", "truncated"),
        ("5304", "truncated"),
        ("53040600d0010100400d03", "truncated"),
        ("53040600d0010100400d030000", "trailing"),
        ("530406005001010000000000", "trailing"),
        ("53040400d0010100400d", "bad_length"),
        ("0500000000d0"[:8] + "d001", "bad_length"),
        ("ffff00005001", "unknown_message"),
        (f"53040001d001{'00' * 256}", "bad_length"),  # no packet has more than 255 bytes
        (f"810000018150{'00' * 256}", "bad_length"),
    ],
)
def test_refusals_of_bytes(raw: str, error: str) -> None:
    assert refused(op="decode", protocol=APT, hex=raw) == error


@pytest.mark.parametrize(
    ("request_", "error"),
    [
        ({"message": "MOT_MOVE_NOWHERE", "form": "data"}, "unknown_message"),
        ({"message": "MOT_MOVE_ABSOLUTE", "form": "date"}, "bad_length"),
        (
            {"message": "MOT_MOVE_ABSOLUTE", "form": "data", "fields": {"chan_ident": 1}},
            "missing_field",
        ),
        ({"message": "MOT_MOVE_ABSOLUTE", "form": "data", "fields": {"speed": 1}}, "unknown_field"),
        ({"message": "MOT_MOVE_HOME", "fields": {"chan_ident": 256}}, "out_of_range"),
        ({"message": "MOT_MOVE_HOME", "fields": {"chan_ident": 10**4000}}, "out_of_range"),
        ({"message": "MOT_MOVE_HOME", "fields": {"chan_ident": 1.0}}, "bad_value"),
        ({"message": "MOT_MOVE_HOME", "fields": {"chan_ident": "1"}}, "bad_value"),
        ({"message": "MOT_MOVE_HOME", "fields": {"chan_ident": True}}, "bad_value"),
        ({"message": "MOT_MOVE_HOME", "fields": {"chan_ident": [1]}}, "bad_value"),
        ({"message": "MOT_MOVE_HOME", "fields": {"chan_ident": 1}, "dest": 0x80}, "out_of_range"),
        ({"message": "MOT_MOVE_HOME", "fields": {"chan_ident": 1}, "dest": "x"}, "bad_value"),
        ({"message": "MOT_MOVE_HOME", "fields": {"chan_ident": 1}, "source": -1}, "out_of_range"),
        ({"message": "MOT_MOVE_HOME", "fields": {"chan_ident": 1}, "extra": "00"}, "bad_value"),
        ({"message": "MOT_MOVE_HOME", "fields": {"chan_ident": 1}, "data": "00"}, "bad_value"),
        ({"message": "MOT_MOVE_COMPLETED", "form": "data:undecided", "data": "00"}, "bad_length"),
        ({"message": "MOT_MOVE_COMPLETED", "form": "data:undecided"}, "missing_field"),
        ({"message": "MOT_SET_MOVEVELPARAMS"}, "unsupported"),
    ],
)
def test_refusals_of_values(request_: dict[str, Any], error: str) -> None:
    assert refused(**encode(**request_)) == error


@pytest.mark.usefixtures("unprinted")
@pytest.mark.parametrize(
    ("request_", "error"),
    [
        ({"form": "undocumented"}, "unsupported"),
        ({"data": "00", "fields": {"param1": 1}}, "bad_value"),
    ],
)
def test_refusals_of_values_without_a_layout(request_: dict[str, Any], error: str) -> None:
    assert refused(**encode(message=UNPRINTED, **request_)) == error


def test_missing_address() -> None:
    request = {"op": "encode", "protocol": APT, "message": "MOD_IDENTIFY", "source": 1}
    assert refused(**request) == "missing_field"


def test_stream() -> None:
    home = "430401005001"
    whole = one(op="stream", protocol=APT, chunks=[f"{home}00{home}0081", "0100"])
    assert [event["event"] for event in whole["events"]] == ["message", "garbage", "message"]
    assert whole["pending"] == "00810100"
    assert whole["events"][0]["message"] == "MOT_MOVE_HOME"
    stream = bytes.fromhex(f"{home}ff{home}{COMPLETED}{home}4304")
    chunked = [
        one(op="stream", protocol=APT, chunks=[stream[i : i + n].hex() for i in range(0, 99, n)])
        for n in (1, 2, 5, 99)
    ]
    assert all(answer == chunked[0] for answer in chunked)
    assert chunked[0]["pending"] == "4304"


def test_a_stream_depends_on_the_receiving_end() -> None:
    home = "430401005001"
    for end, kinds in (("device", ["message"]), ("host", ["garbage"]), ("none", ["message"])):
        answer = one(op="stream", protocol=APT, chunks=[home], end=end)
        assert [event["event"] for event in answer["events"]] == kinds, end


@pytest.mark.parametrize(
    "line",
    [
        b"",
        b"\n",
        b"\xff\xfe",
        b"{",
        b"[]",
        b"null",
        b'"hello"',
        b"1" * 5000,
        b'{"id":' + b"1" * 5000 + b',"op":"hello"}',
        b"[" * 100_000,
        b'{"id":1,"op":' * 50_000,
        b'{"id":NaN,"op":"hello"}',
        b'{"id":1,"op":"hello","x":Infinity}',
        b'{"id":1,"id":2,"op":"hello"}',
        b'{"op":"hello"}',
        b'{"id":null,"op":"hello"}',
        b'{"id":true,"op":"hello"}',
        b'{"id":1.5,"op":"hello"}',
        b'{"id":[1],"op":"hello"}',
        b'\xef\xbb\xbf{"id":1,"op":"hello"}',
        b'{"id":1,"op":"hello"} {"id":2,"op":"hello"}',
    ],
    ids=range(21),
)
def test_invalid_lines_have_no_id(line: bytes) -> None:
    assert code(line) == (None, "bad_request")


@pytest.mark.parametrize(
    ("line", "error"),
    [
        ('{"id":7}', "bad_request"),
        ('{"id":7,"op":["hello"]}', "bad_request"),
        ('{"id":7,"op":"reboot"}', "unsupported"),
        ('{"id":7,"op":"hello","why":1}', "bad_request"),
        ('{"id":7,"op":"decode","protocol":"thorlabs_apt"}', "bad_request"),
        ('{"id":7,"op":"decode","protocol":"thorlabs_apt","hex":5}', "bad_request"),
        ('{"id":7,"op":"decode","protocol":"thorlabs_apt","hex":"5"}', "bad_request"),
        ('{"id":7,"op":"decode","protocol":"thorlabs_apt","hex":"53 04"}', "bad_request"),
        ('{"id":7,"op":"decode","protocol":"thorlabs_apt","hex":"0x53"}', "bad_request"),
        ('{"id":7,"op":"decode","protocol":"nothing","hex":"53"}', "unsupported"),
        ('{"id":7,"op":"decode","protocol":"thorlabs_apt","hex":"","context":[]}', "bad_request"),
        (
            '{"id":7,"op":"decode","protocol":"thorlabs_apt","hex":"","context":{"a":1}}',
            "bad_request",
        ),
        ('{"id":7,"op":"decode","protocol":"thorlabs_apt","hex":"","axis":1}', "bad_request"),
        ('{"id":7,"op":"stream","protocol":"thorlabs_apt","chunks":"00"}', "bad_request"),
        ('{"id":7,"op":"stream","protocol":"thorlabs_apt","chunks":[0]}', "bad_request"),
        ('{"id":7,"op":"stream","protocol":"thorlabs_apt","chunks":[],"end":"top"}', "bad_request"),
        ('{"id":7,"op":"encode","protocol":"thorlabs_apt","message":1}', "bad_request"),
        (
            '{"id":7,"op":"encode","protocol":"thorlabs_apt","message":"A","fields":[]}',
            "bad_request",
        ),
        (
            '{"id":7,"op":"encode","protocol":"thorlabs_apt","message":"A","data":"zz"}',
            "bad_request",
        ),
        ('{"id":7,"op":"encode","protocol":"thorlabs_apt","message":"\\ud800"}', "unknown_message"),
    ],
)
def test_invalid_requests_keep_their_id(line: str, error: str) -> None:
    assert code(line) == (7, error)


def test_ids_are_echoed_in_order() -> None:
    ids: list[Any] = ["a", 2, 2, -1, "", "\ud800", "é", 10**4000]
    lines = [json.dumps({"id": id, "op": "hello"}).encode() for id in ids]
    assert [answer["id"] for answer in ask(*lines)] == ids


def test_text_outside_of_latin_1_is_refused() -> None:
    fields = {
        "serial_number": 1, "model_number": "\ud800", "type": 44, "software_version": "00" * 4,
        "notes": "", "nchs": 1,
    }  # fmt: skip
    line = json.dumps({"id": 7, **encode(message="HW_GET_INFO", fields=fields)})
    answers = ask(line.encode())
    assert answers[0]["error"] in ("bad_value", "missing_field")


def test_an_endless_line_is_truncated() -> None:
    stream = io.BytesIO(b" " * (3 * MAXIMUM_LINE) + b'\n{"id":1,"op":"hello"}')
    lines = list(lines_of(stream))
    assert [len(line) for line in lines] == [MAXIMUM_LINE + 1, 21]
    assert [answer["ok"] for answer in ask(*lines)] == [False, True]


KEYS = ["id", "op", "protocol", "hex", "message", "form", "fields", "dest", "source", "chunks"]
WORDS = ["hello", "decode", "encode", "stream", APT, MOVE, "MOT_MOVE_HOME", "HW_GET_INFO", "header"]
LEAVES = (
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats()
    | st.text(max_size=8)
    | st.sampled_from(WORDS)
)
VALUES = st.recursive(
    LEAVES,
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.dictionaries(st.sampled_from([*KEYS, "chan_ident", "param1", "x"]), inner, max_size=4)
    ),
    max_leaves=12,
)
OBJECTS = st.fixed_dictionaries(
    {"id": st.integers(), "op": st.sampled_from(WORDS[:4]), "protocol": st.just(APT)},
    optional=dict.fromkeys([*KEYS[3:], "extra", "data", "context", "end"], VALUES),
)


@pytest.mark.matrix
@seed(20120601)
@settings(max_examples=300, deadline=None, database=None)
@given(st.lists(OBJECTS | VALUES, max_size=3), st.binary(max_size=40))
def test_hostile_lines(requests: list[Any], noise: bytes) -> None:
    lines = [json.dumps(request).encode() for request in requests] + [noise]
    assert len(ask(*lines)) == len(lines)


@seed(20120601)
@settings(max_examples=200, deadline=None, database=None)
@given(st.data())
def test_a_damaged_line(data: st.DataObject) -> None:
    line = bytearray(json.dumps({"id": 1, "op": "decode", "protocol": APT, "hex": MOVE}).encode())
    for _ in range(data.draw(st.integers(1, 4))):
        line[data.draw(st.integers(0, len(line) - 1))] = data.draw(st.integers(0, 255))
    assert len(ask(bytes(line), b'{"id":2,"op":"hello"}')) == 2


@seed(20120601)
@settings(max_examples=200, deadline=None, database=None)
@given(st.lists(st.binary(max_size=30), max_size=6), st.sampled_from(["host", "device", "none"]))
def test_streams_of_anything(chunks: list[bytes], end: str) -> None:
    answer = one(op="stream", protocol=APT, chunks=[chunk.hex() for chunk in chunks], end=end)
    assert answer["ok"]
    whole = one(op="stream", protocol=APT, chunks=[b"".join(chunks).hex()], end=end)
    assert answer == whole
