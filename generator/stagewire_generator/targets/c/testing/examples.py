"""Worked examples and captures as vectors."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple

from stagewire_generator.model import Json, Protocol
from stagewire_generator.targets.c.testing.cases import field_where, keyboard_vectors, octets_of
from stagewire_generator.targets.c.testing.claims import claim_vectors
from stagewire_generator.targets.c.testing.values import CannotSayError
from stagewire_generator.targets.c.testing.vector import Vectors, VectorView, noted
from stagewire_generator.targets.vectors.cases import captures_of, examples_of

_ARITHMETIC = "arithmetic in the document, without bytes or a scale"


class ExamplesView(NamedTuple):
    """Vectors of the examples and the captures.

    :param cut: template of the function that cuts streams; empty if no example has a stream.
    :param converts: whether an example states a value in units.
    """

    vectors: tuple[VectorView, ...]
    cut: str
    converts: bool


def examples_view(protocol: Protocol) -> ExamplesView:
    """Make the view of all worked examples in the order of the document, and of all captures."""
    vectors = Vectors(protocol)
    examples = examples_of(protocol)
    made: list[VectorView] = []
    for entry in examples:
        made += _tried(entry, vectors, _MAKERS.get(entry["kind"], _frame))
    for entry in captures_of(protocol):
        made += _tried(entry, vectors, _capture)
    has_streams = any("stream" in entry.get("claim", {}) for entry in examples)
    cut = vectors.framing.cut if has_streams else ""
    return ExamplesView(tuple(made), cut, any("stated" in entry for entry in examples))


_Maker = Callable[[Vectors, str, Json], Iterator[VectorView]]


def _tried(entry: Json, vectors: Vectors, make: _Maker) -> list[VectorView]:
    """Return the vectors of an example, or a note with the reason why there are none."""
    try:
        return list(make(vectors, entry["id"], entry))
    except CannotSayError as error:
        return [noted(entry["id"], f"cannot be written in C: {error}")]


def _frame(vectors: Vectors, id: str, entry: Json) -> Iterator[VectorView]:
    """Yield the checks of a frame, and of the values stated in units."""
    yield from _bytes(vectors, id, entry)
    for name, item in entry.get("stated", {}).items():
        yield vectors.converted(id, item.get("quantity", name), item)


def _bytes(vectors: Vectors, id: str, entry: Json) -> Iterator[VectorView]:
    """Yield the checks of bytes; for a misprint, of the printed and of the correct bytes."""
    printed = octets_of(entry, "printed")
    if entry["verdict"] != "erratum":
        for content in vectors.contents(entry):
            yield vectors.both(id, content, printed)
        return
    content = vectors.content(entry)
    yield vectors.differs(id, content, printed)
    yield vectors.both(id, content, octets_of(entry, "encoded"))
    truth = entry["printed_is"]
    if "rejected" in truth:
        yield vectors.refused(id, printed, truth["rejected"], _reading(entry))
    else:
        said = {**{key: entry[key] for key in ("message", "form")}, **truth["decodes"]}
        yield vectors.decoded(id, vectors.content(said), printed)


def _capture(vectors: Vectors, id: str, entry: Json) -> Iterator[VectorView]:
    """Yield the checks of a captured frame."""
    printed = octets_of(entry, "printed")
    if entry["verdict"] == "tolerated":
        content = vectors.content(entry)
        yield vectors.both(id, content, octets_of(entry, "encoded"))
        yield vectors.decoded(id, content, printed)
        return
    if entry["verdict"] != "rejected":
        for content in vectors.contents(entry):
            yield vectors.both(id, content, printed)
        return
    yield vectors.refused(id, printed, entry["rejected"], _reading(entry))
    if "fields" in entry:
        yield vectors.differs(id, vectors.content(entry), printed)


def _reading(entry: Json) -> Json:
    """Return the keys of a decode request besides the bytes of an example."""
    if entry.get("form") != "reply":
        return {}
    return {"direction": "reply", "command": entry["message"]}


def _number(vectors: Vectors, id: str, entry: Json) -> Iterator[VectorView]:
    """Yield the checks of a frame with the number in a field of its format."""
    number = field_where(vectors, lambda of, field: field.format.name == entry["format"])
    content = number.content(entry["value"])
    right = "encoded" if "encoded" in entry else "printed"
    yield vectors.carried(id, content, number.around(octets_of(entry, right)))
    if right != "printed":
        yield vectors.differs(id, content, number.around(octets_of(entry, "printed")))


def _scaling(vectors: Vectors, id: str, entry: Json) -> Iterator[VectorView]:
    """Yield the checks of stated values; pure arithmetic cannot be checked with the headers."""
    if "stated" not in entry:
        yield noted(id, _ARITHMETIC)
    for item in entry.get("stated", ()):
        yield vectors.converted(id, item["quantity"], item)


_MAKERS: dict[str, _Maker] = {
    "keyboard": keyboard_vectors,
    "stream": _number,
    "number_format": _number,
    "scaling": _scaling,
    "statement": claim_vectors,
}
