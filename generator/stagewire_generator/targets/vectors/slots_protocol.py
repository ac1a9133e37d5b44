"""What holds for every command: axes, bytes that no command has, and keys of other protocols."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from stagewire_generator.model import Json, Protocol
from stagewire_generator.targets.vectors.case import Case
from stagewire_generator.targets.vectors.slots_command import held_extra
from stagewire_generator.targets.vectors.slots_frame import MOST, SLOTS, Marks
from stagewire_generator.targets.vectors.subject import Expected, Subject, make_case
from stagewire_generator.targets.vectors.wire import fields_to_bytes, greatest_but

__all__ = ["protocol_cases"]


def protocol_cases(protocol: Protocol, subjects: Sequence[Subject]) -> Iterator[Case]:
    """Yield the cases of all commands; axes are looked at in the first one."""
    marks = Marks(protocol)
    for name, about, raw, code in _broken(marks, subjects):
        yield _case("decode", name, about, {"hex": raw.hex()}, code)
    for name, about, more, code in _directions(subjects):
        yield _case("decode", name, about, {"hex": "00", **more}, code)
    unknown = {"message": "NO_SUCH_MESSAGE", "axis": marks.axis}
    yield _case("encode", "message", "a name that no command has", unknown, "unknown_message")
    commands = [
        of for of in subjects if of.message.kind == "command" and of.layout.form == "request"
    ]
    for of in [of for of in commands if of.message.size is not None][:1]:
        yield from _longest(marks, of)
    for of in commands[:1]:
        yield from _axes(protocol, marks, of)
        dest = {**of.asked, "dest": 1}
        yield _case("encode", "dest", "an address, which no command has", dest, "bad_request")
        context = {"hex": "", "context": {"status": "dc"}}
        yield _case("decode", "context", "a context, which decides nothing", context, "bad_request")


def _broken(marks: Marks, subjects: Sequence[Subject]) -> Iterator[tuple[str, str, bytes, str]]:
    """Yield bytes that are no command, whatever its name."""
    axis, prefix, end = marks.axis, marks.prefix, marks.terminator
    ids = {of.message.id for of in subjects if of.message.kind == "command"}
    command, setup = greatest_but(ids | {end}, 1), greatest_but({*marks.setup, end}, 1)
    yield "empty", "no bytes", b"", "truncated"
    yield "axis", "an axis alone", bytes((axis,)), "truncated"
    yield "prefix", "the prefix alone", bytes((prefix,)), "truncated"
    yield "terminator", "the terminator alone", bytes((end,)), "bad_length"
    yield "aborted", "an axis and the terminator", bytes((axis, end)), "bad_length"
    if command is not None:
        about, head = "a byte that no command has", bytes((axis, command))
        yield "command", about, head + bytes((0, end)), "unknown_message"
        yield "command.cut", f"{about}, and no terminator", head, "unknown_message"
    if setup is not None:
        about = "a byte that no setup command has"
        yield "setup", about, bytes((prefix, setup)), "unknown_message"
    yield (
        "setup.terminator",
        "the prefix and the terminator",
        bytes((prefix, end)),
        "unknown_message",
    )
    bare = [of for of in subjects if of.message.kind == "command" and not of.layout.length]
    for of in bare[:1]:
        assert of.message.id is not None
        head = bytes((axis, of.message.id, of.message.size or 0))
        if end:
            cut = head + bytes(MOST - 1 - len(head))
            yield "unended", "no terminator so far", cut, "truncated"
            about = "no terminator within the longest command"
            yield "unended.longest", about, cut + b"\0", "bad_length"


def _directions(subjects: Sequence[Subject]) -> Iterator[tuple[str, str, Json, str]]:
    """Yield requests that do not say what the bytes are, or say it twice."""
    asked = [of for of in subjects if of.layout.form == "reply"]
    for of in asked[:1]:
        name = of.message.name
        yield (
            "command.no_reply",
            "a command that is answered, and no reply",
            {"command": name},
            "bad_request",
        )
        more = {"command": name, "direction": "command"}
        yield "command.command", "a command that answers a command", more, "bad_request"
        more = {"command": name, "direction": "sideways"}
        yield "direction.unknown", "a direction that there is not", more, "bad_request"
    yield "reply", "a reply to nothing", {"direction": "reply"}, "bad_request"
    more = {"direction": "reply", "command": "NO_SUCH_MESSAGE"}
    yield "reply.unknown", "a reply to what is no command", more, "unknown_message"


def _longest(marks: Marks, of: Subject) -> Iterator[Case]:
    """Yield a command that is as long as commands can be, and one that is longer."""
    data = fields_to_bytes(of.fields, of.plain.held)
    room = bytes((marks.terminator ^ 1,)) * (MOST - SLOTS - len(data) - 1)
    yield from held_extra(marks, of, "extra.most", "as many bytes as there is room for", room)
    longer = room + room[:1]
    about = "more bytes than there is room for"
    yield of.encode("extra.above", about, "out_of_range", extra=longer.hex())
    raw = marks.command(of, data, of.message.size, longer)
    yield of.decode("extra.above", about, raw, "bad_length")


def _axes(protocol: Protocol, marks: Marks, of: Subject) -> Iterator[Case]:
    """Yield every axis that the document names, and the least and greatest bytes that may be one."""
    axes = next(e for e in protocol.enumerations if e.name == protocol.framing["axes"])
    named = {value.value: f"={value.name}" for value in axes.values}
    possible = [byte for byte in range(256) if byte not in (marks.prefix, marks.terminator)]
    names = {possible[0]: ".least", possible[-1]: ".greatest", **named}
    raw = marks.command(of, fields_to_bytes(of.fields, of.plain.held), of.message.size)
    asked = {**of.asked, "fields": of.plain.given}
    for axis, name in names.items():
        there = bytes((axis,)) + raw[1:]
        about = f"the axis {axis:#04x}"
        yield _case("encode", f"axis{name}", about, {**asked, "axis": axis}, there)
        answer = of.answer(of.plain, axis=axis)
        yield _case("decode", f"axis{name}", about, {"hex": there.hex()}, answer)
    about = "true, which is no axis"
    yield _case("encode", "axis.true", about, {**asked, "axis": True}, "bad_value")


def _case(operation: str, name: str, about: str, more: Json, expected: Expected) -> Case:
    return make_case(f"frame/{operation}/{name}", about, {"op": operation, **more}, expected)
