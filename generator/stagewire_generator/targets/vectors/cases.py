"""The cases of a protocol: worked examples, captures, wrong requests, and the cases of its framing."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from typing import Any

from stagewire_generator.framing import part
from stagewire_generator.model import Json, Protocol
from stagewire_generator.targets.vectors.framing import Framing
from stagewire_generator.targets.vectors.subject import Case, Subject, make_case
from stagewire_generator.targets.vectors.values import (
    UNNAMED,
    bad_values,
    contents,
    is_optional,
    unfit_values,
)

_REQUESTS: dict[str, tuple[str, dict[str, Any], str]] = {
    "operation.missing": ("no operation", {}, "bad_request"),
    "operation.number": ("an operation that is a number", {"op": 1}, "bad_request"),
    "operation.unknown": ("an unknown operation", {"op": "fly"}, "unsupported"),
    "decode.no_bytes": ("no bytes", {"op": "decode"}, "bad_request"),
    "decode.half": ("half a byte", {"op": "decode", "hex": "0"}, "bad_request"),
    "decode.letters": ("letters that are not hex digits", {"op": "decode", "hex": "zz"}, "bad_request"),
    "decode.blank": ("a space between the bytes", {"op": "decode", "hex": "00 00"}, "bad_request"),
    "decode.number": ("a number instead of bytes", {"op": "decode", "hex": 0}, "bad_request"),
    "decode.unknown": ("an unknown key", {"op": "decode", "hex": "", "baud": 1}, "bad_request"),
    "encode.no_message": ("no message", {"op": "encode", "fields": {}}, "bad_request"),
    "encode.number": ("a message that is a number", {"op": "encode", "message": 1}, "bad_request"),
    "encode.form": (
        "a form that is a number", {"op": "encode", "message": "NO_SUCH_MESSAGE", "form": 1}, "bad_request"
    ),
    "encode.fields": (
        "fields in a list", {"op": "encode", "message": "NO_SUCH_MESSAGE", "fields": []}, "bad_request"
    ),
    "encode.extra": (
        "half an extra byte", {"op": "encode", "message": "NO_SUCH_MESSAGE", "extra": "0"},
        "bad_request",
    ),
    "encode.unknown": (
        "an unknown key", {"op": "encode", "message": "NO_SUCH_MESSAGE", "baud": 1}, "bad_request"
    ),
    "stream.no_chunks": ("no chunks", {"op": "stream"}, "bad_request"),
    "stream.text": ("chunks that are a string", {"op": "stream", "chunks": ""}, "bad_request"),
    "stream.number": ("a chunk that is a number", {"op": "stream", "chunks": [0]}, "bad_request"),
    "stream.half": ("half a byte", {"op": "stream", "chunks": ["00", "0"]}, "bad_request"),
    "stream.end": ("an unknown end", {"op": "stream", "chunks": [], "end": "left"}, "bad_request"),
}  # fmt: skip


def bad_requests() -> Iterator[Case]:
    """Yield requests that a testee refuses before it examines a message."""
    for name, (about, request, code) in _REQUESTS.items():
        yield make_case(f"request/{name}", about, request, code)


def examples_of(protocol: Protocol) -> list[Json]:
    """Return the worked examples in the order of the document."""
    examples: Json = protocol.examples.get("examples", {})
    return sorted(
        ({"id": id, "verdict": _verdict(entry), **entry} for id, entry in examples.items()),
        key=lambda entry: (entry["page"], entry.get("line", 0), entry["id"]),
    )


def captures_of(protocol: Protocol) -> list[Json]:
    """Return the captures in the order of their file."""
    return [{"id": id, **entry} for id, entry in protocol.captures.get("captures", {}).items()]


def _verdict(entry: Json) -> str:
    """Return the verdict of a prose example, which follows from its errata."""
    return "erratum" if entry.get("errata") else "reproduced"


@lru_cache(maxsize=2)
def cases_of(protocol: Protocol) -> tuple[Case, ...]:
    """Return the cases of a protocol: the cases of messages in the order of the registry, then the rest."""
    order = {message.name: place for place, message in enumerate(protocol.messages)}
    # Some cases of the whole protocol use one message and are sorted with its cases.
    cases = sorted(
        _cases(framing_of(protocol)),
        key=lambda case: order.get(case.id.partition("/")[0], len(order)),
    )
    return tuple(cases)


def framing_of(protocol: Protocol) -> Framing:
    """Return the framing of a protocol, which makes its cases."""
    framing: type[Framing] = part(protocol.framing["kind"], "vectors")
    return framing(protocol)


def _cases(framing: Framing) -> Iterator[Case]:
    for message in framing.protocol.messages:
        for layout in message.layouts:
            of = framing.subject(message, layout)
            yield from _held(framing, of)
            yield from _refused(of)
            yield from framing.of_layout(of)
        yield from framing.of_message(message)
    yield from framing.of_protocol()
    yield from bad_requests()


def _held(framing: Framing, of: Subject) -> Iterator[Case]:
    """Yield contents, encoded and decoded; an encoder refuses values out of range."""
    for content in contents(of.fields, of.plain):
        raw = framing.frame(of, content.held)
        expected = raw if content.ranged else "out_of_range"
        yield of.encode(content.name, "", expected, content.given)
        if content.decoded and framing.decodes(of, raw):
            yield of.decode(content.name, "", raw, of.answer(content))


def _refused(of: Subject) -> Iterator[Case]:
    """Yield invalid values, and missing and unknown fields."""
    given = of.plain.given
    kinds = set()
    for field in of.fields:
        if field.role == "reserved" and field.name in UNNAMED:
            continue  # most headers have unused parameters, which are all alike
        refused = [
            (*case, "out_of_range") for case in unfit_values(field, of.plain.held[field.name])
        ]
        if field.format.kind not in kinds:  # one field of each kind is enough for wrong types
            kinds.add(field.format.kind)
            refused += [(*case, "bad_value") for case in bad_values(field)]
        for name, value, code in refused:
            yield of.encode(field.name + name, "", code, {**given, field.name: value})
        if not is_optional(field):
            others = {name: value for name, value in given.items() if name != field.name}
            yield of.encode(f"{field.name}.missing", "", "missing_field", others)
    yield of.encode("unknown_field", "", "unknown_field", {**given, "no_such_field": 0})
