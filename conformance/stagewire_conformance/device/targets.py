"""Targets: everything of a controller that has an address or is an axis, and the stages connected to it.

:func:`places_of` gives the targets of a unit. The list of messages of a unit is one for all of a rack. The
registry says of a message whom it addresses: the motherboard, the unit as a whole, everything that has an
address, or, where it says nothing, the controller in a bay.

:func:`names_of` says what a controller may be, by what it reports of itself; its scales are those of that
unit or alias.
"""

from __future__ import annotations

import functools
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from importlib import import_module
from typing import Any, Final, NamedTuple

from stagewire.devices import Facts, Scales, Unit, candidates, clean_model
from stagewire.errors import UnknownScaleError
from stagewire.protocols import CommandProtocol, FramedMessage
from stagewire.quantities import Scale, Stage
from stagewire_conformance.device.pics import BayPics, ChannelPics, Pics


def names_of(unit: Unit, facts: Facts, reported: Mapping[str, int | str]) -> tuple[str, ...]:
    """Return the names of all that a controller may be, whose scales must agree before one is used.

    :param unit: as which it is declared.
    :param reported: the fields of its identity.

    Empty where it reports no serial number, or where the registry has no prefixes: it is taken as declared.
    A controller that does not fit its declaration gets a name that no scale is known for.
    """
    known, number = facts.candidates(), reported.get("serial_number")
    if not isinstance(number, int) or not any(one.prefixes for one in known):
        return ()
    model = clean_model(str(reported.get("model_number", "")))
    found = candidates(known, number, model)
    fitting = tuple(one.name for one in found if one.unit == unit.name)
    return fitting or (f"a controller with the serial number {number} and the model {model!r}",)


_POSITION = "position"
"""The quantity that a travel and a range of motion are about."""

_WHERE = "MOT_REQ_POSCOUNTER"


class Travel(NamedTuple):
    """From which count to which; both belong to it."""

    low: int
    high: int

    def __str__(self) -> str:
        return f"{self.low}..{self.high}"


@dataclass(frozen=True)
class Attachment:
    """What is connected to one channel, or to one axis.

    :param stated: it, as the PICS has it.
    :param stage: it, with its scales; None: not known, so that there are counts only.
    :param scales: those that hold there.
    :param travel: in counts; None: not known.
    :param homes: whether it can be sent home.
    :param limit_switches: whether its ends have switches.
    """

    stated: ChannelPics
    stage: Stage | None
    scales: Scales
    travel: Travel | None
    homes: bool = True
    limit_switches: bool = True

    @property
    def position_scale(self) -> Scale | None:
        """The scale of positions; None: not known."""
        if _POSITION not in self.scales.rules:
            return None
        try:
            return self.scales.of(_POSITION, self.scales.unit_of(_POSITION))
        except UnknownScaleError:
            return None


def moves_stages(unit: Unit) -> bool:
    """Return whether a unit moves stages: it has axes, or can be asked where a stage stands.

    A solenoid driver takes messages of motors, too; it has no positions.
    """
    return unit.kind == "line" or _WHERE in unit.messages


def attachment_of(
    unit: Unit, facts: Facts, stated: ChannelPics, names: tuple[str, ...] = ()
) -> Attachment:
    """Return what is connected to a channel as it is stated.

    :param names: what the controller is, or may be: units and aliases, whose scales apply. Empty: the unit.

    Raises :class:`.RangeError` for a travel that no known scale converts to counts.
    """
    stage: Stage | None = None
    if stated.stage:
        stage = getattr(import_module(f"{facts.package}.stages"), stated.stage)
    elif stated.counts_per_mm is not None:
        stage = Stage.of_user("stage of the PICS", position=Scale(stated.counts_per_mm, "mm"))
    scales = Scales(unit.name, facts.quantities, stage=stage, stages=unit.stages, names=names)
    bare = Attachment(stated, stage, scales, None, stated.homes, stated.limit_switches)
    if stated.travel is None:
        return bare
    travel = Travel(*stated.travel.in_counts(bare.position_scale))
    return replace(bare, travel=travel)


