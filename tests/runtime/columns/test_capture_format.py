"""The text format of captures: writing, reading, and the errors for invalid text."""

from __future__ import annotations

import io
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from stagewire.capture import (
    Capture,
    CaptureReader,
    CaptureWriter,
    Heading,
    Recorded,
    is_capture,
    read_capture,
)
from stagewire.errors import BadValueError, CaptureError
from stagewire.protocols import Direction

HEADING = "# stagewire capture 1 protocol=thorlabs_apt unit=TDC001\n"
TO_CONTROLLER, TO_HOST = Direction.TO_CONTROLLER, Direction.TO_HOST


def read(text: str) -> Capture:
    reader = CaptureReader()
    recorded = [*reader.feed(text), *reader.finish()]
    assert reader.heading is not None
    return Capture(reader.heading, tuple(recorded))


def test_the_text_of_a_capture() -> None:
    out = io.StringIO()
    writer = CaptureWriter(out, Heading("thorlabs_apt", "TDC001"))
    writer.write(0, TO_CONTROLLER, bytes.fromhex("050000005001"), "HW_REQ_INFO")
    writer.note(1_500, "connected")
    writer.write(12_345_678_999, TO_HOST, b"\x06\x00")
    assert out.getvalue() == (
        f"{HEADING}0.000000 > 05 00 00 00 50 01  # HW_REQ_INFO\n"
        "# 0.000001 connected\n"
        "12.345678 < 06 00\n"
    )
    assert read(out.getvalue()) == Capture(
        Heading("thorlabs_apt", "TDC001"),
        (
            Recorded(0, TO_CONTROLLER, bytes.fromhex("050000005001"), "HW_REQ_INFO", 2),
            Recorded(12_345_678_000, TO_HOST, b"\x06\x00", "", 4),
        ),
    )


@given(
    st.lists(
        st.tuples(
            st.integers(0, 10**15),
            st.sampled_from([TO_CONTROLLER, TO_HOST]),
            st.binary(min_size=1, max_size=40),
            st.text(max_size=20),
        ),
        max_size=6,
    ),
    st.integers(1, 50),
)
def test_written_captures_are_read_in_blocks_of_any_size(
    said: list[tuple[int, Direction, bytes, str]], size: int
) -> None:
    out = io.StringIO()
    writer = CaptureWriter(out, Heading("asi_ms2000"))
    for time, direction, data, comment in said:
        writer.note(time, comment)
        writer.write(time, direction, data, comment)
    text = out.getvalue()
    assert text.count("\n") == 1 + 2 * len(said)  # comments add no lines
    assert read(text).recorded == read(text.replace("\n", "\r\n")).recorded
    reader = CaptureReader()
    found = [r for at in range(0, len(text), size) for r in reader.feed(text[at : at + size])]
    assert not reader.finish()
    assert reader.heading == Heading("asi_ms2000")
    assert [(r.direction, r.data) for r in found] == [(d, data) for _, d, data, _ in said]
    times = [r.time for r in found]
    assert times == sorted(times)
    latest = 0
    for recorded, (time, *_) in zip(found, said, strict=True):
        latest = max(latest, time)
        assert recorded.time == latest // 1000 * 1000


def test_a_large_chunk_is_written_as_several_lines() -> None:
    out = io.StringIO()
    data = bytes(range(256)) * 8192  # 2 MiB
    CaptureWriter(out, Heading("thorlabs_apt")).write(5000, TO_HOST, data, "a flood")
    recorded = read(out.getvalue()).recorded
    assert b"".join(r.data for r in recorded) == data
    assert {r.time for r in recorded} == {5000}
    assert [r.comment for r in recorded if r.comment] == ["a flood"]


