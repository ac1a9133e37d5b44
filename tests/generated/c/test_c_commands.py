"""Commands and replies in C compared with Python: bytes, results, forms, tables."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from command_library import REFUSALS, CommandLibrary, make_library
from hypothesis import given, settings
from hypothesis import strategies as st

from stagewire.errors import CodecError, OutOfRangeError
from stagewire.protocols import Command, CommandFrame, Message, Reply, SetupCommand

CASES = settings(max_examples=400, deadline=None)
INTERESTING = [0x00, 0x03, 0x18, 0x2E, 0x3A, 0x3F, 0x41, 0x47, 0x52, 0x54, 0x57, 0xFE, 0xFF]
a_byte = st.sampled_from(INTERESTING) | st.integers(0, 0xFF)


def commands(library: CommandLibrary) -> list[type[Command]]:
    return [cls for cls in library.layouts() if issubclass(cls, Command)]


def holds(field: Any) -> range:
    """Return the range of an integer member of a struct."""
    bits = max(8, 1 << (8 * field["size"] - 1).bit_length())
    return range(-(1 << bits - 1), 1 << bits - 1) if field["signed"] else range(1 << bits)


def integers(field: Any) -> st.SearchStrategy[int]:
    """Return integers in and out of range."""
    held = holds(field)
    edges = [edge + by for edge in (field["minimum"], field["maximum"]) for by in (-1, 0, 1)]
    fitting = [edge for edge in edges if edge in held]
    return st.sampled_from(fitting) | st.integers(held[0], held[-1])


def values(field: Any) -> st.SearchStrategy[Any]:
    if field["kind"] == "bytes":
        return st.binary(min_size=field["size"], max_size=field["size"])
    if field["kind"] == "text":
        raw = st.binary(max_size=field["size"])
        return raw.map(lambda it: it.rstrip(b"\0").decode("latin-1"))
    return integers(field)


def message_of(data: st.DataObject, library: CommandLibrary, cls: type[Message]) -> Message:
    """Draw a message as if it had been decoded: its values may be out of range."""
    fields = library.fields(cls)
    return cls.keep({field["name"]: data.draw(values(field)) for field in fields})


def python_bytes(message: Any, axis: int, **options: bool) -> tuple[str, bytes]:
    """Return the error code and the bytes of a message in Python."""
    try:
        checked = type(message)(**message.values())
        if isinstance(checked, Reply):
            return "", checked.pack()
        frame = CommandFrame(checked, axis if isinstance(checked, Command) else None)
        return "", frame.encode(**options)
    except CodecError as error:
        return error.code, b""


# Declarations


def test_numbers_equal_those_of_the_registry(library: CommandLibrary) -> None:
    for cls in library.layouts():
        layout = cls.layout
        if issubclass(cls, Command):
            assert library.macro(cls, "ID") == layout.id
            assert library.macro(cls, "SIZE_SLOT") == (layout.size or 0)
        if not issubclass(cls, SetupCommand):
            assert library.macro(cls, "LENGTH") == layout.length
        sized = 1 if layout.size is not None else 0
        whole = 2 if issubclass(cls, SetupCommand) else layout.length
        whole = 3 + sized + layout.length if issubclass(cls, Command) else whole
        assert library.macro(cls, "SIZE") == whole


def test_the_table_lists_every_command_with_its_name(library: CommandLibrary) -> None:
    found = {}
    for pointer in library.table():
        name, entry = library.name(pointer), pointer.contents
        found[name] = (entry.kind, entry.id, entry.size_slot, entry.length, entry.reply_length)
    wanted = {}
    for cls in library.layouts():
        if not issubclass(cls, Reply):
            layout = cls.layout
            reply = cls.reply.layout.length if cls.reply else 0
            kind = int(issubclass(cls, SetupCommand))
            wanted[layout.message] = (kind, layout.id, layout.size or 0, layout.length, reply)
    assert found == wanted


def test_an_entry_is_found_by_the_first_two_bytes(library: CommandLibrary) -> None:
    marks, rule = library.protocol.marks, library.protocol.rule
    for byte in range(0x100):
        for first in (0x01, marks.prefix):
            names = marks.setup if first == marks.prefix else None
            request = rule.requests.get(byte)
            wanted = names.get(byte) if names is not None else request and request.name
            entry = library.find(bytes((first, byte)))
            assert (library.name(entry) if entry else None) == wanted


# Encoding


@CASES
@given(data=st.data())
def test_bytes_equal_those_of_python(library: CommandLibrary, data: st.DataObject) -> None:
    cls = data.draw(st.sampled_from(list(library.layouts())))
    message, axis = message_of(data, library, cls), data.draw(a_byte)
    status, raw = library.encode(message, axis)
    assert (REFUSALS.get(status, ""), raw) == python_bytes(message, axis)


def test_limits_are_encoded_and_decoded(library: CommandLibrary) -> None:
    axis = next(iter(library.protocol.axes.values()))
    for cls in library.layouts():
        for bound in ("minimum", "maximum"):
            made = cls.keep({f["name"]: bounded(f, bound) for f in library.fields(cls)})
            code, wanted = python_bytes(made, axis, **allowing(cls))
            assert code == ""
            status, raw = library.encode(made, axis, checked=not cls.layout.dummy)
            assert (status, raw) == ("OK", wanted)
            assert library.decode(cls, raw) == ("OK", made.values())


def test_values_just_out_of_range_are_errors(library: CommandLibrary) -> None:
    """Unless the type in C cannot hold them."""
    refused = 0
    for cls in library.layouts():
        plain = {f["name"]: bounded(f, "minimum") for f in library.fields(cls)}
        for field in library.fields(cls):
            if field["kind"] == "integer":
                for edge in (field["minimum"] - 1, field["maximum"] + 1):
                    if edge in holds(field):
                        made = cls.keep({**plain, field["name"]: edge})
                        assert library.encode(made, 1) == ("OUT_OF_RANGE", b"")
                        refused += 1
    assert refused >= 4


def bounded(field: Any, bound: str) -> Any:
    if field["kind"] == "bytes":
        return bytes(field["size"]) if bound == "minimum" else b"\xff" * field["size"]
    if field["kind"] == "text":
        return "" if bound == "minimum" else "\xff" * field["size"]
    return field[bound]


def allowing(cls: type[Message]) -> dict[str, bool]:
    return {"allow_dummy": True} if cls.layout.dummy else {}


def test_a_small_buffer_is_an_error(library: CommandLibrary) -> None:
    for cls in library.layouts():
        made = cls.keep({f["name"]: bounded(f, "maximum") for f in library.fields(cls)})
        status, raw = library.encode(made, 1, checked=False)
        assert status == "OK"
        for cap in range(len(raw)):
            for checked in (False, True):
                if not (checked and cls.layout.dummy):
                    assert library.encode(made, 1, checked=checked, cap=cap) == ("NO_SPACE", b"")
        assert library.encode(made, 1, checked=False, cap=len(raw)) == ("OK", raw)


@CASES
@given(data=st.data())
def test_decoded_messages_are_encoded_unchecked(
    library: CommandLibrary, data: st.DataObject
) -> None:
    """For all values and all axes."""
    cls = data.draw(st.sampled_from([cls for cls in library.layouts() if cls.layout.fields]))
    content = bytes(data.draw(st.lists(a_byte, min_size=(n := cls.layout.length), max_size=n)))
    axis = data.draw(st.sampled_from(sorted(library.protocol.marks.axis_bytes)))
    raw = content
    if issubclass(cls, Command):
        head = bytes((axis, cls.layout.id, cls.layout.size or 0))
        raw = head + content + bytes((library.protocol.marks.terminator,))
    status, fields = library.decode(cls, raw)
    assert (status, fields) == ("OK", python_values(library, cls, raw))
    assert library.encode(cls.keep(fields), axis, checked=False) == ("OK", raw)


def python_values(library: CommandLibrary, cls: type[Message], raw: bytes) -> dict[str, Any]:
    if issubclass(cls, Reply):
        return cls.unpack(raw).values()
    message = library.protocol.decode(raw).message
    assert type(message) is cls
    return message.values()


@pytest.mark.parametrize("flag", ["NO_RANGE_CHECKS", "ALLOW_DUMMIES"])
def test_range_checks_can_be_disabled(tmp_path: Path, flag: str) -> None:
    library = make_library(tmp_path, f"-DMS2000_{flag}")
    axis, mark = 0x18, library.protocol.marks.terminator
    from stagewire_ms2000 import messages as m

    far, dummy = m.WriteVectorSpeed.keep({"vector_speed": 0xFFFF}), m.WriteStartSpeed(5)
    unchecked = flag == "NO_RANGE_CHECKS"
    assert library.encode(far, axis)[0] == ("OK" if unchecked else "OUT_OF_RANGE")
    assert library.encode(m.ReadStatus(), mark)[0] == ("OK" if unchecked else "OUT_OF_RANGE")
    assert library.encode(dummy, axis)[0] == ("DUMMY" if unchecked else "OK")


# Forms


def test_the_other_form_of_a_command(library: CommandLibrary) -> None:
    for cls in commands(library):
        made = cls.keep({f["name"]: bounded(f, "maximum") for f in library.fields(cls)})
        slot = cls.layout.size or 0
        _, raw = library.encode(made, 1, checked=False)
        if cls.layout.length:
            assert library.unsized(raw) == ("WRONG_LENGTH", raw)
            assert library.sized(slot, raw) == ("OK", raw)
            continue
        with_size = CommandFrame(made, 1, sized=True).encode(allow_dummy=True)
        without = CommandFrame(made, 1, sized=False).encode(allow_dummy=True)
        for form in (with_size, without):
            assert library.sized(slot, form) == ("OK", with_size)
            assert library.unsized(form) == ("OK", without)
            assert library.decode(cls, form)[0] == "OK"
        assert library.sized(slot, without, cap=3) == ("NO_SPACE", without)
        assert library.sized(slot, without, cap=4) == ("OK", with_size)


@CASES
@given(data=st.data())
def test_extra_bytes_go_before_the_terminator(library: CommandLibrary, data: st.DataObject) -> None:
    cls = data.draw(st.sampled_from(commands(library)))
    message = cls.keep({f["name"]: bounded(f, "maximum") for f in library.fields(cls)})
    count = data.draw(st.sampled_from((0, 1, 2, 200, 245, 246, 247, 248, 249, 250, 255, 256)))
    extra = bytes(count) if count > 2 else bytes(data.draw(a_byte) for _ in range(count))
    _, raw = library.encode(message, 1, checked=False)
    try:
        wanted = CommandFrame(message, 1, extra).encode(allow_dummy=True)
    except CodecError as error:
        code = {"bad_value": "WRONG_LENGTH", "out_of_range": "OUT_OF_RANGE"}[error.code]
        assert library.appended(raw, extra) == (code, raw)
        return
    assert library.appended(raw, extra) == ("OK", wanted)
    assert library.appended(raw, extra, cap=len(wanted)) == ("OK", wanted)
    if extra:
        assert library.appended(raw, extra, cap=len(wanted) - 1) == ("NO_SPACE", raw)
    assert library.decode(cls, wanted)[0] == "OK"


def test_bytes_shorter_than_a_command_are_unchanged(library: CommandLibrary) -> None:
    """For example a setup command, which has no size slot."""
    for size in range(3):
        raw = b"\xff\x41"[:size]
        assert library.sized(0, raw) == ("WRONG_LENGTH", raw)
        assert library.unsized(raw) == ("WRONG_LENGTH", raw)
        assert library.appended(raw, b"\0") == ("WRONG_LENGTH", raw)


# Bytes that look like a setup command


@CASES
@given(data=st.data())
def test_bytes_that_look_like_a_setup_command(library: CommandLibrary, data: st.DataObject) -> None:
    cls = data.draw(st.sampled_from(commands(library)))
    marks, layout = library.protocol.marks, cls.layout
    drawn = st.sampled_from((marks.prefix, *marks.setup)) | a_byte
    content = bytes(data.draw(st.lists(drawn, min_size=layout.length, max_size=layout.length)))
    head = bytes(
        (data.draw(st.sampled_from(sorted(marks.axis_bytes))), layout.id, layout.size or 0)
    )
    frame = library.protocol.decode(head + content + bytes((marks.terminator,)))
    raw = frame.encode(allow_dummy=True)
    try:
        frame.encode(allow_dummy=True, refuse_prefix_bytes=True)
    except OutOfRangeError:
        assert library.holds_setup(raw)
    else:
        assert not library.holds_setup(raw)


def test_the_two_bytes_are_found_at_any_offset(library: CommandLibrary) -> None:
    marks = library.protocol.marks
    for setup in marks.setup:
        for size in range(2, 12):
            for at in range(size):
                raw = bytearray(b"\1" * size)
                raw[at : at + 2] = bytes((marks.prefix, setup))[: size - at]
                assert library.holds_setup(bytes(raw)) == (at < size - 1)
    for other in range(0x100):
        assert library.holds_setup(bytes((1, marks.prefix, other))) == (other in marks.setup)


# A custom table


OWN_TABLE = """
#include "stagewire_ms2000/parser.h"
const ms2000_entry ms2000_table[] = {{3U, 0x61U, MS2000_KIND_COMMAND, 3U, 0U}};
const size_t ms2000_table_count = 1U;
"""


def test_firmware_can_define_its_own_table(tmp_path: Path) -> None:
    own = tmp_path / "own.c"
    own.write_text(OWN_TABLE, encoding="utf-8")
    library = make_library(tmp_path, "-DMS2000_NO_TABLE", str(own))
    position, status, reset = b("18 61 03 3A"), b("18 3F 3A"), b("FF 52 3A")
    assert [event.kind for event in library.parser().feed(position + status + reset)] == [
        "message", "unknown", "garbage", "garbage"
    ]  # fmt: skip
    replies = library.replies()
    assert replies.sent(status) == "WRONG_ID"
    assert replies.sent(position) == "OK"
    assert not hasattr(library.c, "ms2000_entry_name")


def test_names_can_be_omitted(tmp_path: Path) -> None:
    library = make_library(tmp_path, "-DMS2000_NO_NAMES")
    assert library.find(b("18 3F"))
    assert not hasattr(library.c, "ms2000_entry_name")


def b(text: str) -> bytes:
    return bytes.fromhex(text)
