"""What prose claims, as vectors: of constants, ranges and formats, of what is not there, of streams."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from stagewire_generator.model import Json
from stagewire_generator.targets.c.source import integer, unsigned
from stagewire_generator.targets.c.testing.cases import Number, field_where
from stagewire_generator.targets.c.testing.values import CannotSayError, can_hold
from stagewire_generator.targets.c.testing.vector import Vectors, VectorView, noted
from stagewire_generator.targets.vectors.subject import Subject

PROSE = "prose; nothing that a program could check"
NO_BYTES = "says nothing of bytes; the registry's JSON has it"
NO_NAME = "that a name is missing is nothing that C can ask"

_Claim = Callable[[Vectors, str, Json], Iterator[VectorView]]


def claim_vectors(vectors: Vectors, id: str, entry: Json) -> Iterator[VectorView]:
    """Yield the checks of what a statement is taken to mean, or why there is none."""
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
        raise CannotSayError("a bit that there is not")
    macro, size = f"{vectors.names.table(tables[0])}_{bit}".upper(), tables[0].format.size
    if "of" in claim:
        if not 0 <= claim["of"] < 1 << 8 * size:
            raise CannotSayError("a value that its flags do not hold")
        held = "!=" if claim["set"] else "=="
        yield vectors.holds(id, f"({unsigned(claim['of'], size)} & {macro}) {held} 0U")
    else:
        number = claim["bit"] if "bit" in claim else claim["bit_number"] - 1
        yield vectors.holds(id, f"{macro} == {unsigned(1 << number, 8)}")


def _range(vectors: Vectors, id: str, claim: Json) -> Iterator[VectorView]:
    """Yield that the ends are accepted, and what lies beyond them is not, as far as the type goes."""
    number = _field(vectors, claim["range"])
    for key, step in (("minimum", -1), ("maximum", 1)):
        if key in claim:
            end = claim[key]
            yield vectors.both(id, number.content(end), number.raw(end))
            if can_hold(number.field, end + step):
                yield vectors.not_encoded(id, number.content(end + step), "out_of_range")


def _format(vectors: Vectors, id: str, claim: Json) -> Iterator[VectorView]:
    """Yield that as many bytes, all of them ones, are the least negative or the greatest number."""
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
        raise CannotSayError("a name that there is not")
    macro = f"{vectors.names.table(tables[0]).upper()}_{claim['member']}"
    value = claim["value"]
    number = str(value) if abs(value) < 1 << 15 else integer(value, 8, signed=value < 1 << 63)
    yield vectors.holds(id, f"{macro} == {number}")


def _sizes(vectors: Vectors, id: str, claim: Json) -> Iterator[VectorView]:
    """Yield a command with the least number in its size slot, and one with the greatest."""
    sized = [of for of in _commands(vectors) if of.message.size is not None]
    for size in claim["sizes"].values():
        found = [of for of in sized if of.message.size == size]
        if not found:
            raise CannotSayError("a size that no command has")
        yield _sent(vectors, id, found[0])


def _without_size(vectors: Vectors, id: str, claim: Json) -> Iterator[VectorView]:
    """Yield all commands that are claimed to be sent without the size slot."""
    for name in claim["without_size"]:
        of = _command(vectors, name)
        axis = of.asked["axis"]
        raw = bytes((axis, of.message.id or 0, vectors.protocol.framing["terminator"]))
        yield vectors.encoded(id, vectors.content(of.asked), raw)


def _dummies(vectors: Vectors, id: str, claim: Json) -> Iterator[VectorView]:
    """Yield that all commands are refused that are claimed to be dummies."""
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
    """Return a field by the name that claims have for it, MESSAGE.field."""
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
        raise CannotSayError("a command that there is not")
    return found[0]


def _sent(vectors: Vectors, id: str, of: Subject) -> VectorView:
    """Return the check that a command is encoded as the document prints it."""
    content = vectors.content({**of.asked, "fields": of.plain.held})
    return vectors.encoded(id, content, vectors.bytes_of(of, of.plain.held))