@pytest.mark.parametrize(
    ("line", "nanoseconds", "data"),
    [
        ("3 > 00", 3_000_000_000, "00"),
        ("  0.5\t<  0A0b 0c # x # y", 500_000_000, "0a0b0c"),
        ("0.000000001 > ff#", 1, "ff"),
    ],
)
def test_handwritten_lines(line: str, nanoseconds: int, data: str) -> None:
    (recorded,) = read(f"{HEADING}\n# a comment\n   \n{line}").recorded
    assert (recorded.time, recorded.data.hex(), recorded.line) == (nanoseconds, data, 5)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "line 1: not a capture: the first line must begin with '# stagewire capture 1'"),
        ("# stagewire captures of last week\n", "line 1: not a capture"),
        (
            "# stagewire capture 2 protocol=x\n",
            "line 1: capture version 2 is unsupported (supported: 1)",
        ),
        ("# stagewire capture 1\n", "line 1: the protocol is missing: add protocol=NAME"),
        ("# stagewire capture 1 protocol=\n", "line 1: 'protocol=' is not protocol=NAME"),
        ("# stagewire capture 1 protocol=a protocol=b\n", "line 1: protocol is given twice"),
        ("# stagewire capture 1 protocol=a speed=9600\n", "line 1: 'speed=9600' is not protocol="),
        (f"{HEADING}hello\n", "line 2: 'hello' is not a time in seconds, such as 0.250000"),
        (f"{HEADING}-1 > 00\n", "line 2: '-1' is not a time"),
        (f"{HEADING}1e3 > 00\n", "line 2: '1e3' is not a time"),
        (f"{HEADING}٣ > 00\n", "line 2: '٣' is not a time"),
        (f"{HEADING}{'9' * 5000} > 00\n", "…' is not a time"),
        (f"{HEADING}0.1 = 00\n", "line 2: '=' is not a direction: > is from the host, < from the"),
        (f"{HEADING}0.1\n", "line 2: '' is not a direction"),
        (f"{HEADING}0.1 >00\n", "line 2: '>00' is not a direction"),
        (f"{HEADING}0.1 > 0 0\n", "line 2: '0 0' is not pairs of hex digits"),
        (f"{HEADING}0.1 >  # nothing\n", "line 2: no bytes after >"),
        (
            f"{HEADING}0.2 > 00\n\n0.1 > 00\n",
            "line 4: its time is earlier than that of a line above",
        ),
        (f"{HEADING}0.1 > {'00' * 600_000}", "line 2: over 1048576 characters in one line"),
    ],
    ids=range(19),
)
def test_errors_of_invalid_captures(text: str, said: str, tmp_path: Path) -> None:
    with pytest.raises(CaptureError) as caught:
        read(text)
    assert said in str(caught.value)
    assert f"line {caught.value.line}" in str(caught.value)
    path = tmp_path / "session.txt"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(CaptureError) as named:
        read_capture(path)
    assert str(named.value) == f"{path}, {caught.value}"


def test_reading_a_capture_from_a_file(tmp_path: Path) -> None:
    path = tmp_path / "session.txt"
    path.write_bytes(b"\xef\xbb\xbf" + f"{HEADING}0.1 > 00 # ".encode() + b"\xff\xfe\r\n")
    capture = read_capture(path)
    assert capture.heading == Heading("thorlabs_apt", "TDC001")
    assert [r.data for r in capture.recorded] == [b"\x00"]


@pytest.mark.parametrize(
    ("text", "is_one"),
    [
        (HEADING, True),
        ("# stagewire capture 9", True),
        ("# stagewire capture", False),
        ("53 04", False),
    ],
)
def test_recognising_a_capture_by_its_beginning(text: str, is_one: bool) -> None:
    assert is_capture(text) is is_one


@pytest.mark.parametrize("name", ["", "a b", "x\n", "a#"])
def test_a_heading_refuses_names_that_could_not_be_read(name: str) -> None:
    with pytest.raises(BadValueError, match="is not a valid name of a protocol or unit"):
        Heading(name)
    with pytest.raises(BadValueError):
        Heading("thorlabs_apt", name)


@pytest.mark.parametrize("direction", [Direction.BOTH, Direction(0)])
def test_bytes_need_exactly_one_direction(direction: Direction) -> None:
    writer = CaptureWriter(io.StringIO(), Heading("thorlabs_apt"))
    with pytest.raises(BadValueError, match="direction is TO_CONTROLLER or TO_HOST"):
        writer.write(0, direction, b"\x00")
