"""The small good spec of messages that share an id, and of layouts that depend on the unit."""

from __future__ import annotations

import importlib
import json
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jsonschema
import pytest

from checkout import SCHEMAS
from stagewire.columns import columns, gather, numpy_columns
from stagewire.errors import (
    BadLengthError,
    DecodeError,
    MissingFieldError,
    OutOfRangeError,
    ReplyTimeoutError,
    TruncatedError,
    UnknownFieldError,
    UnknownMessageError,
    UnknownSubMessageError,
)
from stagewire.framing import BadLength, End, Garbage, Received, Unknown, UnknownSubMessage
from stagewire.links import Link
from stagewire.sessions import FramedCore
from stagewire_cli.main import main
from stagewire_generator.model import Protocol

DEVICE, HOST = 0x50, 0x01
UNKNOWN = bytes.fromhex("02 08 04 00 81 50 09 00 11 22")


@pytest.fixture
def files(laser_files: dict[str, str]) -> dict[str, str]:
    """The generated files."""
    return laser_files


@pytest.fixture
def m(laser: Any) -> Any:
    """The messages."""
    return laser.messages


def said(message: Any) -> bytes:
    """Return the bytes of a message from the laser."""
    raw: bytes = message.pack(HOST, DEVICE)
    return raw


# Sub-messages


def test_the_sub_message_selects_the_message(laser: Any, m: Any) -> None:
    for message in (
        m.LaserGetSetpoint(setpoint=7),
        m.LaserGetModes(modes=b"\1\2"),  # with the same header
        m.LaserGetSetpoint(setpoint=8),
        m.LaserGetFilter(filter=3),
        m.LaserGetLimits(max_current=1, limit_source=2, serial="SN1"),
    ):
        assert laser.decode(said(message)).message == message
    assert said(m.LaserGetSetpoint(setpoint=7)).hex(" ") == "02 08 04 00 81 50 01 00 07 00"
    assert said(m.LaserGetModes(modes=b"\1\2")).hex(" ") == "02 08 04 00 81 50 2c 01 01 02"
    assert m.LaserReqSetpoint().pack(DEVICE, HOST).hex(" ") == "01 08 01 00 50 01"


def test_a_message_cannot_be_sent_with_another_sub_message(m: Any) -> None:
    with pytest.raises(OutOfRangeError):
        m.LaserGetSetpoint(setpoint=7, sub_message=3)
    with pytest.raises(OutOfRangeError):
        m.LaserReqSetpoint(param1=3)


def test_an_unknown_sub_message_has_an_error_of_its_own(laser: Any) -> None:
    with pytest.raises(UnknownSubMessageError) as caught:
        laser.decode(UNKNOWN)
    assert isinstance(caught.value, UnknownMessageError)
    assert str(caught.value) == (
        "bytes 6 and 7: no message of Protocol of the small laser with the id 0x0802 has the sub-message 9; "
        "known: 1 (LASER_GET_SETPOINT), 2 (LASER_GET_FILTER), 3 (LASER_GET_LIMITS), 300 (LASER_GET_MODES)"
    )
    assert caught.value.at == range(6, 8)
    with pytest.raises(UnknownSubMessageError, match=r"byte 2: .* the sub-message 44;"):
        laser.decode(bytes.fromhex("01 08 2c 01 50 01"))  # 300 does not fit into a header


@pytest.mark.parametrize(
    ("raw", "error", "said"),
    [
        ("02 08 01 00 81 50 01", BadLengthError, "LASER_GET_SETPOINT or another sub-message: "),
        ("02 08 04 00 81 50 03 00 11 22", BadLengthError, "LASER_GET_LIMITS: .* 12 bytes"),
        ("02 08 02 00 81 50 02 00", BadLengthError, "LASER_GET_FILTER: .* has no packet"),
        ("02 08 01 00 01 50", BadLengthError, "LASER_GET_SETPOINT: .* no header-only form"),
        ("02 08 04 00 81 50 03", TruncatedError, "LASER_GET_SETPOINT or another sub-message: "),
    ],
)
def test_a_wrong_length_or_form_is_never_another_message(
    laser: Any, raw: str, error: type[Exception], said: str
) -> None:
    with pytest.raises(error, match=said):
        laser.decode(bytes.fromhex(raw))


