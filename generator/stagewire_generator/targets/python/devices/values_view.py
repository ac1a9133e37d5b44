"""Modules of values: a class for each thing that a controller says."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from stagewire_generator.model import Field, Protocol
from stagewire_generator.naming import camel
from stagewire_generator.targets.documentation import sentence
from stagewire_generator.targets.python.devices.arguments import Argument
from stagewire_generator.targets.python.devices.documentation import raw_text, unit_text
from stagewire_generator.targets.python.devices.nested import Nested, laid_out
from stagewire_generator.targets.python.devices.plan import ValuesPlan
from stagewire_generator.targets.python.documentation import where
from stagewire_generator.targets.python.source import docstring, literal, paragraph

__all__ = ["ValuesView", "values_view"]

_KINDS = {"integer": "Raw", "text": "RawText", "bytes": "RawBytes"}


@dataclass(frozen=True, slots=True)
class ValuesView:
    """One class.

    :param members: statements that make its values, each followed by what is said of it.
    :param kinds: the classes of the runtime that they need.
    """

    name: str
    message: str
    head: str
    doc: str
    members: tuple[str, ...]
    kinds: tuple[str, ...]


def values_view(protocol: Protocol, plan: ValuesPlan) -> ValuesView:
    """Make the view of a class of values."""
    members: list[str] = []
    kinds: set[str] = set()
    for argument in plan.arguments:
        for kind, source, text in _members(argument):
            kinds.add(kind)
            members += [source, f'"""{docstring(paragraph(sentence(text), 4))}"""']
    message = plan.message
    found = where(protocol, message.pages, message.overlay)
    first = f"What ``{message.name}`` says."
    doc = f"{first}\n\n    {paragraph(f'{sentence(message.summary)} {sentence(found)}', 4)}\n    "
    return ValuesView(
        name=plan.name,
        message=f"m.{plan.message_class}",
        head=laid_out(
            Nested(f"class {plan.name}(", (f"Values[m.{plan.message_class}]",), ")"), 0, ":"
        ),
        doc=docstring(doc),
        members=tuple(members),
        kinds=tuple(kinds),
    )


def _members(argument: Argument) -> Iterator[tuple[str, str, str]]:
    """Yield class, statement and text of each value that a field has."""
    field = argument.field
    kind, items = _kind(field)
    head = f"{argument.keyword} = {kind}("
    yield kind, laid_out(Nested(head, (literal(field.name), *items), ")"), 4), raw_text(field)
    for way in argument.ways:
        assert field.quantity
        parts = (literal(field.name), literal(field.quantity.name), literal(way.unit))
        source = laid_out(Nested(f"{way.keyword} = InUnits(", parts, ")"), 4)
        yield "InUnits", source, unit_text(argument, way)


def _kind(field: Field) -> tuple[str, tuple[str | Nested, ...]]:
    if field.enum:
        return "Named", (f"e.{camel(field.enum.name)}",)
    if field.flags_by_unit and field.flags:
        units = (f"{literal(u)}: f.{camel(t.name)}" for u, t in field.flags_by_unit.items())
        return "BitsByUnit", (f"f.{camel(field.flags.name)}", Nested("{", tuple(units), "}"))
    if field.flags:
        return "Bits", (f"f.{camel(field.flags.name)}",)
    return _KINDS[field.format.kind], ()
