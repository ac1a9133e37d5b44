"""The testee on a command protocol: axes, forms with and without a size, setup commands, replies."""

from __future__ import annotations

import json
from typing import Any

import pytest
from hypothesis import given, seed, settings
from hypothesis import strategies as st
from testee_calls import ask, code, one, refused

from stagewire.protocols import Command, Reply, SetupCommand, load_protocol

MS2000 = "asi_ms2000"
MOVE = "185403a086013a"  # the X axis to 10 mm
REPLY = "a08601"
CLASSES = load_protocol(MS2000).messages


def decode(raw: str, **request: Any) -> dict[str, Any]:
    return one(op="decode", protocol=MS2000, hex=raw, **request)


def encode(**request: Any) -> dict[str, Any]:
    return one(op="encode", protocol=MS2000, **request)


def stream(*chunks: str, **request: Any) -> dict[str, Any]:
    return one(op="stream", protocol=MS2000, chunks=list(chunks), **request)


def names(answer: dict[str, Any]) -> list[str]:
    return [event["event"] for event in answer["events"]]


def test_hello_lists_the_protocol() -> None:
    assert MS2000 in one(op="hello")["protocols"]


# Decode and encode


def test_a_command() -> None:
    decoded = decode(MOVE)
    assert decoded == {
        "ok": True,
        "message": "WRITE_TARGET_POSITION",
        "kind": "command",
        "form": "request",
        "axis": 24,
        "fields": {"target_position": 100000},
    }
    assert decode(MOVE, direction="command") == decoded
    del decoded["ok"]
    assert encode(**decoded) == {"ok": True, "hex": MOVE}
    assert encode(**decoded, direction="command") == {"ok": True, "hex": MOVE}


def test_a_setup_command_with_the_byte_of_a_command() -> None:
    setup = decode("ff52")
    assert setup == {
        "ok": True,
        "message": "RESET_CONTROLLER",
        "kind": "setup",
        "form": "request",
        "fields": {},
    }
    assert decode("185202e8033a")["message"] == "WRITE_START_SPEED"
    del setup["ok"]
    assert encode(**setup)["hex"] == "ff52"
    assert encode(message="RESET_CONTROLLER", axis=None)["hex"] == "ff52"


@pytest.mark.parametrize(
    ("raw", "message", "form"),
    [
        ("183f3a", "READ_STATUS", "request"),
        ("183f003a", "READ_STATUS", "request:with_size"),
        ("18423a", "STOP_MOTOR", "request"),
        ("1842003a", "STOP_MOTOR", "request:with_size"),
        ("1869063a", "READ_IDENTIFICATION", "request"),
        ("18693a", "READ_IDENTIFICATION", "request:without_size"),
        ("184a003a", "JOYSTICK_ENABLE", "request"),
        ("184a3a", "JOYSTICK_ENABLE", "request:without_size"),
    ],
)
def test_both_forms(raw: str, message: str, form: str) -> None:
    decoded = decode(raw)
    assert (decoded["message"], decoded["form"]) == (message, form)
    assert encode(message=message, form=form, axis=24) == {"ok": True, "hex": raw}


def test_ignored_bytes_are_returned_as_extra() -> None:
    decoded = decode("185403a0863a183f3a")  # a lost byte: the next command is part of the data
    assert decoded["fields"] == {"target_position": 0x3A86A0}
    assert decoded["extra"] == "183f"
    del decoded["ok"]
    assert encode(**decoded)["hex"] == "185403a0863a183f3a"


