"""The framing rule of commands, rule by rule, and properties that hold for any bytes."""

from __future__ import annotations

from itertools import combinations, pairwise
from random import Random

import framing_references as references
import pytest
from framing_references import Piece, command_reference
from hypothesis import given
from hypothesis import strategies as st
from invented_commands import (
    PROTOCOL,
    ReadCount,
    Restart,
    Standby,
    Stop,
    WriteCount,
    WriteLimits,
    WritePage,
    WriteSpare,
)

from stagewire.framing import (
    BadCommandLength,
    CommandReceived,
    Event,
    Garbage,
    UnknownCommand,
    join_garbage,
)
from stagewire.protocols import CommandFrame

LONGEST = 3 + 255 + 1
REFERENCE = command_reference(
    prefix=0x1B,
    terminator=0x0D,
    setup={0x51, 0x57, 0x1B},
    commands={
        0x63: (0, 3), 0x3F: (0, 0), 0x6E: (0, 6), 0x74: (0, 1), 0x53: (0, 0),
        0x57: (3, 3), 0x4C: (5, 5), 0x49: (8, 8), 0x50: (255, 255), 0x73: (1, 1),
    },
)  # fmt: skip


def b(text: str) -> bytes:
    return bytes.fromhex(text)


MOVE = b("21 57 03 A0 86 01 0D")
READ = b("21 63 03 0D")
STATE = b("21 3F 0D")
RESTART = b("1B 51")


def received(raw: bytes) -> Event:
    return CommandReceived(raw, PROTOCOL.decode)


def frame(stream: bytes) -> list[Event]:
    """Frame a stream and check that no byte was lost."""
    framer = PROTOCOL.framer()
    events = framer.feed(stream)
    assert b"".join(event.raw for event in events) + framer.pending == stream
    return events


def pieces(stream: bytes, sizes: list[int] | None = None) -> list[Piece]:
    """Frame a stream in chunks of the given sizes; return the events as the reference describes them."""
    chunks, position = [], 0
    for size in sizes or [len(stream)]:
        chunks.append(stream[position : position + size])
        position += size
    return references.pieces(PROTOCOL.framer(), chunks, LONGEST)


# 1. The beginning of a command


def test_commands_are_returned_one_by_one() -> None:
    assert frame(MOVE + READ + STATE) == [received(MOVE), received(READ), received(STATE)]


def test_a_received_command_is_decoded_on_demand() -> None:
    (event,) = frame(MOVE)
    assert isinstance(event, CommandReceived)
    assert event.frame == CommandFrame(WriteCount(100_000), 0x21)


def test_a_setup_command_is_two_bytes_without_a_terminator() -> None:
    standby, escape = b("1B 57"), b("1B 1B")
    assert frame(RESTART + standby + escape + MOVE) == [
        received(RESTART), received(standby), received(escape), received(MOVE)
    ]  # fmt: skip
    (event,) = frame(standby)
    assert isinstance(event, CommandReceived)
    assert event.frame == CommandFrame(Standby())


def test_setup_and_command_may_share_a_byte() -> None:
    assert frame(b("1B 57") + MOVE) == [received(b("1B 57")), received(MOVE)]
    assert frame(b("57 57 03 01 02 03 0D")) == [received(b("57 57 03 01 02 03 0D"))]


def test_the_prefix_and_another_byte_is_garbage_up_to_a_terminator() -> None:
    assert frame(b("1B 63 03 51 0D") + MOVE) == [Garbage(b("1B 63 03 51 0D")), received(MOVE)]
    assert frame(b("1B 0D") + MOVE) == [Garbage(b("1B 0D")), received(MOVE)]


def test_a_terminator_alone_is_garbage() -> None:
    assert frame(b("0D") + MOVE + b("0D 0D")) == [
        Garbage(b("0D")),
        received(MOVE),
        Garbage(b("0D 0D")),
    ]


@pytest.mark.parametrize("axis", [0x00, 0x01, 0x51, 0x57, 0x63, 0xFF])
def test_any_other_byte_is_an_axis(axis: int) -> None:
    command = bytes((axis,)) + MOVE[1:]
    assert frame(command) == [received(command)]


# 2. The command byte


def test_a_terminator_as_command_byte_aborts() -> None:
    assert frame(b("21 0D") + MOVE) == [Garbage(b("21 0D")), received(MOVE)]


def test_another_byte_is_an_unknown_command_up_to_a_terminator() -> None:
    for unknown in (b("21 99 0D"), b("21 99 03 01 02 0D"), b("21 1B 51 0D"), b("21 51 0D")):
        assert frame(unknown + MOVE) == [UnknownCommand(unknown), received(MOVE)]


# 3. The size slot


