"""A listener on a line with both formats: what the host sends, and the replies."""

from __future__ import annotations

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st
from invented_commands import PROTOCOL as INVENTED
from invented_commands import layout

from stagewire._framings.slots.streams import LONGEST_LINE, FormatFramer
from stagewire.framing import (
    CommandFramer,
    CommandReceived,
    Event,
    Garbage,
    HostListener,
    ReplyListener,
    ReplyReceived,
    TextReceived,
    host_framer,
    join_garbage,
)
from stagewire.protocols import Command, CommandProtocol, SetupCommand
from stagewire_ms2000 import PROTOCOL

HIGH, LOW, RESET, HUNDREDTHS = b"\xffA", b"\xffB", b"\xffR", b"\xffH"
ASK, STATUS = b"\x18a\x03:", b"\x18?:"
SWITCH_IN_DATA = b"\x18T\x03\xffA\x00:"
"""A move whose data look like SWITCH_TO_HIGH_LEVEL."""


def kinds(events: list[Event]) -> str:
    """Return the kinds of events as letters: Text, Command, Garbage, other."""
    letters = {TextReceived: "T", CommandReceived: "C", Garbage: "G"}
    return "".join(letters.get(type(event), "?") for event in events)


@pytest.mark.parametrize(
    ("sent", "found"),
    [
        ([b"W X\r", b"/\r"], "TT"),
        ([b"W X\r", b"\n", b"/\r", b"\r"], "TTTT"),
        ([b"W X\r", LOW, ASK], "TCC"),
        ([b"W ", LOW, ASK], "GCC"),  # an interrupted line
        ([ASK, STATUS], "CC"),  # not text, although nothing switched
        ([ASK, b"W X\r"], "C"),  # later bytes are not text either
        ([b"a", b"\x03:", ASK], "GGC"),  # a recording that begins inside a command
        ([b":", ASK], "GC"),
        ([HUNDREDTHS, b"W X\r"], "CT"),  # does not switch
        ([LOW, b"Xa\x03:", HIGH, b"W X\r"], "CCCT"),  # an axis by a letter
        ([LOW, SWITCH_IN_DATA, ASK], "CCC"),
        ([HIGH, b"\x18a\r", LOW, ASK], "CTCC"),  # high level, so these bytes are text
        ([LOW, RESET, b"W X\r"], "CCT"),
        ([LOW, RESET, ASK], "CCC"),
        ([HIGH, RESET, ASK], "CCC"),
        ([HIGH, b"\xff\r", b"\xff\xff\r"], "CTT"),  # the prefix without a setup command
        ([b"\xff\x18:", ASK], "GC"),
        ([LOW, HIGH, LOW, HIGH, b"W\r"], "CCCCT"),
        ([b"x" * (LONGEST_LINE - 1) + b"\r", b"/\r"], "TT"),
        ([b"x" * LONGEST_LINE + b"\r", b"/\r"], "GT"),
        ([b"x" * LONGEST_LINE, LOW, ASK], "GCC"),
    ],
)
@pytest.mark.parametrize("size", [1, 2, 3, 1 << 20])
def test_text_and_commands_are_distinguished(sent: list[bytes], found: str, size: int) -> None:
    framer = FormatFramer(PROTOCOL)
    data = b"".join(sent)
    events: list[Event] = []
    for at in range(0, len(data), size):
        events += framer.feed(data[at : at + size])
    events = join_garbage(events)
    assert kinds(events) == kinds(join_garbage([_like(kind, b"") for kind in found]))
    assert b"".join(event.raw for event in events) + framer.pending == data
    whole = [event.raw for event in events if type(event) is not Garbage]
    assert whole == [part for part, kind in zip(sent, found, strict=False) if kind != "G"]


def _like(kind: str, raw: bytes) -> Event:
    if kind == "C":
        return CommandReceived(raw, PROTOCOL.decode)
    return TextReceived(raw) if kind == "T" else Garbage(raw)


PIECES = [HIGH, LOW, RESET, HUNDREDTHS, ASK, STATUS, SWITCH_IN_DATA, b"W X\r", b"\xff", b"\n", b":"]


@given(
    parts=st.lists(st.sampled_from(PIECES) | st.binary(max_size=8), max_size=20),
    cuts=st.lists(st.integers(0, 160), max_size=12),
)
def test_chunking_does_not_matter(parts: list[bytes], cuts: list[int]) -> None:
    data = b"".join(parts)
    whole, chunked = FormatFramer(PROTOCOL), FormatFramer(PROTOCOL)
    events: list[Event] = []
    for start, end in pairwise([0, *sorted(min(cut, len(data)) for cut in cuts), len(data)]):
        events += chunked.feed(data[start:end])
    assert join_garbage(events) == join_garbage(whole.feed(data))
    assert chunked.pending == whole.pending
    assert b"".join(event.raw for event in events) + chunked.pending == data