@pytest.mark.parametrize(
    ("raw", "command", "fields"),
    [
        (REPLY, "READ_MOTOR_POSITION", {"position": 100000}),
        ("ffffff", "READ_TARGET_POSITION", {"target_position": -1}),
        ("4e02", "READ_CURRENT_SPEED", {"speed": 590}),
        ("feff", "READ_MAXIMUM_SPEED", {"maximum_speed": 65534}),
        ("62", "READ_STATUS", {"status": 0x62}),
        ("454d4f54203a", "READ_IDENTIFICATION", {"identification": "EMOT :"}),
        ("a086018a", "READ_MOTOR_POSITION_AND_STATUS", {"position": 100000, "status": 138}),
    ],
)
def test_a_reply(raw: str, command: str, fields: dict[str, Any]) -> None:
    decoded = decode(raw, direction="reply", command=command)
    assert decoded == {
        "ok": True,
        "message": command,
        "kind": "command",
        "form": "reply",
        "fields": fields,
    }
    del decoded["ok"]
    assert encode(**decoded)["hex"] == raw
    assert encode(message=command, direction="reply", fields=fields)["hex"] == raw


def test_a_reply_has_no_keys_of_a_command() -> None:
    request = {"message": "READ_STATUS", "form": "reply", "fields": {"status": 66}}
    nothing = {"axis": None, "extra": "", "allow_dummy": False, "refuse_prefix_bytes": False}
    assert encode(**request, **nothing) == encode(**request) == {"ok": True, "hex": "42"}


def test_a_setup_command_has_no_options() -> None:
    request = {"op": "encode", "protocol": MS2000, "message": "SWITCH_TO_LOW_LEVEL"}
    for key in ("allow_dummy", "refuse_prefix_bytes"):
        answer = one(**request, **{key: True})
        assert answer["error"] == "bad_value"
        assert f"a setup command has no {key}" in answer["detail"]
        assert one(**request, **{key: False})["hex"] == "ff42"


def test_a_dummy_is_encoded_only_on_request() -> None:
    assert decode("1872023a")["message"] == "READ_START_SPEED"
    request = {"op": "encode", "protocol": MS2000, "message": "READ_START_SPEED", "axis": 24}
    assert refused(**request) == "unsupported"
    assert refused(**request, allow_dummy=False) == "unsupported"
    assert encode(message="READ_START_SPEED", axis=24, allow_dummy=True)["hex"] == "1872023a"


def test_bytes_like_a_setup_command_are_refused_on_request() -> None:
    request = {
        "message": "WRITE_TARGET_POSITION",
        "axis": 24,
        "fields": {"target_position": 0x41FF},
    }
    assert encode(**request, refuse_prefix_bytes=False)["hex"] == "185403ff41003a"
    answer = encode(**request, refuse_prefix_bytes=True)
    assert answer["error"] == "out_of_range"
    near = [int(word) for word in answer["detail"].replace(",", " ").split() if word.isdecimal()]
    for value in (0x41FE, 0x4200):
        assert value in near
        again = {**request, "fields": {"target_position": value}}
        assert encode(**again, refuse_prefix_bytes=True)["ok"]


@pytest.mark.parametrize("cls", CLASSES, ids=lambda cls: f"{cls.layout.message} {cls.layout.form}")
def test_every_message_round_trips(cls: Any) -> None:
    layout = cls.layout
    fields: dict[str, Any] = dict.fromkeys(layout.fields, 66)
    if "identification" in fields:
        fields["identification"] = "EMOT :"
    request: dict[str, Any] = {"message": layout.message, "fields": fields}
    asked: dict[str, Any] = {}
    if issubclass(cls, Command):
        request |= {"axis": 25, "allow_dummy": layout.dummy}
    elif issubclass(cls, Reply):
        request["form"] = "reply"
        asked = {"direction": "reply", "command": layout.message}
    else:
        assert issubclass(cls, SetupCommand)
    decoded = decode(encode(**request)["hex"], **asked)
    assert (decoded["message"], decoded["fields"]) == (layout.message, fields)
    assert decoded.get("axis") == request.get("axis")
    assert decoded["kind"] == layout.kind


# Refusals


