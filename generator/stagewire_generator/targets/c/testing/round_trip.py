"""A typed test of every layout: there and back with three contents, and everything that it refuses."""

from __future__ import annotations

from dataclasses import dataclass

from stagewire_generator.model import Field, Protocol
from stagewire_generator.targets.c.framing import framing_of
from stagewire_generator.targets.c.source import WIDTH
from stagewire_generator.targets.c.testing.layouts import LayoutView, layouts_view, subjects
from stagewire_generator.targets.c.testing.values import can_hold, filled, literal, members
from stagewire_generator.targets.vectors.subject import Subject
from stagewire_generator.targets.vectors.values import greatest, least


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