@given(st.lists(st.sampled_from(PIECES) | st.binary(max_size=8), max_size=20))
def test_low_level_is_cut_like_the_command_framer_cuts(parts: list[bytes]) -> None:
    data = b"".join(parts).replace(b"A", b"a").replace(b"R", b"r")  # nothing switches back
    both, commands = FormatFramer(PROTOCOL), PROTOCOL.framer()
    assert join_garbage(both.feed(LOW + data)) == join_garbage(commands.feed(LOW + data))
    assert both.pending == commands.pending


@pytest.mark.parametrize("mode", [b"", HIGH, LOW])
def test_memory_is_bounded(mode: bytes) -> None:
    framer = FormatFramer(PROTOCOL)
    framer.feed(mode)
    for _ in range(50):
        framer.feed(b"x" * 1000 + b"\xff")
        assert len(framer.pending) <= LONGEST_LINE


def test_a_protocol_without_text_has_only_commands() -> None:
    assert isinstance(host_framer(INVENTED), CommandFramer)
    assert isinstance(host_framer(PROTOCOL), FormatFramer)


class Ask(Command):
    __slots__ = ()
    layout = layout("ASK", 0x61, "request", (), 0, size=None)


class Chat(SetupCommand):
    __slots__ = ()
    layout = layout("CHAT", 0x61, "request", (), 0, kind="setup", switches_to="high_level")


class Obey(SetupCommand):
    __slots__ = ()
    layout = layout("OBEY", 0x62, "request", (), 0, kind="setup", switches_to="low_level")


class Start(SetupCommand):
    __slots__ = ()
    layout = layout("START", 0x63, "request", (), 0, kind="setup", switches_to="power_on")


class Blink(SetupCommand):
    __slots__ = ()
    layout = layout("BLINK", 0x64, "request", (), 0, kind="setup")


SWITCHING = CommandProtocol(
    "switching",
    title="Commands and text",
    package="switching",
    messages=(Ask, Chat, Obey, Start, Blink),
    prefix=0x01,
    terminator=0x3B,
    axes={},
)


@pytest.mark.parametrize(
    ("sent", "found"),
    [
        ([b"\x01a", b"2a;\r", b"\x01d", b"\x02\r"], "CTCT"),
        ([b"\x01b", b"2a;", b"\x01d", b"2a;"], "CCCC"),
        ([b"\x01c", b"2a;\r", b"\x01d", b"\x02a;", b"2a;"], "CTCCC"),
    ],
)
def test_the_layout_determines_what_switches_not_the_name(sent: list[bytes], found: str) -> None:
    events = host_framer(SWITCHING).feed(b"".join(sent))
    assert [event.raw for event in events] == sent
    assert kinds(events) == found


# Replies


def heard(*turns: tuple[bytes, bytes]) -> list[list[bytes | str]]:
    """Return the replies of each turn: the command name, text as its bytes, garbage in hex."""
    replies = ReplyListener()
    asking = HostListener(PROTOCOL, replies)
    found: list[list[bytes | str]] = []
    for sent, said in turns:
        asking.feed(sent)
        found.append([_words(event) for event in replies.feed(said)])
    return found


def _words(event: Event) -> bytes | str:
    if isinstance(event, ReplyReceived):
        return event.request.message.layout.message
    return event.raw if isinstance(event, TextReceived) else f"garbage {event.raw.hex()}"


@pytest.mark.parametrize(
    ("turns", "found"),
    [
        ([(b"W X\r/\r", b":A 0\r\nN\r\n")], [[b":A 0\r\n", b"N\r\n"]]),
        ([(b"INFO X\r", b"one\r\ntwo\r\n")], [[b"one\r\n", b"two\r\n"]]),  # several lines
        (
            [(b"/\r" + LOW + ASK, b"N\r\n\r\nN")],
            [[b"N\r\n", "READ_MOTOR_POSITION"]],
        ),
        ([(b"/\r", b"N"), (LOW + STATUS, b"b")], [[], ["garbage 4e", "READ_STATUS"]]),
        ([(b"\r\n", b"N\r\n")], [["garbage 4e0d0a"]]),  # an empty line is not a request
        ([(b"/\r", b"x" * LONGEST_LINE)], [["garbage " + "78" * LONGEST_LINE]]),
    ],
)
def test_lines_answer_text(
    turns: list[tuple[bytes, bytes]], found: list[list[bytes | str]]
) -> None:
    assert heard(*turns) == found


def test_requests_of_the_same_turn_give_nothing_up() -> None:
    replies = ReplyListener()
    asking = HostListener(PROTOCOL, replies)
    asking.feed(LOW + ASK)
    asking.feed(STATUS, goes_on=True)
    assert [_words(event) for event in replies.feed(b"\x01\x02\x03b")] == [
        "READ_MOTOR_POSITION",
        "READ_STATUS",
    ]