@pytest.mark.parametrize(
    ("raw", "error"),
    [
        ("", "truncated"),
        ("18", "truncated"),
        ("3a", "bad_length"),
        ("183a", "bad_length"),  # aborted
        ("1854", "truncated"),
        ("185403a08601", "truncated"),
        ("1854033a", "truncated"),
        ("ff", "truncated"),
        ("183f3a3a", "trailing"),
        ("ff413a", "trailing"),
        ("ff613a", "unknown_message"),
        ("18003a", "unknown_message"),
        ("18543a", "bad_length"),  # no size, but data
        ("185404a08601003a", "bad_length"),
        ("186c033a", "bad_length"),
        (f"183f00{'00' * 256}3a", "bad_length"),
    ],
)
def test_refusals_of_commands(raw: str, error: str) -> None:
    assert refused(op="decode", protocol=MS2000, hex=raw) == error


@pytest.mark.parametrize(
    ("raw", "command", "error"),
    [
        ("a086", "READ_MOTOR_POSITION", "truncated"),
        ("a0860100", "READ_MOTOR_POSITION", "trailing"),
        ("", "WRITE_MOTOR_POSITION", "bad_length"),
        ("00", "START_MOTOR", "bad_length"),
        ("00", "RESET_CONTROLLER", "bad_length"),
        ("00", "READ_MINDS", "unknown_message"),
    ],
)
def test_refusals_of_replies(raw: str, command: str, error: str) -> None:
    request = {"op": "decode", "protocol": MS2000, "direction": "reply", "command": command}
    assert refused(**request, hex=raw) == error


TO_10_MM = {"message": "WRITE_TARGET_POSITION", "axis": 24, "fields": {"target_position": 100000}}


@pytest.mark.parametrize(
    ("request_", "error"),
    [
        ({"message": "WRITE_MINDS", "axis": 24}, "unknown_message"),
        ({**TO_10_MM, "message": "WRITE_MINDS"}, "unknown_message"),
        ({**TO_10_MM, "form": "data"}, "bad_length"),
        ({**TO_10_MM, "form": "reply"}, "bad_length"),
        ({**TO_10_MM, "form": "request:without_size"}, "bad_length"),
        ({**TO_10_MM, "form": "request:with_size"}, "bad_length"),
        ({**TO_10_MM, "direction": "reply"}, "bad_length"),
        ({**TO_10_MM, "form": "request", "direction": "reply"}, "bad_value"),
        ({"message": "READ_STATUS", "form": "reply", "direction": "command"}, "bad_value"),
        ({**TO_10_MM, "kind": "setup"}, "bad_value"),
        ({"message": "RESET_CONTROLLER", "kind": "command"}, "bad_value"),
        ({**TO_10_MM, "fields": {}}, "missing_field"),
        ({**TO_10_MM, "fields": {"speed": 1}}, "unknown_field"),
        ({**TO_10_MM, "fields": {"target_position": 2**23}}, "out_of_range"),
        ({**TO_10_MM, "fields": {"target_position": -(2**23) - 1}}, "out_of_range"),
        ({**TO_10_MM, "fields": {"target_position": 10**4000}}, "out_of_range"),
        ({**TO_10_MM, "fields": {"target_position": 0.5}}, "bad_value"),
        ({**TO_10_MM, "fields": {"target_position": True}}, "bad_value"),
        ({"message": "WRITE_TARGET_POSITION", "fields": {"target_position": 1}}, "missing_field"),
        ({**TO_10_MM, "axis": 0x3A}, "out_of_range"),
        ({**TO_10_MM, "axis": 0xFF}, "out_of_range"),
        ({**TO_10_MM, "axis": 256}, "out_of_range"),
        ({**TO_10_MM, "axis": -1}, "out_of_range"),
        ({**TO_10_MM, "axis": "X"}, "bad_value"),
        ({**TO_10_MM, "axis": None}, "bad_value"),
        ({**TO_10_MM, "axis": True}, "bad_value"),
        ({**TO_10_MM, "extra": "3a"}, "bad_value"),
        ({**TO_10_MM, "extra": "00" * 253}, "out_of_range"),
        ({"message": "RESET_CONTROLLER", "axis": 24}, "bad_value"),
        ({"message": "RESET_CONTROLLER", "extra": "00"}, "bad_value"),
        ({"message": "READ_STATUS", "axis": 24, "extra": "00"}, "bad_value"),
        *(
            ({"message": "READ_STATUS", "form": "reply", "fields": {"status": 66}, **more}, "bad_value")
            for more in (
                {"axis": 24},
                {"axis": 0},
                {"extra": "00"},
                {"allow_dummy": True},
                {"refuse_prefix_bytes": True},
            )
        ),
        ({"message": "READ_STATUS", "form": "reply"}, "missing_field"),
        ({"message": "WRITE_RAMPING_TIME", "axis": 24, "fields": {"ramp_time": 0}}, "out_of_range"),
        ({"message": "WRITE_VECTOR_SPEED", "axis": 24, "fields": {"vector_speed": -1}}, "out_of_range"),
    ],
)  # fmt: skip
def test_refusals_of_values(request_: dict[str, Any], error: str) -> None:
    assert refused(op="encode", protocol=MS2000, **request_) == error


