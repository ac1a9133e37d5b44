"""Round trips in C, and every layout of a protocol as data for the programs that test it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache

from stagewire_generator.model import Field, Layout, Message, Protocol
from stagewire_generator.targets.c.framing import framing_of
from stagewire_generator.targets.c.source import WIDTH, Names, integer, names_of, string
from stagewire_generator.targets.c.testing.values import can_hold, filled, literal, members
from stagewire_generator.targets.vectors.cases import framing_of as frames_of
from stagewire_generator.targets.vectors.subject import Subject
from stagewire_generator.targets.vectors.values import greatest, is_optional, least

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


@dataclass(frozen=True, slots=True)
class TripView:
    """The test of one layout.

    :param message: the declaration of what is decoded into.
    :param contents: of its struct: least values, greatest ones, and another byte everywhere.
    :param same: checks that what was decoded is the content that was encoded.
    :param refused: assignments of values just outside a range, as far as the type allows them.
    :param there: the macro that encodes and decodes a content: of a dummy another one.
    :param has_packet: whether a packet follows its header.
    :param wrong_id: of a command, a byte that is not its own.
    :param wrong_size: of a command, a number that is never in its size slot.
    """

    layout: LayoutView
    message: str
    contents: tuple[str, ...]
    same: tuple[str, ...]
    refused: tuple[str, ...]
    there: str
    has_packet: bool
    wrong_id: str
    wrong_size: str


@dataclass(frozen=True, slots=True)
class RoundTripView:
    """The tests of all layouts.

    :param trip: the template of one.
    :param needs: that of what they share.
    :param axis: that of every command; empty where there are none.
    :param address: that of every packet; empty where there are none.
    :param id_at: of a packet, where the id stands.
    :param damaged_at: of a packet, how far before its end a byte of the check stands, or of the end; 0 where
        packets have neither.
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
        """Whether some value is out of range."""
        return any(trip.refused for trip in self.trips)

    @property
    def has_packets(self) -> bool:
        """Whether a packet follows some header."""
        return any(trip.has_packet for trip in self.trips)

    @property
    def has_headers(self) -> bool:
        """Whether some header stands alone."""
        return not all(trip.has_packet for trip in self.trips)

    @property
    def has_dummies(self) -> bool:
        """Whether there are commands that nobody should send."""
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
    contents = (
        {field.name: least(field) for field in of.fields},
        {field.name: greatest(field) for field in of.fields},
        of.plain.held,
    )
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
        wrong_id=_other((of.message.id or 0) & 0xFF, terminator),
        wrong_size=_other(of.message.size or 0, terminator),
    )


def _declared(type: str, initial: str) -> str:
    line = f"{type} message = {initial}"
    return line if len(line) + 5 <= WIDTH else f"{type} message =\n        {initial}"


def _other(byte: int, terminator: int) -> str:
    """Return another byte, which is not the one that ends a command either."""
    return f"0x{next(n for n in (byte ^ 1, byte ^ 2) if n != terminator):02X}U"


def _same(field: Field) -> str:
    """Return the check that a field came back as it was."""
    name = field.name
    if field.format.kind == "integer":
        return f"CHECK(message.{name} == content->{name})"
    return f"CHECK_SAME({name})"


def _refused(field: Field) -> list[str]:
    """Return assignments of values that lie just outside the range and inside the type."""
    if field.format.kind != "integer":
        return []
    outside = (field.minimum - 1, field.maximum + 1)
    return [
        f"message.{field.name} = {literal(field, value)}"
        for value in outside
        if can_hold(field, value)
    ]