@pytest.mark.parametrize("command", ["21 63 0D", "21 3F 0D", "21 53 0D", "21 6E 0D", "21 74 0D"])
def test_a_command_without_data_may_omit_its_size(command: str) -> None:
    raw = b(command)
    assert frame(raw + MOVE) == [received(raw), received(MOVE)]


@pytest.mark.parametrize("command", ["21 63 03 0D", "21 3F 00 0D", "21 53 00 0D", "21 6E 06 0D"])
def test_a_command_without_data_may_send_its_size(command: str) -> None:
    raw = b(command)
    assert frame(raw + MOVE) == [received(raw), received(MOVE)]


def test_a_command_with_data_cannot_omit_its_size() -> None:
    assert frame(b("21 57 0D") + MOVE) == [BadCommandLength(b("21 57 0D")), received(MOVE)]


@pytest.mark.parametrize(
    "command",
    ["21 63 04 0D", "21 3F 01 0D", "21 53 03 01 02 03 0D", "21 57 02 01 02 0D", "21 57 04 0D"],
)
def test_another_number_is_a_bad_length_up_to_a_terminator(command: str) -> None:
    raw = b(command)
    assert frame(raw + MOVE) == [BadCommandLength(raw), received(MOVE)]


# 4. The data


@pytest.mark.parametrize("data", ["0D 0D 0D", "0D 00 00", "00 00 0D", "1B 51 0D", "21 57 03"])
def test_a_terminator_in_the_data_is_data(data: str) -> None:
    raw = b(f"21 57 03 {data} 0D")
    assert frame(raw + MOVE) == [received(raw), received(MOVE)]


# 5. Ignored bytes


def test_bytes_after_the_data_are_kept_as_extra() -> None:
    raw = MOVE[:-1] + b("01 02 1B 51 0D")
    (event,) = frame(raw)
    assert isinstance(event, CommandReceived)
    assert event.frame == CommandFrame(WriteCount(100_000), 0x21, b("01 02 1B 51"))


def test_a_lost_byte_makes_the_next_command_part_of_the_previous() -> None:
    lost = b("21 57 03 A0 86 0D 21 3F 0D")
    (event,) = frame(lost)
    assert isinstance(event, CommandReceived)
    assert event.frame == CommandFrame(WriteCount(0x0D86A0), 0x21, b("21 3F"))


# 6. Bounds


def test_the_longest_command_is_a_command() -> None:
    for message, extra in ((Stop(), 255), (WriteCount(1), 252), (WriteLimits("a", 1, 2), 250)):
        raw = CommandFrame(message, 0x21, bytes(extra)).encode()
        assert len(raw) == LONGEST
        assert frame(raw + MOVE) == [received(raw), received(MOVE)]
    raw = WritePage(b"\x0d" * 255).pack(0x21)
    assert frame(raw + MOVE) == [received(raw), received(MOVE)]


@pytest.mark.parametrize(
    "begins", ["21 63 03", "21 57 03 0D 0D 0D", "21 99", "21 57 07", "21 50 FE"]
)
def test_a_longer_command_is_garbage_up_to_a_terminator(begins: str) -> None:
    head = b(begins)
    longest = head + bytes(LONGEST - 1 - len(head))
    kind = type(frame(longest + b"\x0d" + MOVE)[0])
    assert kind is not Garbage
    for more in (1, 2, 1000):
        raw = longest + bytes(more) + b"\x0d"
        assert frame(raw + MOVE) == [Garbage(raw), received(MOVE)]


def test_garbage_is_returned_at_the_end_of_each_feed() -> None:
    framer = PROTOCOL.framer()
    assert framer.feed(b("1B 99 01")) == [Garbage(b("1B 99 01"))]
    assert framer.feed(b("02 03")) == [Garbage(b("02 03"))]
    assert framer.pending == b""
    assert framer.feed(b("04 0D") + MOVE) == [Garbage(b("04 0D")), received(MOVE)]
    unknown = b("21 99") + bytes(LONGEST)
    assert framer.feed(unknown) == [Garbage(unknown)]
    assert framer.feed(b("0D") + MOVE) == [Garbage(b("0D")), received(MOVE)]


