"""The testee on a packet protocol: an address, extra bytes, refusals, streams."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from testee_calls import code, one, refused

from checkout import TESTS
from invented_packets import PROTOCOL, SHAPES, SetAngle, StateFull, protocol_of
from stagewire.errors import BadValueError
from stagewire.protocols import Packet
from stagewire_conformance.framings import codec_of

NAME = "invented_packets"
MOVE = Packet(SetAngle(-90_000, 10), 3).encode().hex()


@pytest.fixture(autouse=True)
def installed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(TESTS / "support" / "installed"))


def decode(raw: str, **request: Any) -> dict[str, Any]:
    return one(op="decode", protocol=NAME, hex=raw, **request)


def encode(**request: Any) -> dict[str, Any]:
    return one(op="encode", protocol=NAME, **request)


def stream(*chunks: str, **request: Any) -> dict[str, Any]:
    return one(op="stream", protocol=NAME, chunks=list(chunks), **request)


def test_hello_lists_the_protocol() -> None:
    assert NAME in one(op="hello")["protocols"]


def test_a_packet() -> None:
    decoded = decode(MOVE)
    assert decoded == {
        "ok": True, "message": "SET_ANGLE", "form": "data", "address": 3,
        "fields": {"angle": -90_000, "speed": 10, "reserved": 0},
    }  # fmt: skip
    del decoded["ok"], decoded["fields"]["reserved"]
    assert encode(**decoded) == {"ok": True, "hex": MOVE}
    del decoded["form"]
    assert encode(**decoded) == {"ok": True, "hex": MOVE}


def test_extra_bytes_texts_and_byte_strings() -> None:
    raw = Packet(StateFull(1, "warm"), 3, b"\x07").encode().hex()
    said = {
        "message": "STATE", "form": "data:full", "address": 3,
        "fields": {"bits": 1, "label": "warm"}, "extra": "07",
    }  # fmt: skip
    assert decode(raw) == {"ok": True, **said}
    assert encode(**said)["hex"] == raw
    page = {"message": "PAGE", "form": "data", "address": 0, "fields": {"page": "aa55" * 16}}
    assert decode(encode(**page)["hex"]) == {"ok": True, **page}


@pytest.mark.parametrize(
    ("raw", "error"),
    [
        (MOVE[:-2], "truncated"),
        ("", "truncated"),
        (MOVE + "00", "trailing"),
        ("ab" + MOVE[2:], "bad_value"),
        (MOVE[:-2] + "00", "bad_value"),
        (MOVE[:10] + "71" + MOVE[12:], "bad_value"),
        (MOVE[:4] + "01" + MOVE[6:], "bad_length"),
        (PROTOCOL.shape.pack(2, 3, bytes(5)).hex(), "bad_length"),
        (PROTOCOL.shape.pack(9, 3, b"").hex(), "unknown_message"),
    ],
)
def test_invalid_bytes_are_refused(raw: str, error: str) -> None:
    assert refused(op="decode", protocol=NAME, hex=raw) == error


@pytest.mark.parametrize(
    ("changes", "error"),
    [
        ({"address": None}, "bad_value"),
        ({"address": "3"}, "bad_value"),
        ({"address": True}, "bad_value"),
        ({"address": 256}, "out_of_range"),
        ({"message": "SET_ANGEL"}, "unknown_message"),
        ({"message": "HOME"}, "unsupported"),
        ({"form": "header"}, "bad_length"),
        ({"fields": {"angle": 1}}, "missing_field"),
        ({"fields": {"angle": 1, "speed": 2, "size": 3}}, "unknown_field"),
        ({"fields": {"angle": 180_001, "speed": 2}}, "out_of_range"),
        ({"extra": "00" * 27}, "out_of_range"),
        ({"message": "STOP", "fields": {}, "extra": "00"}, "bad_value"),
        ({"message": "PAGE", "fields": {"page": "0"}}, "bad_value"),
    ],
)
def test_invalid_values_are_refused(changes: dict[str, Any], error: str) -> None:
    request = {"message": "SET_ANGLE", "address": 3, "fields": {"angle": 1, "speed": 2}} | changes
    assert refused(op="encode", protocol=NAME, **request) == error


def test_an_address_is_required() -> None:
    assert refused(op="encode", protocol=NAME, message="STOP") == "missing_field"


@pytest.mark.parametrize(
    "request_",
    [
        '{"id":1,"op":"encode","protocol":"invented_packets","message":"STOP","address":3,"dest":3}',
        '{"id":1,"op":"encode","protocol":"invented_packets","message":"STOP","address":3,"axis":3}',
        '{"id":1,"op":"encode","protocol":"invented_packets","message":"STOP","address":3,"data":""}',
        '{"id":1,"op":"decode","protocol":"invented_packets","hex":"","context":{}}',
        '{"id":1,"op":"decode","protocol":"invented_packets","hex":"","direction":"command"}',
        '{"id":1,"op":"decode","protocol":"invented_packets","hex":"","address":3}',
        '{"id":1,"op":"encode","protocol":"thorlabs_apt","message":"MOT_MOVE_HOME","address":3}',
    ],
)
def test_keys_of_other_framings_are_refused(request_: str) -> None:
    assert code(request_) == (1, "bad_request")


@pytest.mark.parametrize("end", ["host", "device", "none"])
def test_a_stream(end: str) -> None:
    unknown = PROTOCOL.shape.pack(9, 3, b"").hex()
    short = PROTOCOL.shape.pack(2, 3, b"").hex()
    answer = stream("00", "01" + MOVE[:8], MOVE[8:] + unknown + short + "aa", end=end)
    events = answer["events"]
    assert [event["event"] for event in events] == ["garbage", "message", "unknown", "bad_length"]
    assert events[0] == {"event": "garbage", "hex": "0001"}
    assert events[1]["message"] == "SET_ANGLE"
    assert events[1]["address"] == 3
    assert events[2:] == [
        {"event": "unknown", "hex": unknown}, {"event": "bad_length", "hex": short}
    ]  # fmt: skip
    assert answer["pending"] == "aa"


@given(
    st.integers(-180_000, 180_000), st.integers(0, 0xFFFF), st.integers(0, 255), st.binary(max_size=26)
)  # fmt: skip
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=60)
def test_decoded_packets_encode_to_the_same_bytes(
    angle: int, speed: int, address: int, extra: bytes
) -> None:
    raw = Packet(SetAngle(angle, speed), address, extra).encode().hex()
    decoded = decode(raw)
    del decoded["ok"]
    assert encode(**decoded) == {"ok": True, "hex": raw}


def test_packets_without_addresses() -> None:
    codec = codec_of(protocol_of(SHAPES["bare"]))
    assert "address" not in codec.keys_of("encode")
    assert codec.decode(bytes.fromhex("aa0003"), {}) == {
        "message": "STATE", "form": "header", "fields": {}
    }  # fmt: skip
    assert codec.encode({"message": "STOP"}) == bytes.fromhex("aa0001")
    with pytest.raises(BadValueError, match="packets of this protocol have no address"):
        codec.encode({"message": "STOP", "address": 3})