def test_a_stream_reports_unknown_sub_messages(laser: Any, m: Any) -> None:
    setpoint, modes = said(m.LaserGetSetpoint(setpoint=7)), said(m.LaserGetModes(modes=b"ab"))
    header = bytes.fromhex("02 08 09 03 01 50")
    short = bytes.fromhex("02 08 04 00 81 50 03 00 11 22")
    stream = setpoint + UNKNOWN + modes + header + short + setpoint
    for size in (1, 7, len(stream)):
        framer = laser.PROTOCOL.framer(End.HOST)
        parts = [stream[at : at + size] for at in range(0, len(stream), size)]
        events = [event for part in parts for event in framer.feed(part)]
        assert [(type(event), event.raw) for event in events] == [
            (Received, setpoint), (UnknownSubMessage, UNKNOWN), (Received, modes),
            (UnknownSubMessage, header), (BadLength, short), (Received, setpoint),
        ]  # fmt: skip
        assert [event.sub_message for event in events if isinstance(event, Unknown)] == [9, 9]
        assert events[2].frame.message == m.LaserGetModes(modes=b"ab")


def test_an_unknown_sub_message_does_not_end_garbage(laser: Any, m: Any) -> None:
    setpoint = said(m.LaserGetSetpoint(setpoint=7))
    events = laser.PROTOCOL.framer(End.HOST).feed(b"\xff" + UNKNOWN + setpoint)
    assert [type(event) for event in events] == [Garbage, Received]
    assert events[1].raw == setpoint


# Sessions


class Talk:
    """A session core with stepped time."""

    def __init__(self, laser: Any) -> None:
        self.core = FramedCore(laser.PROTOCOL)

    def ask(self, request: Any, reply: Any) -> Any:
        """Send a request."""
        asked = self.core.ask(request, (reply,), DEVICE, 1.0, 0.0)
        self.core.output(0.0)
        return asked


def test_a_reply_with_another_sub_message_answers_nothing(laser: Any, m: Any) -> None:
    talk = Talk(laser)
    asked = talk.ask(m.LaserReqSetpoint(), m.LaserGetSetpoint)
    talk.core.receive(said(m.LaserGetModes(modes=b"ab")), 0.1)
    talk.core.receive(UNKNOWN, 0.1)
    assert not asked.done
    talk.core.receive(said(m.LaserGetSetpoint(setpoint=7)), 0.2)
    assert asked.value().message == m.LaserGetSetpoint(setpoint=7)


def test_a_timeout_names_the_sub_messages_that_arrived(laser: Any, m: Any) -> None:
    talk = Talk(laser)
    asked = talk.ask(m.LaserReqSetpoint(), m.LaserGetSetpoint)
    talk.core.receive(said(m.LaserGetFilter(filter=2)) + UNKNOWN, 0.1)
    talk.core.tick(2.0)
    with pytest.raises(ReplyTimeoutError) as caught:
        asked.value()
    assert "no LASER_GET_SETPOINT arrived" in str(caught.value)
    assert "1 x LASER_GET_FILTER, 1 x unknown sub-message 9 of 0x0802" in str(caught.value)


def test_a_subscription_gets_only_its_sub_message(laser: Any, m: Any) -> None:
    core = Talk(laser).core
    wanted = core.subscribe(m.LaserGetModes)
    core.receive(said(m.LaserGetSetpoint(setpoint=7)), 0.1)
    core.receive(said(m.LaserGetModes(modes=b"ab")), 0.1)
    [event] = [wanted.take() for _ in range(len(wanted))]
    assert event is not None
    assert event.raw == said(m.LaserGetModes(modes=b"ab"))


# Columns


