"""Every layout of a protocol as data, for the programs that test it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache

from stagewire_generator.model import Field, Layout, Message, Protocol
from stagewire_generator.targets.c.framing import framing_of
from stagewire_generator.targets.c.names import Names, names_of
from stagewire_generator.targets.c.source import integer, string
from stagewire_generator.targets.c.testing.values import filled
from stagewire_generator.targets.vectors.cases import framing_of as frames_of
from stagewire_generator.targets.vectors.subject import Subject
from stagewire_generator.targets.vectors.values import is_optional

__all__ = ["LayoutView", "LayoutsView", "index", "layouts_view", "subjects"]

_LIMITS = {
    -(1 << 15): "INT16_MIN",
    (1 << 15) - 1: "INT16_MAX",
    (1 << 16) - 1: "UINT16_MAX",
    -(1 << 31): "INT32_MIN",
    (1 << 31) - 1: "INT32_MAX",
    (1 << 32) - 1: "UINT32_MAX",
}
_SMALL = range(-0x7FFF, 0x8000)  # what any int holds


@dataclass(frozen=True, slots=True)
class LayoutView:
    """One layout.

    :param type: the struct, and what its functions begin with.
    :param name: the type without the prefix of the package.
    :param macro: what its macros begin with.
    :param id: the macro of its id.
    :param index: the name of its index.
    :param shape: what decides on the parameters of its functions: ``message``, ``command``, ``setup`` or
        ``reply``, with ``_bare`` behind it where there is no struct.
    :param calls: the call of the macro that makes the two functions for it.
    :param fields: the initialisers of its fields.
    """

    type: str
    name: str
    macro: str
    id: str
    index: str
    shape: str
    calls: str
    message: str
    form: str
    kind: str
    context: str
    value: str
    fields: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class LayoutsView:
    """All layouts, in the order of the registry.

    :param calls: the template with what stands between a layout and its functions.
    """

    layouts: tuple[LayoutView, ...]
    calls: str

    @property
    def has_unnamed(self) -> bool:
        """Whether there is a parameter without a meaning."""
        return any(
            field.startswith("{UNNAMED") for layout in self.layouts for field in layout.fields
        )

    @property
    def has_optional(self) -> bool:
        """Whether there is another field that may be left out."""
        return any(
            field.startswith("{OPTIONAL") for layout in self.layouts for field in layout.fields
        )

    @property
    def shapes(self) -> set[str]:
        """What shapes there are, so that no macro is defined in vain."""
        return {layout.shape for layout in self.layouts}


@lru_cache(maxsize=2)
def subjects(protocol: Protocol) -> dict[tuple[str, str], Subject]:
    """Return (message, form) -> all layouts that C has, in the order of the registry."""
    framing = frames_of(protocol)
    return {
        (message.name, layout.form): framing.subject(message, layout)
        for message in protocol.messages
        if message.id is not None
        for layout in message.layouts
    }


def index(names: Names, type: str) -> str:
    """Return the name of the index of a layout, by its type."""
    name = type.removeprefix(f"{names.prefix}_")
    return f"{names.macro_prefix}_LAYOUT_{name.upper()}"


def layouts_view(protocol: Protocol) -> LayoutsView:
    """Make the view of all layouts."""
    layouts = tuple(_layouts(names_of(protocol), protocol))
    return LayoutsView(layouts, framing_of(protocol).tests.calls)


def _layouts(names: Names, protocol: Protocol) -> Iterator[LayoutView]:
    for of in subjects(protocol).values():
        message, layout = of.message, of.layout
        type = names.layout(message, layout)
        shape = _shape(message, layout, bool(of.fields))
        context, value = next(iter(layout.when.items()), ("", ""))
        yield LayoutView(
            type=type,
            name=type.removeprefix(f"{names.prefix}_"),
            macro=type.upper(),
            id=f"{names.macro(message.name)}_ID",
            index=index(names, type),
            shape=shape,
            calls=filled(f"{shape.upper()}_CALLS(", [type, type.upper()], ")", 0),
            message=string(message.name),
            form=string(layout.form),
            kind=string(message.kind),
            context=string(context) if context else "NULL",
            value=string(value) if context else "NULL",
            fields=tuple(_field(type, layout, field) for field in of.fields),
        )


def _shape(message: Message, layout: Layout, struct: bool) -> str:
    """Return what decides on the parameters of its functions."""
    kind = "reply" if layout.form == "reply" else message.kind
    return kind if struct else f"{kind}_bare"


def _field(type: str, layout: Layout, field: Field) -> str:
    """Return the initialiser of a field, by the macros of the file."""
    if {"param1": layout.param1, "param2": layout.param2}.get(field.name, field) is None:
        return f"{{UNNAMED({type}, {field.name})}}"
    format, limits = field.format, (field.minimum, field.maximum)
    kind = "SIGNED" if format.signed else "UNSIGNED"
    if format.kind != "integer":
        kind, limits = format.kind.upper(), (0, 0)
    arguments = [type, field.name, str(format.size), kind, *map(_number, limits)]
    if is_optional(field):
        return filled("{OPTIONAL(", [*arguments, _number(field.constant or 0)], ")}", 4)
    return filled("{MEMBER(", arguments, ")}", 4)


def _number(value: int) -> str:
    """Return a literal of 64 bits with a sign; of a greater value its bits."""
    if value in _LIMITS:
        return _LIMITS[value]
    if value in _SMALL:
        return str(value)
    return integer(value - (1 << 64) if value >= 1 << 63 else value, 8, signed=True)
