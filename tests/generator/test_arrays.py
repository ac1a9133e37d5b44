"""Packets that end with an array, arrays of fixed length, and messages that must not be sent."""

from __future__ import annotations

import csv
import io
import json
import pickle
from collections.abc import Callable
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from stagewire.columns import columns, gather, numpy_columns
from stagewire.errors import (
    BadLengthError,
    BadValueError,
    DecodeError,
    OutOfRangeError,
    TruncatedError,
    UnsupportedError,
)
from stagewire.framing import BadLength, End, Garbage, Received, join_garbage
from stagewire.protocols import Frame
from stagewire.sessions import FramedCore
from stagewire_cli.main import main

DEVICE, HOST = 0x50, 0x01
LONGEST = 4 + 40 * 4 * 4  # bytes of the longest LASER_SET_CURVE


@pytest.fixture
def m(laser: Any) -> Any:
    """The messages."""
    return laser.messages


def sent(message: Any) -> bytes:
    """Return the bytes of a message to the laser."""
    raw: bytes = message.pack(DEVICE, HOST)
    return raw


def curve_of(m: Any, beams: int, points: int) -> Any:
    """Return a curve whose integers count."""
    count = points * (1 + beams.bit_count())
    return m.LaserSetCurve(7, beams, points, range(-1, count - 1))


def with_length(raw: bytes, length: int) -> bytes:
    """Return a frame that declares another length."""
    return raw[:2] + length.to_bytes(2, "little") + raw[4:]


# Encoding and decoding


def test_a_message_has_its_array_as_integers_and_as_rows(laser: Any, m: Any) -> None:
    message = m.LaserSetCurve(number=7, beams=0b101, points=2, curve=[0, 5, -6, 10, 7, -8])
    raw = sent(message)
    assert raw.hex(" ") == (
        "40 08 1c 00 d0 01 07 00 05 02 00 00 00 00 05 00 00 00 fa ff ff ff "
        "0a 00 00 00 07 00 00 00 f8 ff ff ff"
    )
    assert message.rows == ((0, 5, -6), (10, 7, -8))
    frame = laser.PROTOCOL.decode(raw)
    assert frame.message == message
    assert hash(frame.message) == hash(message)
    assert pickle.loads(pickle.dumps(message)) == message
    assert message.replace(beams=0b1, points=3).rows == ((0, 5), (-6, 10), (7, -8))


@given(data=st.data())
def test_every_array_round_trips(laser: Any, data: st.DataObject) -> None:
    number = data.draw(st.integers(0, 0xFFFF))
    beams, points = data.draw(st.integers(0, 7)), data.draw(st.integers(0, 40))
    count = points * (1 + beams.bit_count())
    curve = data.draw(st.lists(st.integers(-(10**6), 10**6), min_size=count, max_size=count))
    message = laser.messages.LaserSetCurve(number, beams, points, curve)
    raw = sent(message)
    assert len(raw) == 6 + 4 + 4 * count <= 6 + LONGEST
    frame = laser.PROTOCOL.decode(raw)
    assert frame.message == message
    assert frame.encode() == raw
    [event] = laser.PROTOCOL.framer(End.DEVICE).feed(raw)
    assert (type(event), event.raw) == (Received, raw)


@given(packet=st.binary(max_size=LONGEST + 8))
def test_any_packet_is_decoded_exactly_or_refused(laser: Any, packet: bytes) -> None:
    """A decoded message encodes to the received bytes, so no integer was invented or lost."""
    head = bytes.fromhex("40 08") + len(packet).to_bytes(2, "little") + bytes((DEVICE | 0x80, HOST))
    try:
        frame = laser.PROTOCOL.decode(head + packet)
    except BadLengthError:
        return
    assert frame.encode() == head + packet
    counts = frame.message.points * (1 + frame.message.beams.bit_count())
    assert len(frame.message.curve) == counts == (len(packet) - 4) // 4


@pytest.mark.parametrize(
    ("arguments", "error", "text"),
    [
        ((1, 1, 2, [1, 2, 3]), OutOfRangeError, "must have 4 integers, points (2) rows of 2, not 3"),
        ((1, 0, 1, []), OutOfRangeError, "must have 1 integers, points (1) rows of 1, not 0"),
        ((1, 0, 1, [1000001]), OutOfRangeError, "curve[0] must be -1000000 to 1000000 (raw counts), not"),
        ((1, 0, 41, [0] * 41), OutOfRangeError, "points must be 0 to 40"),
        ((1, 8, 1, [0, 0]), OutOfRangeError, "beams must be 0 to 7"),
        ((1, 0, 1, ["1"]), BadValueError, "curve[0] must be an integer, not '1'"),
        ((1, 0, 1, [True]), BadValueError, "curve[0] must be an integer, not True"),
        ((1, 0, 1, b"\0"), BadValueError, "must be a sequence of integers, not b'\\x00'"),
        ((1, 0, 1, 5), BadValueError, "must be a sequence of integers, not 5"),
    ],
)  # fmt: skip
def test_an_array_must_fit_its_fields(
    m: Any, arguments: tuple[Any, ...], error: type[Exception], text: str
) -> None:
    with pytest.raises(error) as caught:
        m.LaserSetCurve(*arguments)
    assert text in str(caught.value)
    if error is OutOfRangeError:
        assert str(caught.value).endswith("; see page 6")


