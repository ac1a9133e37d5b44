"""Round trips in C, and the layouts of a protocol as data for test programs."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

from stagewire_generator.model import Json, Layout, Message, Protocol
from stagewire_generator.model_fields import Field
from stagewire_generator.targets.c.framing import framing_of
from stagewire_generator.targets.c.source import WIDTH, Names, integer, names_of, string
from stagewire_generator.targets.c.testing.values import can_hold, filled, literal, members
from stagewire_generator.targets.vectors.cases import framing_of as frames_of
from stagewire_generator.targets.vectors.subject import Subject
from stagewire_generator.targets.vectors.values import default, greatest, is_optional, least
from stagewire_generator.targets.vectors.values import filled as filled_in

_LIMITS = {
    -(1 << 15): "INT16_MIN",
    (1 << 15) - 1: "INT16_MAX",
    (1 << 16) - 1: "UINT16_MAX",
    -(1 << 31): "INT32_MIN",
    (1 << 31) - 1: "INT32_MAX",
    (1 << 32) - 1: "UINT32_MAX",
}
_SMALL = range(-0x7FFF, 0x8000)  # the range of int on every platform


@dataclass(frozen=True, slots=True)
class LayoutView:
    """A layout.

    :param type: the struct, and the prefix of its functions.
    :param name: the type without the prefix of the package.
    :param macro: the prefix of its macros.
    :param id: the macro of its id.
    :param index: the name of its index.
    :param shape: selects the parameters of its functions: ``message``, ``command``, ``setup`` or
        ``reply``, with the suffix ``_bare`` if there is no struct.
    :param calls: the call of the macro that defines its two functions.
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
    contexts: tuple[tuple[str, str], ...]
    fields: tuple[str, ...]


class LayoutsView(NamedTuple):
    """All layouts in the order of the registry.

    :param calls: template of the adapters between a layout and its functions.
    """

    layouts: tuple[LayoutView, ...]
    calls: str

    @property
    def has_unnamed(self) -> bool:
        """Whether there is an unused parameter."""
        return any(
            field.startswith("{UNNAMED") for layout in self.layouts for field in layout.fields
        )

    @property
    def has_optional(self) -> bool:
        """Whether there is another optional field."""
        return any(
            field.startswith("{OPTIONAL") for layout in self.layouts for field in layout.fields
        )

    @property
    def has_arrays(self) -> bool:
        """Whether there is an array."""
        return any(layout.calls.startswith("ARRAY") for layout in self.layouts)

    @property
    def shapes(self) -> set[str]:
        """The shapes of the layouts; only their macros are defined."""
        return {layout.shape for layout in self.layouts}


@lru_cache(maxsize=2)
def subjects(protocol: Protocol) -> dict[tuple[str, str], Subject]:
    """Return (message, form) -> layout, for all layouts in C, in the order of the registry."""
    framing = frames_of(protocol)
    return {
        (message.name, layout.form): framing.subject(message, layout)
        for message in protocol.messages
        if message.id is not None
        for layout in message.layouts
    }


def index(names: Names, type: str) -> str:
    """Return the name of the index of a layout from its type."""
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
        yield LayoutView(
            type=type,
            name=type.removeprefix(f"{names.prefix}_"),
            macro=type.upper(),
            id=f"{names.macro(message.name)}_ID",
            index=index(names, type),
            shape=shape,
            calls=filled(f"{_calls(layout, shape)}(", [type, type.upper()], ")", 0),
            message=string(message.name),
            form=string(layout.form),
            kind=string(message.kind),
            contexts=tuple((string(name), string(value)) for name, value in layout.when.items()),
            fields=tuple(_field(type, layout, field) for field in of.fields),
        )


def _calls(layout: Layout, shape: str) -> str:
    """Return the macro that defines the two functions of a layout."""
    return "ARRAY_CALLS" if layout.array else f"{shape.upper()}_CALLS"


def _shape(message: Message, layout: Layout, struct: bool) -> str:
    """Return the shape of a layout, which selects the parameters of its functions."""
    kind = "reply" if layout.form == "reply" else message.kind
    return kind if struct else f"{kind}_bare"


def _field(type: str, layout: Layout, field: Field) -> str:
    """Return the initialiser of a field, a macro of the file."""
    if {"param1": layout.param1, "param2": layout.param2}.get(field.name, field) is None:
        return f"{{UNNAMED({type}, {field.name})}}"
    format, limits = field.format, (field.minimum, field.maximum)
    kind = "SIGNED" if format.signed else "UNSIGNED"
    if field.array:
        kind, format = f"{kind}_ARRAY", field.array.item
    elif format.kind != "integer":
        kind, limits = format.kind.upper(), (0, 0)
    arguments = [type, field.name, str(format.size), kind, *map(_number, limits)]
    if is_optional(field):
        omitted = default(field)
        number = 0 if isinstance(omitted, list) else int(omitted)
        return filled("{OPTIONAL(", [*arguments, _number(number)], ")}", 4)
    return filled("{MEMBER(", arguments, ")}", 4)


def _number(value: int) -> str:
    """Return a signed literal of 64 bits; greater values are represented by their bits."""
    if value in _LIMITS:
        return _LIMITS[value]
    if value in _SMALL:
        return str(value)
    return integer(value - (1 << 64) if value >= 1 << 63 else value, 8, signed=True)


