"""A controller as it is declared: its places, what each of them takes, and what is connected to it."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from dataclasses import dataclass, replace
from importlib import import_module
from typing import Any

from stagewire.devices import Facts, Unit
from stagewire.errors import StagewireError
from stagewire.protocols import (
    CommandProtocol,
    FramedMessage,
    FramedProtocol,
    Protocol,
    usable_protocols,
)
from stagewire_conformance.device.permissions import Range, RangeError
from stagewire_conformance.device.pics import Pics
from stagewire_conformance.device.targets import (
    RACK,
    Attachment,
    Target,
    Travel,
    places_of,
    rack_of,
)
from stagewire_conformance.registry import Registry, registry_of


@dataclass(frozen=True)
class Declaration:
    """A controller as it is declared.

    :param protocol: that it speaks.
    :param facts: what the generated package says of its units.
    :param unit: what the document says of it.
    :param pics: what it was made of.
    :param places: everything with an address of its own: the motherboard of a rack first, then its bays; the
        axes of a controller of axes.
    """

    protocol: Protocol
    facts: Facts
    unit: Unit
    pics: Pics
    places: tuple[Target, ...]

    @functools.cached_property
    def registry(self) -> Registry:
        """The registry of the protocol, as data."""
        return registry_of(self.protocol)

    @property
    def framed(self) -> FramedProtocol:
        """The protocol, of a controller whose messages have frames; no check asks another for it."""
        assert isinstance(self.protocol, FramedProtocol)
        return self.protocol

    @property
    def unsupported(self) -> Mapping[str, str]:
        """The messages that the PICS says are not taken, with its reasons."""
        return self.pics.unsupported

    @property
    def firmware(self) -> str | None:
        """The version of the firmware, where the PICS says it."""
        return self.pics.firmware or None

    @property
    def wants_signs(self) -> bool:
        """Whether it is to be kept talking: on USB, where it has a message for that (page 80)."""
        return self.pics.line == "usb" and any(place.keep_alive for place in self.places)

    def claims(self, message: str, place: Target | None = None) -> bool:
        """Return whether a message is of a place, or of any."""
        return any(message in each.messages for each in ((place,) if place else self.places))

    def place_at(self, address: int) -> Target | None:
        """Return the place of an address, or of an axis."""
        return next((place for place in self.places if place.address == address), None)

    def make(
        self, message: str, channel: int | None = None, form: str | None = None, **fields: Any
    ) -> Any:
        """Make a message by its name.

        :param channel: goes into its field for the channel, if it has one.

        Raises what :meth:`.Protocol.build` raises.
        """
        name = getattr(self.protocol, "channel", None)
        layout = self.protocol.message_class(message, form).layout
        if channel is not None and name in layout.fields:
            fields = {name: channel, **fields}
        return self.protocol.build(message, fields, form)

    def request(self, message: str, channel: int | None = None) -> FramedMessage:
        """Make a request by its name; what else it asks for, such as a bay, is the first there is: 0."""
        layout = self.protocol.message_class(message).layout
        name = getattr(self.protocol, "channel", None)
        others: dict[str, Any]
        others = {field: 0 for field in layout.fields if field not in (name, *layout.optional)}
        made: FramedMessage = self.make(message, channel, **others)
        return made

    def named(self, names: Mapping[int, tuple[str, ...]]) -> Declaration:
        """Return the controller with the scales of what it is, or may be: itself where they are the unit's.

        :param names: address -> names of units and aliases; empty where a place is taken as it is declared.

        Raises :class:`.RangeError` for a travel in the PICS that no scale converts to counts now.
        """
        others = {
            place.address: names[place.address]
            for place in self.places
            if names.get(place.address, ()) not in ((), (place.unit.name,))
        }
        if not others:
            return self
        places = []
        for place in self.places:
            try:
                places.append(place.named(others.get(place.address, ())))
            except RangeError as error:
                raise RangeError(
                    f"{place.name}: travel {error} on {' or '.join(others[place.address])}; give "
                    "counts_per_mm, or the travel in counts, in the PICS"
                ) from None
        return replace(self, places=tuple(places))

    def reach(self, place: Target, channel: int | None, motion: Range) -> Travel:
        """Return the counts that a stage may be moved to: those of a range that lie in its travel.

        Raises :class:`.RangeError` where nothing says which they are, or there is none.
        """
        at = f"{place.name} channel {channel}" if channel is not None else place.name
        try:
            low, high = motion.in_counts(place.position_scale(channel))
        except RangeError as error:
            raise RangeError(f"{at}: {error}{_hint(place.connected_to(channel))}") from None
        travel = place.travel_of(channel)
        if travel is not None:
            low, high = max(low, travel.low), min(high, travel.high)
        if low > high:
            raise RangeError(f"{at}: {motion} lies beyond its travel, {travel} counts")
        return Travel(low, high)


def _hint(fitted: Attachment) -> str:
    """Return what to do about a range that is not converted to counts."""
    if fitted.position_scale is not None:
        return ""
    if fitted.stage is None:
        return "; allow counts, or declare its stage in a PICS"
    where = f"{fitted.stage.name} on {fitted.scales.controller}"
    return f" of {where}; allow counts, or give counts_per_mm in a PICS"


def facts_of(protocol: Protocol) -> Facts:
    """Return what a generated package says of its units."""
    facts: Facts = import_module(f"{protocol.package}.devices.facts").FACTS
    return facts


def axes_of(protocol: CommandProtocol) -> dict[str, int]:
    """Return the documented axes with their identifiers, without those for the future."""
    axes = registry_of(protocol).axes
    return {name: axis["value"] for name, axis in axes.items() if not axis.get("reserved")}


@functools.cache  # to look through what is installed takes longer than to read a PICS
def known_units() -> Mapping[str, Protocol]:
    """Return the names of all units, and the protocols that they speak; a rack of modules is one of them."""
    found: dict[str, Protocol] = {}
    for protocol in usable_protocols():
        if isinstance(protocol, FramedProtocol | CommandProtocol):
            units = protocol.registry().get("units", ())
            found |= dict.fromkeys((unit["name"] for unit in units), protocol)
            if any(unit.get("address") == "bay" for unit in units):
                found.setdefault(RACK, protocol)
    return found


def declare(what: str | Pics) -> Declaration:
    """Return a controller as its PICS declares it; by its name alone, as the registry has it.

    Raises :class:`~stagewire.errors.StagewireError` for a unit that no protocol has. A PICS that was read
    from a file has been checked there.
    """
    pics = Pics(unit=what.upper()) if isinstance(what, str) else what
    known = known_units()
    protocol = known.get(pics.unit)
    if protocol is None:
        raise StagewireError(
            f"there is no unit {pics.unit} (there are: {', '.join(sorted(known))})"
        )
    facts = facts_of(protocol)
    unit = rack_of(facts, pics) if pics.unit == RACK else facts.units[pics.unit]
    return Declaration(protocol, facts, unit, pics, places_of(facts, unit, pics))