def test_nothing_can_follow_an_array(m: Any) -> None:
    with pytest.raises(BadValueError, match="LASER_SET_CURVE ends with curve; extra bytes cannot"):
        Frame(curve_of(m, 1, 1), DEVICE, HOST, b"\0")


def test_a_format_of_several_integers_becomes_fields(m: Any) -> None:
    table = m.LaserSetTable(1, 2, 3, response_4=4)
    assert sent(table)[6:] == bytes((1, 0, 2, 0, 3, 0, 4, 0))
    assert m.LaserSetTable.layout.fields == ("response_1", "response_2", "response_3", "response_4")


# Lengths


def test_a_length_that_the_fields_contradict_is_an_event_of_its_own(laser: Any, m: Any) -> None:
    good = sent(curve_of(m, 3, 2))
    for wrong in (good[:-4], good + bytes(4), good + b"\0", good[:-1], good[:10]):
        frame = with_length(wrong, len(wrong) - 6)
        events = laser.PROTOCOL.framer(End.DEVICE).feed(frame + good)
        assert [(type(event), event.raw) for event in events] == [
            (BadLength, frame), (Received, good)
        ]  # fmt: skip
        with pytest.raises(BadLengthError, match="its points and beams state 28"):
            laser.PROTOCOL.decode(frame)


@pytest.mark.parametrize("declared", [LONGEST + 1, 0x0400, 0xFFFF])
def test_a_length_beyond_every_array_does_not_wait(laser: Any, m: Any, declared: int) -> None:
    good = sent(curve_of(m, 3, 2))
    framer = laser.PROTOCOL.framer(End.DEVICE)
    events = join_garbage(framer.feed(with_length(good, declared) + good))
    assert [type(event) for event in events] == [Garbage, Received]
    assert not framer.pending


def test_a_wild_length_is_searched_for_frames(laser: Any, m: Any) -> None:
    """A length that the message may have is awaited; then the frames in the packet are found."""
    good, limit = sent(curve_of(m, 3, 2)), with_length(sent(curve_of(m, 3, 2)), LONGEST)
    framer = laser.PROTOCOL.framer(End.DEVICE)
    assert framer.feed(limit + good) == []
    assert len(framer.pending) < 6 + LONGEST
    assert [type(event) for event in framer.abandon()] == [Garbage, Received]
    events = join_garbage(framer.feed(limit + 30 * good))
    kinds = [type(event) for event in events]
    assert kinds[0] is Garbage
    assert kinds[1:] == [Received] * 30


@given(frames=st.integers(0, 4), noise=st.binary(max_size=40), sizes=st.lists(st.integers(1, 60)))
def test_chunks_do_not_matter(laser: Any, frames: int, noise: bytes, sizes: list[int]) -> None:
    good = sent(curve_of(laser.messages, 5, 3))
    stream = frames * good + noise + with_length(good, 300) + 2 * good
    whole = laser.PROTOCOL.framer(End.NONE)
    expected = join_garbage(whole.feed(stream))
    framer, events, rest = laser.PROTOCOL.framer(End.NONE), [], stream
    for size in sizes:
        events += framer.feed(rest[:size])
        rest = rest[size:]
    events += framer.feed(rest)
    assert [(type(e), e.raw) for e in join_garbage(events)] == [
        (type(e), e.raw) for e in expected
    ]  # fmt: skip
    assert framer.pending == whole.pending


# Columns


def test_columns_have_a_tuple_for_each_array(m: Any) -> None:
    messages = [curve_of(m, 3, 2), curve_of(m, 0, 0), curve_of(m, 7, 1)]
    raw = b"".join(map(sent, messages))
    found = columns(m.LaserSetCurve, raw)
    assert list(found["points"]) == [2, 0, 1]
    assert found["curve"] == [message.curve for message in messages]
    arrays = numpy_columns(m.LaserSetCurve, raw)
    assert arrays["beams"].tolist() == [3, 0, 7]
    assert arrays["curve"].tolist() == [message.curve for message in messages]
    assert numpy_columns(m.LaserSetCurve, b"")["curve"].size == 0