@pytest.mark.parametrize("read", [columns, numpy_columns])
def test_columns_have_one_sub_message(read: Callable[..., Any], m: Any) -> None:
    good = [said(m.LaserGetSetpoint(setpoint=value)) for value in (7, 8)]
    assert list(read(m.LaserGetSetpoint, b"".join(good))["setpoint"]) == [7, 8]
    other = said(m.LaserGetModes(modes=b"ab"))
    with pytest.raises(DecodeError, match=r"byte 10: .* sub-message 1, found 300"):
        read(m.LaserGetSetpoint, good[0] + other)
    filters = [said(m.LaserGetFilter(filter=value)) for value in (1, 6)]
    assert list(read(m.LaserGetFilter, b"".join(filters))["filter"]) == [1, 6]
    with pytest.raises(DecodeError, match=r"byte 6: .* sub-message 2, found 5"):
        read(m.LaserGetFilter, filters[0] + bytes.fromhex("02 08 05 01 01 50"))


def test_a_sorted_stream_has_the_frames_of_each_sub_message(laser: Any, m: Any) -> None:
    messages = [m.LaserGetSetpoint(setpoint=7), m.LaserGetModes(modes=b"ab")]
    messages += [m.LaserGetFilter(filter=2), m.LaserGetSetpoint(setpoint=8)]
    sorter = gather(laser.PROTOCOL, [b"".join(map(said, messages)) + UNKNOWN])
    assert {cls: len(frames) for cls, frames in sorter.frames.items()} == {
        m.LaserGetSetpoint: 2, m.LaserGetModes: 1, m.LaserGetFilter: 1
    }  # fmt: skip
    assert sorter.counts[UnknownSubMessage] == 1


# Contexts


STATE = "30 08 06 00 81 50 02 00 07 00 1a 00"


@pytest.mark.parametrize(
    ("context", "name"),
    [
        (None, "LaserStateUndecided"),
        ({"reading": "old"}, "LaserStateOld"),
        ({"reading": "old", "scale": "kelvin"}, "LaserStateOld"),
        ({"reading": "new"}, "LaserStateUndecided"),
        ({"scale": "kelvin"}, "LaserStateUndecided"),
        ({"reading": "new", "scale": "kelvin"}, "LaserStateKelvin"),
    ],
)
def test_several_contexts_select_a_layout_together(
    laser: Any, context: dict[str, str] | None, name: str
) -> None:
    assert type(laser.decode(bytes.fromhex(STATE), context).message).__name__ == name


class Answering(Link):
    """A link to a laser that answers the identity request, and then reports its state."""

    def __init__(self, firmware: bytes, m: Any) -> None:
        self.url = "answering"
        self.changed = threading.Condition()
        self.said = bytearray()
        self.info = said(m.LaserGetInfo(model="LS1", software_version=firmware))
        self.heard: list[bytes] = []

    def read(self, timeout: float | None) -> bytes:
        """Return what was said."""
        with self.changed:
            self.changed.wait_for(lambda: self.said, timeout)
            data = bytes(self.said)
            self.said.clear()
            return data

    def write(self, data: bytes) -> None:
        """Answer a request."""
        self.heard.append(data)
        if data[:2] == b"\x05\x00":
            self.say(self.info)
        if data[:2] == b"\x31\x08":
            self.say(bytes.fromhex(STATE + "32 08 02 00 01 50"))

    write_now = write

    def say(self, data: bytes) -> None:
        """Send bytes to the host."""
        with self.changed:
            self.said += data
            self.changed.notify_all()

    def has_unread(self) -> bool:
        """Whether bytes wait to be read."""
        return bool(self.said)

    def wake(self) -> None:
        """Wake the reader."""
        with self.changed:
            self.changed.notify_all()

    def close(self) -> None:
        """Do nothing."""


