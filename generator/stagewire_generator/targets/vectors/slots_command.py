"""What a command to an axis can be besides its data: both forms, ignored bytes, axes, dummies."""

from __future__ import annotations

from collections.abc import Iterator

from stagewire_generator.targets.vectors.case import Case
from stagewire_generator.targets.vectors.slots_frame import WITH, WITHOUT, Marks
from stagewire_generator.targets.vectors.subject import LEFT_OUT, Subject
from stagewire_generator.targets.vectors.wire import fields_from_bytes, fields_to_bytes

__all__ = ["command_cases", "held_extra"]


def command_cases(marks: Marks, of: Subject, raw: bytes) -> Iterator[Case]:
    """Yield the cases of one command; ``raw`` is the plain one as the document prints it."""
    yield from _forms(marks, of)
    yield from _sizes(marks, of)
    yield from _extra(marks, of)
    yield from _axes(marks, of)
    yield from _prefix(marks, of, raw)
    if of.message.dummy:
        about = "a dummy, which the document says not to use"
        yield of.encode("dummy", about, "unsupported", allow_dummy=LEFT_OUT)
        yield of.encode("dummy.false", about, "unsupported", allow_dummy=False)
    else:
        about = "a dummy would be sent, and it is none"
        yield of.encode("dummy.allowed", about, raw, allow_dummy=True)


def _other_form(of: Subject) -> str | None:
    """Return the form that the document does not print; there is none where data needs its size."""
    if of.layout.length:
        return None
    return WITH if of.message.size is None else WITHOUT


def _forms(marks: Marks, of: Subject) -> Iterator[Case]:
    """Yield the command with the size slot where the document leaves it out, or the other way round."""
    other = _other_form(of)
    for form, slot, about in (
        (WITH, of.message.size or 0, "with the size slot"),
        (WITHOUT, None, "without the size slot"),
    ):
        if form == other:
            raw = marks.command(of, b"", slot)
            yield of.encode(f"form={form}", about, raw, form=form)
            yield of.decode(f"form={form}", about, raw, of.answer(of.plain, form=form))
        else:
            about = f"{about}, which is no form of its own"
            yield of.encode(f"form={form}", about, "bad_length", form=form)


def _sizes(marks: Marks, of: Subject) -> Iterator[Case]:
    """Yield commands whose size slot holds another number, or is not there and had to be."""
    data = fields_to_bytes(of.fields, of.plain.held)
    size = of.message.size or 0
    others = [n for n in (size - 1, size + 1, size + 2) if 0 <= n <= 255 and n != marks.terminator]
    for other in others[:2]:
        about = f"a size of {other} in the place of {size}"
        yield of.decode(f"size.{other}", about, marks.command(of, data, other), "bad_length")
    if of.layout.length:
        raw = marks.command(of, b"", None)
        yield of.decode("size.missing", "no size, and no data", raw, "bad_length")


def _extra(marks: Marks, of: Subject) -> Iterator[Case]:
    """Yield commands with bytes before the terminator, which a controller ignores."""
    sized = "request" if of.message.size is not None else WITH
    extra = bytes(byte for byte in (0xA5, 0x00) if byte != marks.terminator)
    yield from held_extra(marks, of, "extra", "bytes before the terminator", extra)
    end = f"{marks.terminator:02x}"
    about = "bytes that hold the terminator"
    yield of.encode("extra.terminator", about, "bad_value", form=sized, extra=f"a5{end}")
    if not of.layout.length:
        unsized = WITHOUT if sized == "request" else "request"
        about = "bytes before the terminator, and no size slot"
        yield of.encode("extra.unsized", about, "bad_value", form=unsized, extra=extra.hex())


def held_extra(marks: Marks, of: Subject, name: str, about: str, extra: bytes) -> Iterator[Case]:
    """Yield a command with ignored bytes in both directions."""
    data = fields_to_bytes(of.fields, of.plain.held)
    form = "request" if of.message.size is not None else WITH
    raw = marks.command(of, data, of.message.size or 0, extra)
    yield of.encode(name, about, raw, form=form, extra=extra.hex())
    yield of.decode(name, about, raw, of.answer(of.plain, form=form, extra=extra.hex()))


def _axes(marks: Marks, of: Subject) -> Iterator[Case]:
    """Yield axes that are none."""
    for name, about, value, code in (
        ("prefix", "is the prefix of setup commands", marks.prefix, "out_of_range"),
        ("terminator", "is the terminator", marks.terminator, "out_of_range"),
        ("below", "is less than nothing", -1, "out_of_range"),
        ("above", "is no byte", 0x100, "out_of_range"),
        ("missing", "is missing", LEFT_OUT, "missing_field"),
        ("text", "is a text and no number", "1", "bad_value"),
    ):
        yield of.encode(f"axis.{name}", f"its axis {about}", code, axis=value)


def _prefix(marks: Marks, of: Subject, raw: bytes) -> Iterator[Case]:
    """Yield values whose bytes look like a setup command, which are refused on request."""
    if not marks.setup:
        return
    pair = bytes((marks.prefix, min(marks.setup)))
    if pair[:1] not in raw:
        about = "bytes that look like a setup command would be refused"
        yield of.encode("prefix.safe", about, raw, refuse_prefix_bytes=True)
    for field in of.fields:
        if field.format.kind != "integer" or field.format.size < len(pair):
            continue
        value = fields_from_bytes((field,), pair.ljust(field.format.size, b"\0"))[field.name]
        if field.minimum <= value <= field.maximum:
            held = {**of.plain.held, field.name: value}
            given = {**of.plain.given, field.name: value}
            there = marks.command(of, fields_to_bytes(of.fields, held), of.message.size)
            about = f"{field.name} looks like a setup command"
            name = f"prefix.{field.name}"
            yield of.encode(name, about, there, given)
            refused = f"{about}, which is refused"
            yield of.encode(
                f"{name}.refused", refused, "out_of_range", given, refuse_prefix_bytes=True
            )
    if of.message.size is not None and marks.terminator not in pair:
        about = "ignored bytes look like a setup command, which is refused"
        extra = pair.hex()
        refuse = {"refuse_prefix_bytes": True, "extra": extra}
        yield of.encode("prefix.extra", about, "out_of_range", **refuse)
