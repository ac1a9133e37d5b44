"""Which places a controller has, and which messages of its list belong to each.

The list of a unit is one for all of a rack. The registry says of a message whom it addresses: the
motherboard, the unit as a whole, everything that has an address, or, where it says nothing, the controller
in a bay.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

from stagewire.devices import Facts, Unit
from stagewire.protocols import CommandProtocol
from stagewire_conformance.device.pics import BayPics, ChannelPics, Pics
from stagewire_conformance.device.places import Target, connected

__all__ = ["RACK", "places_of", "rack_of"]

RACK: Final = "RACK"
"""The name of a rack of modules, of which the document has the modules alone."""

_AXES: Final = ("X", "Y")
"""Axes of a controller that nothing is declared of."""


def places_of(facts: Facts, unit: Unit, pics: Pics) -> tuple[Target, ...]:
    """Return the places of a unit: the motherboard of a rack first, then its bays; or its axes."""
    if unit.kind == "line":
        return _axes(facts, unit, pics)
    if unit.kind == "generic_usb":
        return (_place(facts, unit, pics, unit.address, unit.messages),)
    return _rack(facts, unit, pics)


def rack_of(facts: Facts, pics: Pics) -> Unit:
    """Return a rack of modules as a unit: it has the bays of its modules, and no channels of its own."""
    modules = [unit for unit in facts.units.values() if unit.kind == "bay"]
    return Unit(
        name=RACK,
        title="rack of modules",
        page=modules[0].page,
        messages_from="those of its modules",
        kind="rack",
        messages=frozenset[str]().union(*(module.messages for module in modules)),
        address=modules[0].address,
        bays=modules[0].bays[: max((bay.number for bay in pics.bays or ()), default=0)],
        channels=0,
    )


def _axes(facts: Facts, unit: Unit, pics: Pics) -> tuple[Target, ...]:
    assert isinstance(facts.protocol, CommandProtocol)
    fitted = {channel.axis: channel for channel in pics.channels if channel.axis}
    return tuple(
        Target(
            address=facts.protocol.axes[name],
            name=name,
            unit=unit,
            facts=facts,
            listed=unit.messages,
            unsupported=pics.unsupported,
            fitted={None: connected(unit, facts, fitted.get(name, ChannelPics(axis=name)))},
        )
        for name in fitted or _AXES
    )


def _rack(facts: Facts, unit: Unit, pics: Pics) -> tuple[Target, ...]:
    addressees = _Addressees.of(facts.protocol.registry())
    has_modules = unit.kind == "bay" or unit.name == RACK
    bays = unit.bays[:1] if unit.kind == "bay" else unit.bays
    board = Target(
        address=unit.address,
        name=f"{unit.address:#04x}",
        unit=unit,
        facts=facts,
        is_motherboard=True,
        listed=addressees.of_any_board if has_modules else addressees.of_board(unit),
        unsupported=pics.unsupported,
    )
    cards = pics.bays
    if cards is None:
        cards = tuple(BayPics(number=number) for number in range(1, len(bays) + 1))
    places = [board]
    for card in sorted(cards, key=lambda card: card.number):
        module = facts.units[card.unit] if card.unit else unit
        listed = addressees.of_module(module) if has_modules else addressees.of_card(module)
        places.append(_place(facts, module, pics, bays[card.number - 1], listed, card))
    return tuple(places)


@dataclass(frozen=True)
class _Addressees:
    """Whom messages address in a rack.

    :param everybody: whatever has an address, and what it says unasked.
    :param board: the motherboard.
    :param unit: the unit as a whole: the motherboard of cards; of modules each, which has inputs of its own.
    """

    everybody: frozenset[str]
    board: frozenset[str]
    unit: frozenset[str]

    @classmethod
    def of(cls, registry: dict[str, Any]) -> _Addressees:
        """Return what a registry says."""
        found: dict[str | None, set[str]] = {"every": set(), "motherboard": set(), "unit": set()}
        for entry in registry["messages"]:
            is_of_all = entry["chapter"] == "generic" and entry["exchange"].get("unsolicited")
            addressee = "every" if is_of_all else entry.get("addressee")
            found.setdefault(addressee, set()).add(entry["name"])
        return cls(*(frozenset(found[whom]) for whom in ("every", "motherboard", "unit")))

    @property
    def of_any_board(self) -> frozenset[str]:
        """The messages of a motherboard of modules, which has no list of its own."""
        return self.everybody | self.board

    def of_board(self, unit: Unit) -> frozenset[str]:
        """Return those of the motherboard of a rack of cards."""
        return unit.messages & (self.everybody | self.board | self.unit)

    def of_card(self, unit: Unit) -> frozenset[str]:
        """Return those of a card."""
        return unit.messages - self.board - self.unit

    def of_module(self, unit: Unit) -> frozenset[str]:
        """Return those of a module."""
        return unit.messages - self.board


def _place(
    facts: Facts,
    unit: Unit,
    pics: Pics,
    address: int,
    listed: frozenset[str],
    card: BayPics | None = None,
) -> Target:
    bay = card.number if card else None
    channels = tuple(range(1, unit.channels + 1))
    stated = {each.number: each for each in pics.channels if each.bay in (bay, None)}
    return Target(
        address=address,
        name=f"{address:#04x}",
        unit=unit,
        facts=facts,
        bay=bay,
        channels=channels,
        listed=listed,
        unsupported={**pics.unsupported, **(card.unsupported if card else {})},
        fitted={
            number: connected(unit, facts, stated.get(number, ChannelPics(number=number)))
            for number in channels
        },
    )