@pytest.mark.parametrize(
    "request_",
    [
        {"op": "decode", "hex": "", "direction": "sideways"},
        {"op": "decode", "hex": "", "direction": "reply"},
        {"op": "decode", "hex": "", "command": "READ_STATUS"},
        {"op": "decode", "hex": "", "command": "READ_STATUS", "direction": "command"},
        {"op": "decode", "hex": "", "direction": "reply", "command": 1},
        {"op": "decode", "hex": "", "context": {"status": "dc"}},
        {"op": "encode", "message": "READ_STATUS", "direction": "sideways"},
        {"op": "encode", "message": "READ_STATUS", "axis": 24, "dest": 1},
        {"op": "encode", "message": "READ_STATUS", "axis": 24, "data": "00"},
        {"op": "encode", "message": "READ_STATUS", "axis": 24, "allow_dummy": 1},
        {"op": "encode", "message": "READ_STATUS", "axis": 24, "extra": "0"},
        {"op": "stream", "chunks": [], "end": "host"},
        {"op": "stream", "chunks": [], "end": "top"},
        {"op": "stream", "chunks": [], "command": "READ_STATUS"},
        {"op": "stream", "chunks": [], "command": "READ_STATUS", "end": "device"},
        {"op": "stream", "chunks": [], "context": {"status": "dc"}},
    ],
)
def test_invalid_requests_are_refused(request_: dict[str, Any]) -> None:
    line = json.dumps({"id": 7, "protocol": MS2000, **request_})
    assert code(line) == (7, "bad_request")


@pytest.mark.parametrize("key", ["axis", "kind", "direction", "allow_dummy", "refuse_prefix_bytes"])
def test_frames_have_no_keys_of_commands(key: str) -> None:
    request = {"id": 7, "op": "encode", "protocol": "thorlabs_apt", "message": "MOD_IDENTIFY"}
    assert code(json.dumps(request | {key: "command"})) == (7, "bad_request")


# Streams


def test_a_stream_to_a_controller() -> None:
    answer = stream("183f3a3a18003a", "ff42185403", "3a003a3a18543a1841")
    assert names(answer) == ["message", "garbage", "unknown", "message", "message", "bad_length"]
    assert answer["pending"] == "1841"
    assert answer["events"][0] == {
        "event": "message",
        "message": "READ_STATUS",
        "kind": "command",
        "form": "request",
        "axis": 24,
        "fields": {},
    }
    assert answer["events"][2] == {"event": "unknown", "hex": "18003a"}
    assert answer["events"][4]["fields"] == {"target_position": 0x3A003A}
    assert stream("183f3a3a18003aff421854033a003a3a18543a1841", end="device") == answer