@pytest.mark.parametrize("read", [columns, numpy_columns])
def test_columns_refuse_other_frames(read: Callable[..., Any], m: Any) -> None:
    good = sent(curve_of(m, 3, 2))
    for wrong, error, text in (
        (good[:-1], TruncatedError, "byte 34: .* 28 bytes of data, but only"),
        (good[:3], TruncatedError, "byte 34: .* only 3 bytes are left"),
        (b"\x41" + good[1:], DecodeError, "byte 34: .* id 0x0840, found id 0x0841"),
        (with_length(good, 27), BadLengthError, "byte 34: .* 4 to 644 bytes"),
        (good[:8] + b"\1" + good[9:], BadLengthError, "its fields state 20"),
        (sent(m.LaserReqCurve(1)), DecodeError, "found id 0x0841"),
    ):
        with pytest.raises(error, match=text):
            read(m.LaserSetCurve, good + wrong)


def test_a_sorted_stream_has_the_arrays(laser: Any, m: Any) -> None:
    messages = [curve_of(m, 3, 2), m.LaserSetTable(1, 2, 3, 4), curve_of(m, 1, 1)]
    sorter = gather(laser.PROTOCOL, [b"".join(map(sent, messages))])
    assert sorter.frames[m.LaserSetCurve].columns()["curve"] == [
        messages[0].curve, messages[2].curve
    ]  # fmt: skip


# The command


def test_the_command_shows_encodes_and_decodes_arrays(
    laser: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["show", "LASER_SET_CURVE"]) == 0
    shown = capsys.readouterr().out
    assert "data, 4 to 644 bytes" in shown
    assert "points rows of time, power for each bit of beams" in " ".join(shown.split())
    words = ["LASER_SET_CURVE", "number=7", "beams=red|blue", "points=1", "curve=0 5 -6"]
    assert main(["encode", "--protocol", "laser", *words]) == 0
    raw = "40 08 10 00 d0 01 07 00 05 01 00 00 00 00 05 00 00 00 fa ff ff ff"
    assert raw in capsys.readouterr().out.lower()
    assert main(["decode", "--protocol", "laser", raw]) == 0
    assert "0 5 -6" in capsys.readouterr().out
    assert main(["encode", "--protocol", "laser", *words[:-1], "curve=0 x"]) == 2
    assert "curve must be integers such as '0 -5 0x05'" in capsys.readouterr().err


def test_the_command_writes_arrays_in_a_column(
    laser: Any, m: Any, tmp_path: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "stream.bin"
    file.write_bytes(sent(curve_of(m, 1, 2)) + sent(curve_of(m, 0, 1)))
    command = ["decode", str(file), "--protocol", "laser", "--end", "device"]
    assert main([*command, "--message", "LASER_SET_CURVE", "--format", "csv"]) == 0
    rows = list(csv.DictReader(io.StringIO(capsys.readouterr().out)))
    assert [row["curve"] for row in rows] == ["-1 0 1 2", "-1"]


# Messages that are not sent


def test_a_message_is_decoded_with_both_ids_and_sent_with_neither(laser: Any, m: Any) -> None:
    core = FramedCore(laser.PROTOCOL)
    for message in (m.LaserPulse(beam=1), m.LaserPulse0849(beam=1)):
        assert laser.PROTOCOL.decode(sent(message)).message == message
        for call in (core.send, lambda *given: core.ask(given[0], (m.LaserLog,), *given[1:])):
            with pytest.raises(UnsupportedError) as caught:
                call(message, DEVICE, 1.0, 0.0)
            name = message.layout.message
            reason = "its heading and its table have different ids"
            assert str(caught.value) == f"{name} is not sent: {reason}"
    assert core.output(0.0) == b""


def test_the_registry_states_why_a_message_is_not_sent(laser_files: dict[str, str]) -> None:
    registry = json.loads(laser_files["python/stagewire_laser/registry.json"])
    found = {entry["name"]: entry for entry in registry["messages"]}
    assert found["LASER_PULSE_0849"]["twin_of"] == "LASER_PULSE"
    assert found["LASER_PULSE"]["not_sent"] == "its heading and its table have different ids"
    assert "Stagewire does not send it" in laser_files["c/stagewire_laser/messages/arrays.h"]


def test_the_table_of_the_parser_keeps_four_bytes_an_entry(laser_files: dict[str, str]) -> None:
    source = laser_files["c/stagewire_laser/stagewire_laser.c"]
    assert "{0x0840U, 4U, LASER_ENTRY_TO_CONTROLLER | LASER_ENTRY_ARRAY}," in source
    header = laser_files["c/stagewire_laser/parser.h"]
    assert "LASER_STATIC_ASSERT(sizeof(laser_entry) == 4U" in header
    assert "#define LASER_LONGEST_PACKET 644U" in header