class TripView(NamedTuple):
    """The test of a layout.

    :param message: the declaration of the decoded message.
    :param contents: contents of its struct: least values, greatest values, and different bytes.
    :param same: checks that the decoded message equals the encoded content.
    :param refused: assignments of values just outside a range, if the type allows them.
    :param there: the macro that encodes and decodes a content; dummies have a different one.
    :param has_packet: whether a packet follows its header.
    :param sub_message: its sub-message; empty if no other message has its id.
    :param wrong_id: for a command, a wrong command byte.
    :param wrong_size: for a command, a wrong value of the size slot.
    :param array: the member of the struct with an array; empty if there is none.
    """

    layout: LayoutView
    message: str
    contents: tuple[str, ...]
    same: tuple[str, ...]
    refused: tuple[str, ...]
    there: str
    has_packet: bool
    sub_message: str
    wrong_id: str
    wrong_size: str
    array: str


class RoundTripView(NamedTuple):
    """The tests of all layouts.

    :param trip: template of the test of a layout.
    :param needs: template of the shared macros.
    :param axis: the axis of every command; empty if there are no axes.
    :param address: the address of every packet; empty if there are no addresses.
    :param id_at: offset of the id in a packet.
    :param damaged_at: distance of a check or end byte from the end of a packet; 0 if packets have neither.
    """

    trips: tuple[TripView, ...]
    trip: str
    needs: str
    axis: str
    address: str = ""
    id_at: int = 0
    damaged_at: int = 0

    @property
    def has_refused(self) -> bool:
        """Whether there are values out of range to test."""
        return any(trip.refused for trip in self.trips)

    @property
    def has_packets(self) -> bool:
        """Whether there are layouts with a packet."""
        return any(trip.has_packet and not trip.array for trip in self.trips)

    @property
    def has_arrays(self) -> bool:
        """Whether there are layouts with an array."""
        return any(trip.array for trip in self.trips)

    @property
    def has_headers(self) -> bool:
        """Whether there are layouts without a packet."""
        return not all(trip.has_packet for trip in self.trips)

    @property
    def has_sub_messages(self) -> bool:
        """Whether several messages share an id."""
        return any(trip.sub_message for trip in self.trips)

    @property
    def has_dummies(self) -> bool:
        """Whether there are dummies."""
        return any(trip.there == "DUMMY" for trip in self.trips)


def round_trip_view(protocol: Protocol) -> RoundTripView:
    """Make the view of the tests of all layouts."""
    views = layouts_view(protocol).layouts
    of = subjects(protocol).values()
    tests, end = framing_of(protocol).tests, protocol.framing.get("terminator", 0)
    axes = [subject.asked["axis"] for subject in of if "axis" in subject.asked]
    return RoundTripView(
        trips=tuple(_trip(view, subject, end) for view, subject in zip(views, of, strict=True)),
        trip=tests.trip,
        needs=tests.trip_needs,
        axis=f"0x{axes[0]:02X}U" if axes else "",
        **tests.round_trip(protocol),
    )


def _trip(layout: LayoutView, of: Subject, terminator: int) -> TripView:
    contents = (_limits(of, least), _limits(of, greatest), of.plain.held)
    return TripView(
        layout=layout,
        message=_declared(layout.type, f"{layout.macro}_INIT"),
        contents=tuple(
            filled("CONTENT(", members(of.fields, content), ")", 8)
            for content in contents
            if of.fields
        ),
        same=tuple(_same(field) for field in of.fields),
        refused=tuple(refused for field in of.fields for refused in _refused(field)),
        there="DUMMY" if of.message.dummy and of.layout.form == "request" else "THERE",
        has_packet=of.layout.form.startswith("data"),
        sub_message="" if of.message.sub_message is None else f"{of.message.sub_message}U",
        wrong_id=_other((of.message.id or 0) & 0xFF, terminator),
        wrong_size=_other(of.message.size or 0, terminator),
        array=of.fields[-1].name if of.layout.array else "",
    )


_MOST_ROWS = 3  # of the array of a content: string literals have a maximum length


def _limits(of: Subject, value: Callable[[Field], Any]) -> Json:
    """Return a content with all fields at a limit, and an array with few rows."""
    held = {field.name: value(field) for field in of.fields}
    if of.layout.array:
        rows = of.layout.array.rows
        held[rows] = min(held[rows], _MOST_ROWS)
    return filled_in(of.fields, held, value)


def _declared(type: str, initial: str) -> str:
    line = f"{type} message = {initial}"
    return line if len(line) + 5 <= WIDTH else f"{type} message =\n        {initial}"


def _other(byte: int, terminator: int) -> str:
    """Return a different byte, which is not the terminator."""
    return f"0x{next(n for n in (byte ^ 1, byte ^ 2) if n != terminator):02X}U"


def _same(field: Field) -> str:
    """Return the check that a field is unchanged after a round trip."""
    name = field.name
    if field.format.kind == "integer":
        return f"CHECK(message.{name} == content->{name})"
    if field.array:
        return f"CHECK_ARRAY({name}, {field.array.item.size}U)"
    return f"CHECK_SAME({name})"


def _refused(field: Field) -> list[str]:
    """Return assignments of values just outside the range that fit the type."""
    if field.format.kind != "integer":
        return []
    outside = (field.minimum - 1, field.maximum + 1)
    return [
        f"message.{field.name} = {literal(field, value)}"
        for value in outside
        if can_hold(field, value)
    ]
