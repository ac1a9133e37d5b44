"""Declared controllers: their targets, the messages of each target, and the connected stages."""

from __future__ import annotations

import difflib
import functools
from collections.abc import Iterable, Mapping
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
from stagewire_conformance.device.permissions import Need, Range, RangeError, needs_of
from stagewire_conformance.device.pics import Pics
from stagewire_conformance.device.targets import (
    RACK,
    Target,
    Travel,
    places_of,
    rack_of,
)
from stagewire_conformance.registry import Registry, registry_of


@dataclass(frozen=True)
class Declaration:
    """A controller as declared.

    :param protocol: of the controller.
    :param facts: facts about its units from the generated package.
    :param unit: the documented unit.
    :param pics: the PICS that the declaration was made from.
    :param places: everything with its own address: the motherboard of a rack first, if there is one, then
        its bays; or the axes.
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
        """The protocol, for a controller with framed messages. Only checks of framed protocols use it."""
        assert isinstance(self.protocol, FramedProtocol)
        return self.protocol

    @property
    def unsupported(self) -> Mapping[str, str]:
        """The messages that the PICS lists as unsupported, with the reasons."""
        return self.pics.unsupported

    @property
    def issue(self) -> str:
        """The issue of the document that the firmware is judged by."""
        return self.pics.issue or issues_of(self.protocol, self.pics.unit)[0]

    @property
    def firmware(self) -> str | None:
        """The firmware version, if the PICS states it."""
        return self.pics.firmware or None

    @property
    def wants_signs(self) -> bool:
        """Whether the controller needs keep-alive messages: on USB, if the protocol has one (page 80)."""
        return self.pics.line == "usb" and any(place.keep_alive for place in self.places)

    def claims(self, message: str, place: Target | None = None) -> bool:
        """Return whether a place supports a message, or any place if none is given."""
        return any(message in each.messages for each in ((place,) if place else self.places))

    def hazard(self, message: str, place: Target | None = None) -> str:
        """Return the hazard of a message at a place, or at any place; empty if it has none."""
        own = str(self.registry.messages.get(message, {}).get("hazard", ""))
        places = (place,) if place else self.places
        return own or next(filter(None, (self._added(each).get(message) for each in places)), "")

    def _added(self, place: Target) -> Mapping[str, str]:
        """Return the hazards that the family of a unit adds to those of its messages."""
        units, families = self.registry.table("units"), self.registry.table("families")
        family = units.get(place.unit.name, {}).get("family", "")
        added: Mapping[str, str] = families.get(family, {}).get("hazards", {})
        return added

    def needs(self, messages: Iterable[str], place: Target) -> frozenset[Need]:
        """Return the permissions without which messages may not be sent to a place."""
        found: set[Need] = set()
        for name in messages:
            entry = self.registry.messages[name]
            if entry["direction"] != "to_host":
                found |= needs_of(entry["effect"], self.hazard(name, place)) or set()
        return frozenset(found)

    def place_at(self, address: int) -> Target | None:
        """Return the place with an address or axis identifier."""
        return next((place for place in self.places if place.address == address), None)

    def make(
        self, message: str, channel: int | None = None, form: str | None = None, /, **fields: Any
    ) -> Any:
        """Make a message by its name.

        :param channel: the value of its channel field, if it has one.

        Raises the same errors as :meth:`.Protocol.build`.
        """
        name = getattr(self.protocol, "channel", None)
        layout = self.protocol.message_class(message, form).layout
        if channel is not None and name in layout.fields:
            fields = {name: channel, **fields}
        return self.protocol.build(message, fields, form)

    def request(self, message: str, channel: int | None = None) -> FramedMessage:
        """Make a request by its name.

        Fields other than the channel, such as a bay, have the lowest documented value or bit, or 0.
        """
        layout = self.protocol.message_class(message).layout
        name = getattr(self.protocol, "channel", None)
        facts = self.registry.fields(message, layout.form)
        others: dict[str, Any] = {
            field: min((facts[field].get("enum") or facts[field].get("flags") or {"": 0}).values())
            for field in layout.fields
            if field not in (name, *layout.optional) and facts[field]["role"] != "constant"
        }
        made: FramedMessage = self.make(message, channel, **others)
        return made

    def named(self, names: Mapping[int, tuple[str, ...]]) -> Declaration:
        """Return the controller with the scales of the units that it may be, or itself if nothing changes.

        :param names: address -> names of units and aliases; empty if a place is used as declared.

        Raises :class:`.RangeError` if a travel in the PICS can no longer be converted to counts.
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
        """Return the counts that a stage may be moved to: the intersection of a range and its travel.

        Raises :class:`.RangeError` if the range cannot be converted, or if the intersection is empty.
        """
        at = f"{place.name} channel {channel}" if channel is not None else place.name
        try:
            low, high = motion.in_counts(place.position_scale(channel))
        except RangeError as error:
            raise RangeError(f"{at}: {error}{_hint(place, channel)}") from None
        travel = place.travel_of(channel)
        if travel is not None:
            low, high = max(low, travel.low), min(high, travel.high)
        if low > high:
            raise RangeError(f"{at}: {motion} is outside its travel, {travel} counts")
        return Travel(low, high)