@pytest.mark.parametrize(
    ("unit", "firmware", "identify", "name"),
    [
        ("LS1", b"\x05\x09\x01\0", True, "LaserStateOld"),  # 1.9.5
        ("LS1", b"\x00\x00\x02\0", True, "LaserStateCelsius"),
        ("LS1", b"\x00\x01\x0a\0", True, "LaserStateCelsius"),  # 10.1.0
        ("LS1", b"\x00\x00\x02\0", False, "LaserStateUndecided"),  # the firmware is unknown
        ("LS2", b"\x05\x09\x01\0", True, "LaserStateKelvin"),
        ("LS2", b"\x05\x09\x01\0", False, "LaserStateKelvin"),
    ],
)
def test_a_device_passes_the_contexts_of_its_unit_and_firmware(
    laser: Any, m: Any, unit: str, firmware: bytes, identify: bool, name: str
) -> None:
    devices = importlib.import_module("stagewire_laser.devices")
    opened = getattr(devices, unit).open(Answering(firmware, m), identify=identify)
    with opened as device, device.session.subscribe() as events:
        shutter = device.get_shutter(timeout=5)
        found = events.get(timeout=5)
    assert type(found.frame.message).__name__ == name
    # The same number has another name on the unit with a shutter.
    assert getattr(shutter.state, "name", 2) == ("SHUTTER_OPEN" if unit == "LS2" else 2)


OLD, NEW = b"\x05\x09\x01\0", b"\x00\x00\x02\0"  # 1.9.5 and 2.0.0


@pytest.mark.parametrize(
    ("firmware", "identify", "given", "raw"),
    [
        (OLD, True, {"speed": 7}, "50 08 02 00 d0 01 07 00"),
        (NEW, True, {"speed": 7, "start": 9}, "50 08 04 00 d0 01 07 00 09 00"),
        (OLD, False, {"speed": 7, "start": 9}, "50 08 04 00 d0 01 07 00 09 00"),  # it is unknown
    ],
)
def test_a_device_sends_the_length_that_its_firmware_has(
    laser: Any, m: Any, firmware: bytes, identify: bool, given: dict[str, int], raw: str
) -> None:
    devices = importlib.import_module("stagewire_laser.devices")
    link = Answering(firmware, m)
    with devices.LS1.open(link, identify=identify) as opened:
        opened.set_fan(**given)
    assert bytes.fromhex(raw) in link.heard


def test_a_value_that_the_length_lacks_is_refused(laser: Any, m: Any) -> None:
    devices = importlib.import_module("stagewire_laser.devices")
    link = Answering(OLD, m)
    with devices.LS1.open(link) as opened:
        with pytest.raises(UnknownFieldError, match="this set in a shorter packet without start"):
            opened.set_fan(speed=7, start=9)
        with pytest.raises(MissingFieldError, match="set_fan requires speed"):
            opened.set_fan(speed=None)
    link = Answering(NEW, m)
    with (
        devices.LS1.open(link) as opened,
        pytest.raises(MissingFieldError, match="set_fan requires start"),
    ):
        opened.set_fan(speed=7)
    assert not any(data[:2] == b"\x50\x08" for data in link.heard)


def test_the_registry_states_contexts_and_enumerations_by_unit(files: dict[str, str]) -> None:
    registry = json.loads(files["python/stagewire_laser/registry.json"])
    [small] = [entry for entry in registry["units"] if entry["name"] == "LS1"]
    assert small["contexts"] == {
        "reading": [{"value": "new", "from_firmware": "2.0"}, {"value": "old"}],
        "scale": "celsius",
    }
    [state] = [entry for entry in registry["messages"] if entry["name"] == "LASER_STATE"]
    assert state["layouts"][0]["fields"][0]["enums_by_unit"] == {"LS2": "shutter_state"}
    schema = json.loads((SCHEMAS / "registry.schema.json").read_text(encoding="utf-8"))
    assert list(jsonschema.Draft202012Validator(schema).iter_errors(registry)) == []


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ([], "form data:undecided"),
        ([], "use --context reading=new or --context reading=old, --context scale=celsius or "),
        (["--context", "reading=new", "--context", "scale=kelvin"], "form data:kelvin"),
        (["--context", "reading"], "'reading' must be NAME=VALUE"),
        (["--context", "reading=red"], "--context: "),
        (["--context", "scale=kelvin", "--context", "scale=celsius"], "contradicts scale=kelvin"),
    ],
)
def test_the_command_takes_contexts(
    laser: Any, capsys: pytest.CaptureFixture[str], options: list[str], said: str
) -> None:
    wrong = not said.startswith(("form", "use "))
    assert main(["decode", "--protocol", "laser", STATE, *options]) == (2 if wrong else 0)
    assert said in "".join(capsys.readouterr())


