"""Layouts that bytes do not tell apart: a context decides, or nothing does."""

from __future__ import annotations

from collections.abc import Iterator

from stagewire_generator.model import Field, Json, Layout, Message, Protocol
from stagewire_generator.targets.vectors.case import Case
from stagewire_generator.targets.vectors.framing import Framing
from stagewire_generator.targets.vectors.header_frame import SIZE
from stagewire_generator.targets.vectors.subject import LEFT_OUT, Expected, Subject, make_case

__all__ = ["context_cases", "contexts", "undecided_cases"]


def contexts(protocol: Protocol) -> dict[str, list[str]]:
    """Return what decides on layouts, and its values that do."""
    known: dict[str, set[str]] = {}
    for message in protocol.messages:
        for layout in message.layouts:
            for key, value in layout.when.items():
                known.setdefault(key, set()).add(value)
    return {key: sorted(values) for key, values in sorted(known.items())}


def context_cases(protocol: Protocol, of: Subject, raw: bytes) -> Iterator[Case]:
    """Yield a layout that its context chooses, and one that contradicts it."""
    when = dict(of.layout.when)
    if not when:
        return
    about = "its form left out: the context says it"
    yield of.encode("context", about, raw, context=when, form=LEFT_OUT)
    for key, values in contexts(protocol).items():
        for value in values:
            if key in when and when[key] != value:
                about = f"a form that the context {key} {value} contradicts"
                name = f"context.{key}={value}"
                yield of.encode(name, about, "bad_value", context=when | {key: value})


def undecided_cases(framing: Framing, message: Message) -> Iterator[Case]:
    """Yield a packet whose layout no context decides: what is sure of it, and its way back."""
    layouts = [layout for layout in message.layouts if layout.when]
    if not layouts:
        return
    of = framing.subject(message, layouts[0])
    raw = framing.frame(of, of.plain.held)
    packet = raw[SIZE:]
    shared = {field.name: of.plain.held[field.name] for field in _shared(layouts)}
    says = {**of.says, "form": "data:undecided", "fields": shared}
    yield _case(
        of, "decode", "plain", "no context", {"hex": raw.hex()}, {**says, "data": packet.hex()}
    )
    longer = framing.frame(of, of.plain.held, b"\xa5")
    data = (packet + b"\xa5").hex()
    about = "no context, and a byte beyond every layout"
    yield _case(of, "decode", "extra", about, {"hex": longer.hex()}, {**says, "data": data})
    for name, about, change, expected in _encoded(shared, packet, raw, longer):
        asked = {**of.asked, "form": "data:undecided", **change}
        yield _case(of, "encode", name, about, asked, expected)


def _encoded(
    shared: Json, packet: bytes, raw: bytes, longer: bytes
) -> Iterator[tuple[str, str, Json, Expected]]:
    data = packet.hex()
    yield "data", "from its packet alone", {"data": data}, raw
    yield "shared", "fields that its packet bears out", {"data": data, "fields": shared}, raw
    for name, value in shared.items():
        if isinstance(value, int):
            other = {"data": data, "fields": {name: value + 1}}
            yield f"{name}.other", f"{name} is another in its packet", other, "bad_value"
    yield "extra", "bytes beyond every layout", {"data": data, "extra": "a5"}, longer
    yield "longer", "a packet longer than every layout", {"data": data + "a5"}, longer
    yield "short", "a packet shorter than every layout", {"data": data[:-2]}, "bad_length"
    yield "missing", "no packet", {"fields": shared}, "missing_field"
    unknown = {"data": data, "fields": {"no_such_field": 0}}
    yield "unknown_field", "a field that it has not", unknown, "unknown_field"


def _shared(layouts: list[Layout]) -> list[Field]:
    """Return the fields that all candidates have, at the same place and in the same format."""
    first, *others = layouts
    return [
        field
        for field in first.fields
        if all(
            (field.name, field.offset, field.format)
            in [(other.name, other.offset, other.format) for other in layout.fields]
            for layout in others
        )
    ]


def _case(
    of: Subject, operation: str, name: str, about: str, more: Json, expected: Expected
) -> Case:
    id = f"{of.message.name}/data:undecided/{operation}/{name}"
    return make_case(id, about, {"op": operation, **more}, expected)
