"""Statements of the document as vectors: on constants, ranges, formats, missing things and streams."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from stagewire_generator.model import Json
from stagewire_generator.targets.c.source import integer, unsigned
from stagewire_generator.targets.c.testing.cases import Number, field_where
from stagewire_generator.targets.c.testing.values import CannotSayError, can_hold
from stagewire_generator.targets.c.testing.vector import Vectors, VectorView, noted
from stagewire_generator.targets.vectors.subject import Subject

PROSE = "prose that a program cannot check"
NO_BYTES = "does not concern bytes; see the JSON of the registry"
NO_NAME = "a missing name cannot be checked in C"

_Claim = Callable[[Vectors, str, Json], Iterator[VectorView]]


def claim_vectors(vectors: Vectors, id: str, entry: Json) -> Iterator[VectorView]:
    """Yield the checks of a statement, or the reason why there are none."""
    claim = entry["claim"]
    found = [make for key, make in _CLAIMS.items() if key in claim]
    if not found:
        yield noted(id, PROSE)
    for make in found:
        yield from make(vectors, id, claim)


def _flag(vectors: Vectors, id: str, claim: Json) -> Iterator[VectorView]:
    name, _, bit = claim["flag"].partition(".")
    tables = [table for table in vectors.protocol.flags if table.name == name]
    if not any(known.name == bit for table in tables for known in table.bits):
        raise CannotSayError("an unknown bit")
    macro, size = f"{vectors.names.table(tables[0])}_{bit}".upper(), tables[0].format.size
    if "of" in claim:
        if not 0 <= claim["of"] < 1 << 8 * size:
            raise CannotSayError("a value that does not fit the flags")
        held = "!=" if claim["set"] else "=="
        yield vectors.holds(id, f"({unsigned(claim['of'], size)} & {macro}) {held} 0U")
    else:
        number = claim["bit"] if "bit" in claim else claim["bit_number"] - 1
        yield vectors.holds(id, f"{macro} == {unsigned(1 << number, 8)}")


def _range(vectors: Vectors, id: str, claim: Json) -> Iterator[VectorView]:
    """Yield checks that the limits are accepted, and that values beyond them are not."""
    number = _field(vectors, claim["range"])
    for key, step in (("minimum", -1), ("maximum", 1)):
        if key in claim:
            end = claim[key]
            yield vectors.both(id, number.content(end), number.raw(end))
            if can_hold(number.field, end + step):
                yield vectors.not_encoded(id, number.content(end + step), "out_of_range")


def _format(vectors: Vectors, id: str, claim: Json) -> Iterator[VectorView]:
    """Yield a check that bytes of ones are -1 or the greatest number."""
    number, size = _field(vectors, claim["format"]), claim["size"]
    value = -1 if claim["signed"] else (1 << 8 * size) - 1
    yield vectors.carried(id, number.content(value), number.around(b"\xff" * size))


def _undefined(vectors: Vectors, id: str, claim: Json) -> Iterator[VectorView]:
    yield vectors.lacking(id, claim["undefined"])


def _unanswered(vectors: Vectors, id: str, claim: Json) -> Iterator[VectorView]:
    yield vectors.lacking(id, claim["unanswered"], "reply")


def _enum(vectors: Vectors, id: str, claim: Json) -> Iterator[VectorView]:
    if "missing" in claim:
        yield noted(id, NO_NAME)
        return
    tables = [table for table in vectors.protocol.enumerations if table.name == claim["enum"]]
    if not any(known.name == claim["member"] for table in tables for known in table.values):
        raise CannotSayError("an unknown name")
    macro = f"{vectors.names.table(tables[0]).upper()}_{claim['member']}"
    value = claim["value"]
    number = str(value) if abs(value) < 1 << 15 else integer(value, 8, signed=value < 1 << 63)
    yield vectors.holds(id, f"{macro} == {number}")


def _sizes(vectors: Vectors, id: str, claim: Json) -> Iterator[VectorView]:
    """Yield a command with the least value of the size slot, and one with the greatest."""
    sized = [of for of in _commands(vectors) if of.message.size is not None]
    for size in claim["sizes"].values():
        found = [of for of in sized if of.message.size == size]
        if not found:
            raise CannotSayError("a size without a command")
        yield _sent(vectors, id, found[0])


def _without_size(vectors: Vectors, id: str, claim: Json) -> Iterator[VectorView]:
    """Yield checks that these commands are sent without a size slot."""
    for name in claim["without_size"]:
        of = _command(vectors, name)
        axis = of.asked["axis"]
        raw = bytes((axis, of.message.id or 0, vectors.protocol.framing["terminator"]))
        yield vectors.encoded(id, vectors.content(of.asked), raw)


def _dummies(vectors: Vectors, id: str, claim: Json) -> Iterator[VectorView]:
    """Yield checks that these commands are refused as dummies."""
    for name in claim["dummies"]:
        of = _command(vectors, name)
        content = vectors.content({**of.asked, "fields": of.plain.held})
        yield vectors.not_encoded(id, content, "unsupported")


def _stream(vectors: Vectors, id: str, claim: Json) -> Iterator[VectorView]:
    yield vectors.cut(id, bytes.fromhex(claim["stream"]), claim["events"])


def _no_bytes(vectors: Vectors, id: str, claim: Json) -> Iterator[VectorView]:
    yield noted(id, NO_BYTES)


_CLAIMS: dict[str, _Claim] = {
    "flag": _flag,
    "range": _range,
    "undefined": _undefined,
    "enum": _enum,
    "format": _format,
    "sizes": _sizes,
    "without_size": _without_size,
    "dummies": _dummies,
    "unanswered": _unanswered,
    "switches_to": _no_bytes,
    "firmware": _no_bytes,
    "stream": _stream,
}


def _field(vectors: Vectors, name: str) -> Number:
    """Return a field by its name in a claim, MESSAGE.field."""
    return field_where(vectors, lambda of, field: f"{of.message.name}.{field.name}" == name)


def _commands(vectors: Vectors) -> list[Subject]:
    return [
        of
        for of in vectors.subjects.values()
        if of.message.kind == "command" and of.layout.form == "request"
    ]


def _command(vectors: Vectors, name: str) -> Subject:
    found = [of for of in _commands(vectors) if of.message.name == name]
    if not found:
        raise CannotSayError("an unknown command")
    return found[0]


def _sent(vectors: Vectors, id: str, of: Subject) -> VectorView:
    """Return the check that a command is encoded as the document prints it."""
    content = vectors.content({**of.asked, "fields": of.plain.held})
    return vectors.encoded(id, content, vectors.bytes_of(of, of.plain.held))