def _hint(place: Target, channel: int | None) -> str:
    """Return a hint for a range that cannot be converted to counts."""
    fitted = place.connected_to(channel)
    if not place.moves_stages:
        return "; allow counts, such as 0..2000counts"
    if fitted.position_scale is not None:
        return ""
    if fitted.stage is None:
        return "; allow counts, or declare its stage in a PICS"
    where = f"{fitted.stage.name} on {fitted.scales.controller}"
    return f" of {where}; allow counts, or give counts_per_mm in a PICS"


def facts_of(protocol: Protocol) -> Facts:
    """Return the facts about the units of a generated package."""
    facts: Facts = import_module(f"{protocol.package}.devices.facts").FACTS
    return facts


def axes_of(protocol: CommandProtocol) -> dict[str, int]:
    """Return the documented axes with their identifiers, without reserved ones."""
    axes = registry_of(protocol).axes
    return {name: axis["value"] for name, axis in axes.items() if not axis.get("reserved")}


def issues_of(protocol: Protocol, unit: str) -> list[str]:
    """Return the issues of the document that describe a unit. A rack of modules is in all of them."""
    registry = registry_of(protocol)
    first = registry.document()
    later = [each["document"] for each in first.get("overlays", ())]
    entry = registry.table("units").get(unit, {})
    if "later_messages" not in entry and entry.get("document", first.get("name")) != first.get(
        "name"
    ):
        return [each["issue"] for each in later if each["name"] == entry["document"]]
    return [first["issue"], *(each["issue"] for each in later)]


@functools.cache  # finding the installed protocols takes longer than reading a PICS
def known_units() -> Mapping[str, Protocol]:
    """Return the names of all units with their protocols. A rack of modules is one of them."""
    found: dict[str, Protocol] = {}
    for protocol in usable_protocols():
        if isinstance(protocol, FramedProtocol | CommandProtocol):
            units = protocol.registry().get("units", ())
            found |= dict.fromkeys((unit["name"] for unit in units), protocol)
            if any(unit.get("address") == "bay" for unit in units):
                found.setdefault(RACK, protocol)
    return found


def declare(what: str | Pics) -> Declaration:
    """Return a controller as its PICS declares it, or as the registry describes the named unit.

    Raises :class:`~stagewire.errors.StagewireError` for an unknown unit. A PICS from a file is already
    validated.
    """
    pics = Pics(unit=what.upper()) if isinstance(what, str) else what
    known = known_units()
    protocol = known.get(pics.unit)
    if protocol is None:
        close = difflib.get_close_matches(pics.unit[:40], known)
        hint = (
            f"did you mean {' or '.join(close)}?" if close else f"choose {', '.join(sorted(known))}"
        )
        raise StagewireError(f"unknown unit {pics.unit}; {hint}")
    facts = facts_of(protocol)
    unit = rack_of(facts, pics) if pics.unit == RACK else facts.units[pics.unit]
    return Declaration(protocol, facts, unit, pics, places_of(facts, unit, pics))