@pytest.mark.parametrize("flood", ["21 63 03", "00", "1B 99", "21 50 FF", "21 99", "21", "1B 51"])
@pytest.mark.parametrize("size", [1, 100, 4096, 1 << 20])
def test_a_flood_without_a_terminator_leaves_little_pending(flood: str, size: int) -> None:
    data = b(flood) * (20_000 // len(b(flood)))
    framer = PROTOCOL.framer()
    for start in range(0, len(data), size):
        framer.feed(data[start : start + size])
        assert len(framer.pending) < LONGEST


# The framer itself


def test_reset_discards_pending_bytes() -> None:
    for begun in (MOVE[:4], b("1B 99"), b("21 99") + bytes(300)):
        framer = PROTOCOL.framer()
        framer.feed(begun)
        framer.reset()
        assert framer.pending == b""
        assert framer.feed(MOVE) == [received(MOVE)]


def test_feeding_text_raises() -> None:
    with pytest.raises(TypeError, match="a framer takes bytes, not str"):
        PROTOCOL.framer().feed("21")  # type: ignore[arg-type]


def test_all_types_of_bytes_are_accepted_and_copied() -> None:
    for data in (bytearray(MOVE), memoryview(MOVE), memoryview(bytearray(MOVE))):
        framer = PROTOCOL.framer()
        assert framer.feed(data[:4]) == []
        events = framer.feed(data[4:])
        assert events == [received(MOVE)]
        assert type(events[0].raw) is bytes


def test_events_are_equal_only_to_their_own_kind() -> None:
    assert received(MOVE) != UnknownCommand(MOVE) != BadCommandLength(MOVE)
    assert len({received(MOVE), received(MOVE), Garbage(MOVE)}) == 2
    assert repr(received(READ)) == "CommandReceived('21 63 03 0d')"


# Every split


@pytest.mark.parametrize(
    "message", [WriteCount(0x0D0D), ReadCount(), Stop(), WriteLimits("\r", 13, 13), WriteSpare(13)]
)
def test_every_split_gives_the_same_events(message: WriteCount) -> None:
    raw = CommandFrame(message, 0x21).encode(allow_dummy=True)
    stream = RESTART + raw + raw
    expected = pieces(stream)
    assert [kind for kind, _ in expected] == ["message"] * 3
    for cuts in (1, 2, 3):
        for places in combinations(range(1, len(stream)), cuts):
            edges = [0, *places, len(stream)]
            assert pieces(stream, [j - i for i, j in pairwise(edges)]) == expected
    assert pieces(stream, [1] * len(stream)) == expected


# For any bytes, against the reference

WHOLE = [
    MOVE, READ, STATE, RESTART, b("1B 57"), b("1B 1B"), b("21 57 03 0D 0D 0D 0D"), b("21 63 0D"),
    WriteLimits("\x1b\r", 13, 13).pack(0x21), WritePage(bytes(range(255))).pack(0x21),
    b("21 3F 00 0D"), b("21 99 0D"), b("21 63 05 0D"), b("0D"), b("21 0D"), b("1B 41 0D"),
]  # fmt: skip
STREAMS = st.lists(
    st.one_of(
        st.sampled_from(WHOLE),
        st.sampled_from([0x0D, 0x1B, 0x21, 0x57, 0x63, 0x50, 0x03, 0x00]).map(
            lambda i: bytes((i,))
        ),
        st.binary(max_size=12),
        st.integers(0, 280).map(bytes),
    ),
    max_size=15,
).map(b"".join)


@given(STREAMS, st.lists(st.integers(1, 90), max_size=20))
def test_the_framer_agrees_with_the_reference(stream: bytes, sizes: list[int]) -> None:
    expected = REFERENCE.read(stream)
    assert pieces(stream) == expected
    assert pieces(stream, [*sizes, len(stream) + 1]) == expected
    assert pieces(stream, [1] * len(stream)) == expected


def test_thousands_of_damaged_streams() -> None:
    rng = Random(1)
    for _ in range(3000):
        stream = bytearray(b"".join(rng.choices(WHOLE, k=rng.randrange(1, 8))))
        for _ in range(rng.randrange(4)):
            at = rng.randrange(len(stream) + 1)
            stream[at : at + rng.choice((0, 1, 1, 2))] = rng.randbytes(rng.choice((0, 0, 1, 2)))
        data = bytes(stream)
        expected = REFERENCE.read(data)
        assert pieces(data) == expected
        cut = rng.randrange(len(data) + 1)
        assert pieces(data, [cut, len(data)]) == expected


@given(STREAMS)
def test_a_feed_has_no_adjacent_garbage_and_no_empty_event(stream: bytes) -> None:
    events = frame(stream)
    assert join_garbage(events) == events
    assert all(event.raw for event in events)


@given(STREAMS)
def test_only_received_commands_decode(stream: bytes) -> None:
    for event in frame(stream):
        if isinstance(event, CommandReceived):
            assert event.frame.encode(allow_dummy=True) == event.raw
            assert event.frame == PROTOCOL.decode(event.raw)


def test_a_setup_command_inside_garbage_is_ignored() -> None:
    assert frame(b("1B 99") + RESTART + b("0D") + RESTART) == [
        Garbage(b("1B 99") + RESTART + b("0D")),
        received(RESTART),
    ]
    assert frame(RESTART)[0].frame == CommandFrame(Restart())  # type: ignore[attr-defined]
