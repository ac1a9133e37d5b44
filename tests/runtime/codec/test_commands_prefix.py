"""Values that look like a setup command: when they are refused, and the safe values suggested instead."""

from __future__ import annotations

import re
from itertools import pairwise

import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from invented_commands import (
    PREFIX,
    PROTOCOL,
    TERMINATOR,
    Restart,
    WriteCount,
    WriteLimits,
    WritePage,
    WriteWide,
    layout,
)

from stagewire.errors import OutOfRangeError
from stagewire.protocols import Command, CommandFrame, CommandProtocol, SetupCommand

SETUP = (0x51, 0x57, 0x1B)
LOWEST, HIGHEST = -8_000_000, 8_000_000


def refusal(message: Command, extra: bytes = b"") -> str | None:
    frame = CommandFrame(message, 0x21, extra)
    raw = frame.encode(allow_dummy=True)
    try:
        assert frame.encode(allow_dummy=True, refuse_prefix_bytes=True) == raw
    except OutOfRangeError as error:
        return str(error)
    return None


def offered(text: str) -> list[int]:
    return [int(number) for number in re.findall(r"-?\d+", text.rpartition("nearest safe")[2])]


def unsafe(value: int, size: int = 3) -> bool:
    data = value.to_bytes(size, "little", signed=value < 0)
    return any(first == PREFIX and second in SETUP for first, second in pairwise(data))


def nearest(value: int) -> list[int]:
    """Return the nearest safe values, found by trying them one by one."""
    found = []
    for step in (-1, 1):
        tried = value + step
        while LOWEST <= tried <= HIGHEST and unsafe(tried):
            tried += step
        if LOWEST <= tried <= HIGHEST:
            found.append(tried)
    return found


def test_the_check_is_off_by_default() -> None:
    assert CommandFrame(WriteCount(0x511B), 0x21).encode() == b"\x21\x57\x03\x1b\x51\x00\x0d"


def test_the_error_states_the_reason_and_the_safe_values() -> None:
    assert refusal(WriteCount(0x511B)) == (
        "WRITE_COUNT.count 20763 is not sent: bytes 3 and 4 of the command would be 1b 51, which a "
        "controller may take for RESTART; the nearest safe values are 20762 and 20764"
    )
    assert refusal(WriteCount(0x571B00)) == (
        "WRITE_COUNT.count 5708544 is not sent: bytes 4 and 5 of the command would be 1b 57, which "
        "a controller may take for STANDBY; the nearest safe values are 5708543 and 5708800"
    )


@pytest.mark.parametrize(
    "count", [0, -1, 0x1B, 0x511A, 0x521B, 0x1B51, 0x51001B, 0x0D1B, -8_000_000]
)
def test_safe_values_are_sent(count: int) -> None:
    assert refusal(WriteCount(count)) is None


def test_setup_commands_themselves_are_sent() -> None:
    assert CommandFrame(Restart()).encode(refuse_prefix_bytes=True) == b"\x1b\x51"


UPPER = st.tuples(st.sampled_from((PREFIX, *SETUP, 0x00, 0xFF)), st.sampled_from((PREFIX, *SETUP)),
                  st.sampled_from((PREFIX, *SETUP))).map(
    lambda data: int.from_bytes(bytes(data), "little", signed=True)
)  # fmt: skip


@given(UPPER)
@example(0x1B1B1B)
@example(0x511B1B)
@example(0x571B00)
@example(0x571BFF)
@example(0x1B1BFF)
def test_the_suggested_values_are_the_nearest(count: int) -> None:
    text = refusal(WriteCount(count))
    if not unsafe(count):
        assert text is None
        return
    assert text is not None
    assert offered(text) == nearest(count)
    assert all(refusal(WriteCount(safe)) is None for safe in offered(text))


def test_a_decoded_value_far_out_of_range_has_no_safe_neighbour() -> None:
    text = refusal(WriteCount.keep({"count": 0x7F511B}))
    assert text is not None
    assert "no value nearby avoids it" in text


def test_a_range_that_ends_within_unsafe_values_has_one_suggestion() -> None:
    class Narrow(WriteCount):
        __slots__ = ()
        layout = WriteCount.layout

        def __new__(cls, count: int) -> Narrow:
            if not 0x511B00 <= count <= 0x511C00:
                raise OutOfRangeError("beyond")
            return cls.keep({"count": count})

    text = refusal(Narrow(0x511B80))
    assert text is not None
    assert text.endswith("the nearest safe value is 5315584")


def test_billions_of_unsafe_values_are_skipped() -> None:
    text = refusal(WriteWide(0x571B << 48 | 5))
    assert text is not None
    assert offered(text) == [(0x571B << 48) - 1, 0x571C << 48]


def test_a_doubled_prefix_that_is_a_setup_command() -> None:
    class Value(WriteWide):
        __slots__ = ()
        layout = WriteWide.layout

    class Again(SetupCommand):
        __slots__ = ()
        layout = layout("AGAIN", 0xFF, "request", (), 0, kind="setup")

    CommandProtocol("doubled", "Doubled", "doubled", (Value, Again), 0xFF, TERMINATOR, {})
    text = refusal(Value(0x04FFFFFE))
    assert text is not None
    assert offered(text) == [0x04FFFEFF, 0x05000000]


def test_the_error_names_the_unsafe_field() -> None:
    low = WriteLimits("ab", PREFIX, 0x0051)
    text = refusal(low)
    assert text is not None
    assert text.startswith("WRITE_LIMITS.low 27 is not sent")
    assert offered(text) == [26, 28]
    high = WriteLimits("ab", 0, 0x571B)
    text = refusal(high)
    assert text is not None
    assert text.startswith("WRITE_LIMITS.high 22299 is not sent")
    assert offered(text) == [22298, 22300]


def test_a_value_and_the_extra_bytes_may_form_a_setup_command() -> None:
    text = refusal(WriteCount(0x1B0000), b"\x51")
    assert text is not None
    assert offered(text) == [0x1AFFFF, 0x1C0000]


def test_an_unsafe_value_that_is_not_a_number_has_no_suggestion() -> None:
    for message, extra in (
        (WriteLimits("\x1bW", 1, 2), b""),
        (WritePage(b"\x1b\x51" + bytes(253)), b""),
        (WriteCount(5), b"\x1b\x51"),
    ):
        text = refusal(message, extra)
        assert text is not None
        assert "no value nearby avoids it" in text


def test_two_unsafe_fields_have_no_suggestion() -> None:
    text = refusal(WriteLimits("\x1b\x51", PREFIX, 0x0051))
    assert text is not None
    assert "no value nearby avoids it" in text


@given(st.lists(st.sampled_from((PREFIX, *SETUP, 0x00, 0xFF)), min_size=8, max_size=8).map(bytes))
def test_no_sent_value_contains_a_setup_command(data: bytes) -> None:
    message = WriteWide(int.from_bytes(data, "little"))
    assert (refusal(message) is not None) == unsafe(message.value, 8)


def test_the_marks_of_the_protocol_are_used() -> None:
    assert (PROTOCOL.marks.prefix, PROTOCOL.marks.terminator) == (0x1B, 0x0D)
    assert set(PROTOCOL.marks.setup) == set(SETUP)