def test_a_stream_to_the_host() -> None:
    answer = stream("a0", "8601ff", "00", end="host", command="READ_MOTOR_POSITION")
    assert names(answer) == ["message", "garbage"]
    assert answer["events"][0] == {
        "event": "message",
        "message": "READ_MOTOR_POSITION",
        "kind": "command",
        "form": "reply",
        "fields": {"position": 100000},
    }
    assert answer["events"][1]["hex"] == "ff00"
    assert answer["pending"] == ""
    assert stream("a086", end="host", command="READ_MOTOR_POSITION") == {
        "ok": True,
        "events": [],
        "pending": "a086",
    }


@pytest.mark.parametrize("command", ["START_MOTOR", "WRITE_TARGET_POSITION", "RESET_CONTROLLER"])
def test_bytes_after_a_command_without_a_reply_are_garbage(command: str) -> None:
    answer = stream("62", "63", end="host", command=command)
    assert answer["events"] == [{"event": "garbage", "hex": "6263"}]


def test_a_stream_after_an_unknown_command_is_refused() -> None:
    request = {"op": "stream", "protocol": MS2000, "chunks": [], "end": "host"}
    assert refused(**request, command="READ_MINDS") == "unknown_message"


# Random input


KEYS = ["protocol", "hex", "message", "form", "fields", "axis", "chunks", "direction", "command"]
WORDS = [MOVE, REPLY, "READ_STATUS", "WRITE_TARGET_POSITION", "RESET_CONTROLLER", "reply", "host"]
LEAVES = (
    st.none() | st.booleans() | st.integers() | st.text(max_size=8) | st.sampled_from([*WORDS, 24])
)
VALUES = st.recursive(
    LEAVES,
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.dictionaries(st.sampled_from(["target_position", "status", "x"]), inner, max_size=2)
    ),
    max_leaves=6,
)
OBJECTS = st.fixed_dictionaries(
    {"id": st.integers(), "op": st.sampled_from(["decode", "encode", "stream"])},
    optional={
        **dict.fromkeys([*KEYS[1:], "extra", "end", "kind", "allow_dummy"], VALUES),
        "protocol": st.just(MS2000),
    },
)


@pytest.mark.matrix
@seed(20250317)
@settings(max_examples=300, deadline=None, database=None)
@given(st.lists(OBJECTS, min_size=1, max_size=3))
def test_hostile_lines(requests: list[Any]) -> None:
    lines = [json.dumps(request).encode() for request in requests]
    assert [answer["id"] for answer in ask(*lines)] == [request["id"] for request in requests]


STREAMS = st.lists(
    st.binary(max_size=12)
    | st.sampled_from(
        [b"\x18\x3f\x3a", bytes.fromhex(MOVE), b"\xff\x42", b"\x3a", b"\x18\x54\x03"]
    ),
    max_size=8,
)


@seed(20250317)
@settings(max_examples=200, deadline=None, database=None)
@given(STREAMS, st.sampled_from([None, "READ_STATUS", "READ_MOTOR_POSITION", "START_MOTOR"]))
def test_streams_of_anything(chunks: list[bytes], command: str | None) -> None:
    more = {"end": "host", "command": command} if command else {}
    answer = stream(*(chunk.hex() for chunk in chunks), **more)
    assert answer["ok"]
    assert answer == stream(b"".join(chunks).hex(), **more)


@seed(20250317)
@settings(max_examples=200, deadline=None, database=None)
@given(st.integers(-(2**23), 2**23 - 1), st.integers(0, 254).filter(lambda axis: axis != 0x3A))
def test_every_position_round_trips(position: int, axis: int) -> None:
    request = {"message": "WRITE_TARGET_POSITION", "axis": axis}
    request["fields"] = {"target_position": position}
    decoded = decode(encode(**request)["hex"])
    assert (decoded["axis"], decoded["fields"]) == (axis, request["fields"])