@pytest.mark.parametrize(
    ("unit", "options", "form"),
    [
        ("LS2", [], "kelvin"),
        ("LS1", [], "undecided"),  # it depends on the firmware, which the capture does not contain
        ("LS1", ["--context", "reading=new"], "celsius"),
        ("LS2", ["--context", "scale=celsius"], "celsius"),
    ],
)
def test_the_unit_of_a_capture_selects_layouts(
    laser: Any,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    unit: str,
    options: list[str],
    form: str,
) -> None:
    capture = tmp_path / "capture.txt"
    capture.write_text(f"# stagewire capture 1 protocol=laser unit={unit}\n0.0 < {STATE}\n")
    assert main(["decode", str(capture), "--json", *options]) == 0
    assert json.loads(capsys.readouterr().out)["form"] == f"data:{form}"


# Parameter sets whose SET and GET differ


def test_a_get_may_be_longer_than_its_set(laser: Any, m: Any) -> None:
    assert m.LaserSetLimits.layout.fields == ("sub_message", "max_current", "spare")
    assert m.LaserGetLimits.layout.fields == (
        "sub_message",
        "max_current",
        "limit_source",
        "serial",
    )
    raw = m.LaserSetLimits(max_current=5).pack(DEVICE, HOST)
    assert raw.hex(" ") == "00 08 06 00 d0 01 03 00 05 00 00 00"
    assert laser.decode(raw).message == m.LaserSetLimits(max_current=5)


def test_some_values_are_changed_only_if_the_get_has_all_of_the_set(
    laser: Any, layouts: Protocol
) -> None:
    from stagewire_laser.devices import LS1

    assert {"get_limits", "set_limits", "change_limits"} <= set(dir(LS1))
    # In this spec, the GET of a set lacks a field of its SET.
    assert {"get_power", "set_power"} <= set(dir(LS1))
    assert "change_power" not in dir(LS1)


# The registry and the command


def test_the_registry_states_sub_messages(files: dict[str, str]) -> None:
    registry = json.loads(files["python/stagewire_laser/registry.json"])
    found = {entry["name"]: entry for entry in registry["messages"]}
    assert found["LASER_GET_MODES"]["sub_message"] == 300
    assert "sub_message" not in found["LASER_BEAM"]
    [layout] = found["LASER_GET_MODES"]["layouts"]
    assert (layout["fields"][0]["minimum"], layout["fields"][0]["maximum"]) == (300, 300)


def test_the_command_shows_all_messages_of_an_id(
    laser: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["show", "0x0802"]) == 0
    text = capsys.readouterr().out
    assert "id 0x0802, sub-message 300, to host" in text
    assert [line for line in text.splitlines() if line.endswith("(laser)")] == [
        "message LASER_GET_SETPOINT (laser)",
        "message LASER_GET_FILTER (laser)",
        "message LASER_GET_LIMITS (laser)",
        "message LASER_GET_MODES (laser)",
    ]


def test_the_command_decodes_sub_messages(laser: Any, capsys: pytest.CaptureFixture[str]) -> None:
    command = ["decode", "--protocol", "laser"]
    assert main([*command, "02 08 04 00 81 50 2c 01 01 02"]) == 0
    assert "LASER_GET_MODES (id 0x0802, sub-message 300," in capsys.readouterr().out
    assert main([*command, UNKNOWN.hex()]) == 1
    assert "has the sub-message 9" in "".join(capsys.readouterr())


def test_c_has_a_row_for_each_sub_message(files: dict[str, str]) -> None:
    source = files["c/stagewire_laser/stagewire_laser.c"]
    assert "{0x0802U, 0U, LASER_ENTRY_TO_HOST | LASER_ENTRY_SHARED}," in source
    assert "{0x0802U, 12U, LASER_ENTRY_TO_HOST}," in source
    header = files["c/stagewire_laser/parser.h"]
    assert "LASER_STATIC_ASSERT(sizeof(laser_entry) == 4U" in header
    assert (
        "#define LASER_LASER_GET_MODES_SUB_MESSAGE 300U"
        in files["c/stagewire_laser/messages/laser.h"]
    )
