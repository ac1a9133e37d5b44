"""What the fields of a layout may hold: contents with a field at a boundary, or with a value that has a name.

They follow from the fields alone. How a content is framed is the business of the framings.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from stagewire_generator.model import Field, Json
from stagewire_generator.targets.vectors.values import (
    default,
    greatest,
    is_optional,
    least,
    named_values,
    plain,
)

__all__ = ["UNNAMED", "Content", "contents", "plain_content", "shown"]

UNNAMED = ("param1", "param2")
"""Header parameters that the document gives no name."""


@dataclass(frozen=True, slots=True)
class Content:
    """What a message may hold, or is refused.

    :param name: the last part of the ids of its cases.
    :param given: what an encoder is given, by field.
    :param held: what the bytes hold, by field.
    :param shown: what a decoder says of it.
    :param ranged: whether every value lies in its range; what does not is decoded, and never encoded.
    :param decoded: whether it asks more of a decoder than those with all fields at a boundary.
    """

    name: str
    given: Json
    held: Json
    shown: Json
    ranged: bool = True
    decoded: bool = True


def plain_content(fields: Sequence[Field]) -> Content:
    """Return a content of which every byte is another where the fields allow it."""
    held = {field.name: default(field) if is_optional(field) else plain(field) for field in fields}
    given = {field.name: held[field.name] for field in fields if not is_optional(field)}
    return Content("plain", given, held, shown(fields, held))


def contents(fields: Sequence[Field], base: Content) -> Iterator[Content]:
    """Yield every content that is worth a look, none twice.

    ``base`` comes first; then all fields are at a boundary; then one is, or has a name, and the others are
    as in ``base``. A field without a range of its own says nothing alone that it does not say together.
    """
    seen = set()
    for content in (base, *_together(fields, base), *_one_by_one(fields, base)):
        key = tuple(content.held.values())
        if key not in seen:
            seen.add(key)
            yield content


def _together(fields: Sequence[Field], base: Content) -> Iterator[Content]:
    """Yield contents with all fields at a boundary, and with all that may be left out given."""
    for name, value in (("least", least), ("greatest", greatest)):
        held = {field.name: value(field) for field in fields}
        yield Content(name, held, held, shown(fields, held))
    spare = {field.name: plain(field) for field in fields if is_optional(field)}
    held = base.held | spare
    yield Content("reserved", held, held, shown(fields, held))


def _one_by_one(fields: Sequence[Field], base: Content) -> Iterator[Content]:
    """Yield contents with one field at a boundary, or with a value that has a name."""
    for field in fields:
        if field.role == "reserved":
            continue
        for name, value in named_values(field):
            changed = {field.name: value}
            held = base.held | changed
            yield Content(
                name=field.name + name,
                given=base.given | changed,
                held=held,
                shown=shown(fields, held),
                ranged=isinstance(value, str) or field.minimum <= value <= field.maximum,
                decoded=name not in (".least", ".greatest"),
            )


def shown(fields: Iterable[Field], held: Json) -> Json:
    """Return what a decoder says of values: all but the parameters that have no name and say nothing."""
    return {
        field.name: held[field.name]
        for field in fields
        if held[field.name] or field.name not in UNNAMED or field.constant
    }