@dataclass(frozen=True, kw_only=True)
class Target:
    """Something with an address of its own, or an axis.

    :param address: or the identifier of the axis.
    :param name: as it stands in ids and texts: ``0x50``, or ``X``.
    :param unit: what the document says of what is there: of a bay that of its card or module.
    :param bay: from 1 on; None for what is in no bay.
    :param is_motherboard: whether it is the motherboard of a rack, which has no channels.
    :param channels: by number; of an axis none.
    :param listed: the messages that the document gives it.
    :param unsupported: those of them that the PICS takes back, with the reasons.
    :param fitted: channel -> what is connected to it; of an axis under None.
    """

    address: int
    name: str
    unit: Unit
    facts: Facts = field(repr=False)
    bay: int | None = None
    is_motherboard: bool = False
    channels: tuple[int, ...] = ()
    listed: frozenset[str] = field(repr=False)
    unsupported: Mapping[str, str] = field(default_factory=dict, repr=False)
    fitted: Mapping[int | None, Attachment] = field(default_factory=dict, repr=False)

    @functools.cached_property
    def messages(self) -> frozenset[str]:
        """The messages that it is claimed to take and to give."""
        return self.listed - self.unsupported.keys()

    @property
    def status(self) -> str | None:
        """Which form of status it sends: ``dc``, ``stepper``, ``piezo`` or None."""
        return self.unit.status

    @property
    def keep_alive(self) -> type[FramedMessage] | None:
        """What it has to hear again and again on USB; None: nothing."""
        sign = None if self.is_motherboard else self.unit.keep_alive
        if sign is None or sign.layout.message not in self.messages:
            return None
        assert issubclass(sign, FramedMessage)  # commands keep nobody alive
        return sign

    @functools.cached_property
    def moves_stages(self) -> bool:
        """Whether stages can be connected to it, and not only actuators, shutters or sensors."""
        return moves_stages(self.unit) and not self.is_motherboard

    def why_not(self, message: str) -> str:
        """Return why a message is not claimed, for a check that is skipped; empty where it is."""
        if message in self.messages:
            return ""
        if message in self.unsupported:
            return f"the PICS says that {message} is not supported: {self.unsupported[message]}"
        return f"{message} is not in the list of {self.unit.name}"

    def why_none(self, messages: Iterable[str]) -> str:
        """Return why the first unclaimed one of some messages is not claimed; empty where all are."""
        return next(filter(None, map(self.why_not, messages)), "")

    def named(self, names: tuple[str, ...]) -> Target:
        """Return the place of a controller that is, or may be, one of some units and aliases.

        Raises :class:`.RangeError` where the travel of its stage is in a unit that has no scale on them.
        """
        fitted = {
            channel: attachment_of(self.unit, self.facts, each.stated, names)
            for channel, each in self.fitted.items()
        }
        return replace(self, fitted=fitted)

    def connected_to(self, channel: int | None = None) -> Attachment:
        """Return what is connected to a channel; raises :class:`KeyError` for one that is not there."""
        return self.fitted[channel]

    def stage_of(self, channel: int | None = None) -> Stage | None:
        """Return the stage on a channel; None: not known."""
        return self.fitted[channel].stage

    def travel_of(self, channel: int | None = None) -> Travel | None:
        """Return the travel of the stage on a channel, in counts; None: not known."""
        return self.fitted[channel].travel

    def position_scale(self, channel: int | None = None) -> Scale | None:
        """Return the scale of positions on a channel; None: not known."""
        return self.fitted[channel].position_scale


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
            fitted={None: attachment_of(unit, facts, fitted.get(name, ChannelPics(axis=name)))},
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
            number: attachment_of(unit, facts, stated.get(number, ChannelPics(number=number)))
            for number in channels
        },
    )
