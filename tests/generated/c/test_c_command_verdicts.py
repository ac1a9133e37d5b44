"""Identifying commands and replies: the results of C compared with those of Python."""

from __future__ import annotations

from random import Random
from typing import Any

import pytest
from command_library import REFUSALS, CommandLibrary
from hypothesis import given, settings
from hypothesis import strategies as st

from stagewire.errors import CodecError
from stagewire.protocols import Command, Reply

INTERESTING = [0x00, 0x03, 0x18, 0x2E, 0x3A, 0x3F, 0x41, 0x47, 0x52, 0x54, 0x57, 0xFE, 0xFF]
a_byte = st.sampled_from(INTERESTING) | st.integers(0, 0xFF)
some_bytes = st.lists(a_byte, max_size=12).map(bytes)


def commands(library: CommandLibrary) -> list[type[Command]]:
    return [cls for cls in library.layouts() if issubclass(cls, Command)]


def named_by(library: CommandLibrary, raw: bytes) -> str | None:
    """Return the command that the first two bytes select, if any."""
    marks = library.protocol.marks
    if len(raw) < 2:
        return None
    if raw[0] == marks.prefix:
        return marks.setup.get(raw[1])
    request = library.protocol.rule.requests.get(raw[1])
    return request.name if request and raw[0] != marks.terminator else None


def verdict(library: CommandLibrary, raw: bytes) -> tuple[str, Any]:
    try:
        return "", library.protocol.decode(raw)
    except CodecError as error:
        return error.code, None


@st.composite
def nearly_commands(draw: st.DrawFn, library: CommandLibrary) -> bytes:
    """Draw a command that is complete or almost complete."""
    marks = library.protocol.marks
    if draw(st.integers(0, 9)) == 0:
        raw = bytes((marks.prefix, draw(st.sampled_from(sorted(marks.setup)) | a_byte)))
    else:
        layout = draw(st.sampled_from(commands(library))).layout
        content = bytes(draw(st.lists(a_byte, min_size=layout.length, max_size=layout.length)))
        slot = bytes((layout.size or 0,)) * draw(st.sampled_from((1, 1, 0)))
        raw = bytes((draw(a_byte), layout.id)) + slot + content + bytes((marks.terminator,))
    at = draw(st.integers(0, len(raw)))
    rest = at + draw(st.sampled_from((0, 0, 0, 1, 2)))
    return raw[:at] + draw(st.just(b"") | some_bytes) + raw[rest:]


@settings(max_examples=400, deadline=None)
@given(data=st.data())
def test_verdicts_equal_those_of_python(library: CommandLibrary, data: st.DataObject) -> None:
    raw = data.draw(nearly_commands(library) | some_bytes)
    check_verdicts(library, raw)


@pytest.mark.parametrize("size", [257, 258, 259, 260, 300])
def test_verdicts_of_long_commands(library: CommandLibrary, size: int) -> None:
    marks = library.protocol.marks
    for cls in commands(library):
        head = bytes((1, cls.layout.id, cls.layout.size or 0))
        for ends in ((), (size - 1,), (257,), (258,), (259,), (258, size - 1)):
            raw = bytearray(head.ljust(size, b"\1"))
            for end in ends:
                raw[end : end + 1] = bytes((marks.terminator,))
            check_verdicts(library, bytes(raw))


def test_verdicts_of_all_pairs_of_bytes_and_possible_continuations(library: CommandLibrary) -> None:
    marks = library.protocol.marks
    firsts = (0x01, marks.prefix, marks.terminator)
    ends = (b"", bytes((marks.terminator,)), bytes((0,)), bytes((0, marks.terminator)), b"\1\1")
    for first in firsts:
        check_verdicts(library, bytes((first,)))
        for second in range(0x100):
            for end in ends:
                check_verdicts(library, bytes((first, second)) + end)
    check_verdicts(library, b"")


def check_verdicts(library: CommandLibrary, raw: bytes) -> None:
    """Compare the verdicts of all commands with that of Python."""
    code, frame = verdict(library, raw)
    status, name = library.identify(raw)
    assert REFUSALS.get(status, "") == code
    assert name == (frame.message.layout.message if frame else None)
    named = named_by(library, raw)
    for cls in library.layouts():
        if issubclass(cls, Reply):
            continue
        its_own = named in (None, cls.layout.message)
        status, fields = library.decode(cls, raw)
        assert REFUSALS.get(status, "") == (code if its_own else "unknown_message")
        if not code and its_own:
            assert fields == frame.message.values()


def test_verdicts_of_replies(library: CommandLibrary) -> None:
    for cls in library.layouts():
        if issubclass(cls, Reply):
            for size in range(cls.layout.length + 3):
                raw = Random(size).randbytes(size)
                try:
                    wanted: Any = (
                        "",
                        library.protocol.decode_reply(raw, cls.layout.message).values(),
                    )
                except CodecError as error:
                    wanted = (error.code, None)
                status, fields = library.decode(cls, raw)
                assert (REFUSALS.get(status, ""), fields) == wanted
