"""Targets: the addressable parts or axes of a controller, and the stages connected to them.

:func:`places_of` returns the targets of a unit. A rack has one list of messages for all its parts. The
registry states the addressee of a message: the motherboard, the whole unit, or every address. Without an
addressee, the message goes to the controller in a bay.

:func:`names_of` returns the units that a controller may be, according to its identity. Their scales apply.
"""

from __future__ import annotations

import functools
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from importlib import import_module
from typing import Any, Final, NamedTuple

from stagewire.devices import Facts, Scales, Unit, candidates, clean_model
from stagewire.errors import UnknownScaleError, WrongUnitError
from stagewire.protocols import CommandProtocol, FramedMessage
from stagewire.quantities import Scale, Stage
from stagewire_conformance.device.pics import BayPics, ChannelPics, Pics


def names_of(
    unit: Unit, facts: Facts, reported: Mapping[str, int | str], *, by_card: bool = False
) -> tuple[str, ...]:
    """Return the names of all units that a controller may be. A scale is used only if it is the same for all.

    :param unit: the declared unit.
    :param reported: the fields of its identity.
    :param by_card: whether a card in a bay reported it, whose number does not name its rack.

    Empty without a reported serial number, or if the registry has no prefixes: the declaration applies.
    An unknown controller gets a name without any known scale.

    Raises :class:`~stagewire.errors.WrongUnitError` for a controller that is known to be another unit.
    """
    known, number = facts.candidates(), reported.get("serial_number")
    if not isinstance(number, int) or not any(one.prefixes for one in known):
        return ()
    model = clean_model(str(reported.get("model_number", "")))
    found = candidates(known, number, model)
    fitting = tuple(one.name for one in found if one.unit == unit.name)
    others = sorted({one.unit for one in found if one.unit is not None})
    if others and not fitting and not by_card:
        raise WrongUnitError(
            f"{' or '.join(one.name for one in found)} answered (serial number {number}, model {model!r}) "
            f"instead of the declared {unit.name}; declare {' or '.join(others)}"
        )
    return fitting or (f"a controller with the serial number {number} and the model {model!r}",)


_POSITION = "position"
"""The quantity of a travel and of a range of motion."""

_WHERE = "MOT_REQ_POSCOUNTER"
_JOG = "PZMOT_MOVE_JOG"
"""All inertial drives have this message."""


class Travel(NamedTuple):
    """A range in counts. Both ends are included."""

    low: int
    high: int

    def __str__(self) -> str:
        return f"{self.low}..{self.high}"


@dataclass(frozen=True)
class Attachment:
    """The stage or actuator on a channel or axis.

    :param stated: its declaration in the PICS.
    :param stage: with its scales; None if unknown, so that only counts can be used.
    :param scales: the scales that apply.
    :param travel: in counts; None if unknown.
    :param homes: whether it can home.
    :param limit_switches: whether it has limit switches.
    """

    stated: ChannelPics
    stage: Stage | None
    scales: Scales
    travel: Travel | None
    homes: bool = True
    limit_switches: bool = True

    @property
    def position_scale(self) -> Scale | None:
        """The scale of positions; None if unknown."""
        if _POSITION not in self.scales.rules:
            return None
        try:
            return self.scales.of(_POSITION, self.scales.unit_of(_POSITION))
        except UnknownScaleError:
            return None


def moves_stages(unit: Unit) -> bool:
    """Return whether a unit moves stages: it has axes or can report a position.

    A solenoid driver has some motor messages, but no positions.
    """
    return unit.kind == "line" or _WHERE in unit.messages


def attachment_of(
    unit: Unit, facts: Facts, stated: ChannelPics, names: tuple[str, ...] = ()
) -> Attachment:
    """Return the stage or actuator on a channel: the declared one, or the one that is built into the unit.

    :param names: the units and aliases that the controller may be, whose scales apply; empty for ``unit``.

    Raises :class:`.RangeError` for a travel that cannot be converted to counts.
    """
    stage: Stage | None = None
    name = stated.stage or ("" if stated.counts_per_mm else unit.built_in)
    if stated.own is not None:
        stage = stated.own
    elif name:
        stage = getattr(import_module(f"{facts.package}.stages"), name)
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
    """A part of a controller with its own address, or an axis.

    :param address: or the identifier of the axis.
    :param name: as used in ids and texts: ``0x50``, or ``X``.
    :param unit: the documented unit: for a bay, its card or module.
    :param bay: counted from 1; None outside a rack.
    :param is_motherboard: whether it is the motherboard of a rack, which has no channels.
    :param channels: by number; empty for an axis.
    :param listed: its documented messages, in the issue of the document that the firmware follows.
    :param later: those of its messages that only a later issue lists.
    :param unsupported: those that the PICS lists as unsupported, with the reasons.
    :param fitted: channel -> the stage or actuator on it; for an axis the key is None.
    """

    address: int
    name: str
    unit: Unit
    facts: Facts = field(repr=False)
    bay: int | None = None
    is_motherboard: bool = False
    channels: tuple[int, ...] = ()
    listed: frozenset[str] = field(repr=False)
    later: frozenset[str] = field(default=frozenset(), repr=False)
    unsupported: Mapping[str, str] = field(default_factory=dict, repr=False)
    fitted: Mapping[int | None, Attachment] = field(default_factory=dict, repr=False)

    @functools.cached_property
    def messages(self) -> frozenset[str]:
        """The messages that it claims to support."""
        return self.listed - self.unsupported.keys()

    @property
    def status(self) -> str | None:
        """The form of its status messages: ``dc``, ``stepper``, ``piezo`` or None."""
        return self.unit.status

    @property
    def keep_alive(self) -> type[FramedMessage] | None:
        """The keep-alive message that it needs on USB; None if it needs none."""
        sign = None if self.is_motherboard else self.unit.keep_alive
        if sign is None or sign.layout.message not in self.messages:
            return None
        assert issubclass(sign, FramedMessage)  # command protocols have no keep-alive message
        return sign

    @property
    def brushless(self) -> bool:
        """Whether its motors are brushless, which have stage axis parameters."""
        return "MOT_REQ_PMDSTAGEAXISPARAMS" in self.listed

    @functools.cached_property
    def moves_stages(self) -> bool:
        """Whether it moves stages, and not only actuators, shutters or sensors."""
        return moves_stages(self.unit) and not self.is_motherboard

    @functools.cached_property
    def reports_position(self) -> bool:
        """Whether it moves something with a position that can be read: a stage or an inertial drive."""
        return self.moves_stages or _JOG in self.listed

    def why_not(self, message: str) -> str:
        """Return why a message is not claimed, for a skipped check, or an empty string if it is."""
        if message in self.messages:
            return ""
        if message in self.unsupported:
            return f"the PICS lists {message} as unsupported: {self.unsupported[message]}"
        if message in self.later:
            return f"only a later issue of the document lists {message} for {self.unit.name}"
        return f"{message} is not in the list of {self.unit.name}"

    def why_none(self, messages: Iterable[str]) -> str:
        """Return why the first unclaimed message is not claimed, or an empty string if all are."""
        return next(filter(None, map(self.why_not, messages)), "")

    def named(self, names: tuple[str, ...]) -> Target:
        """Return the place with the scales of the units and aliases that the controller may be.

        Raises :class:`.RangeError` if the travel of its stage has a unit without a scale on them.
        """
        fitted = {
            channel: attachment_of(self.unit, self.facts, each.stated, names)
            for channel, each in self.fitted.items()
        }
        return replace(self, fitted=fitted)

    def connected_to(self, channel: int | None = None) -> Attachment:
        """Return the stage or actuator on a channel. Raises :class:`KeyError` for an unknown channel."""
        return self.fitted[channel]

    def stage_of(self, channel: int | None = None) -> Stage | None:
        """Return the stage on a channel; None if unknown."""
        return self.fitted[channel].stage

    def travel_of(self, channel: int | None = None) -> Travel | None:
        """Return the travel of the stage on a channel, in counts; None if unknown."""
        return self.fitted[channel].travel

    def position_scale(self, channel: int | None = None) -> Scale | None:
        """Return the scale of positions on a channel; None if unknown."""
        return self.fitted[channel].position_scale


RACK: Final = "RACK"
"""The name of a rack of modules. The document describes only its modules."""

_AXES: Final = ("X", "Y")
"""Axes of a controller for which the PICS declares none."""


def places_of(facts: Facts, unit: Unit, pics: Pics) -> tuple[Target, ...]:
    """Return the places of a unit: the motherboard of a rack, if any, and then its bays; or its axes."""
    if unit.kind == "line":
        return _axes(facts, unit, pics)
    if unit.kind == "generic_usb":
        return (_place(facts, unit, pics, unit.address, unit.messages),)
    return _rack(facts, unit, pics)


def rack_of(facts: Facts, pics: Pics) -> Unit:
    """Return a rack of modules as a unit: with bays, and without channels."""
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


def _later(facts: Facts, unit: Unit, pics: Pics) -> frozenset[str]:
    """Return the messages of a unit that the firmware need not have: a later issue adds them to its list."""
    registry = facts.protocol.registry()
    if pics.issue not in ("", registry["document"]["issue"]):
        return frozenset()
    entry: dict[str, Any]
    entry = next((each for each in registry["units"] if each["name"] == unit.name), {})
    return frozenset(entry.get("later_messages", ()))


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
    later = _later(facts, unit, pics)
    has_modules = unit.kind == "bay" or unit.name == RACK
    bays = unit.bays[:1] if unit.kind == "bay" else unit.bays
    board = Target(
        address=unit.address,
        name=f"{unit.address:#04x}",
        unit=unit,
        facts=facts,
        is_motherboard=True,
        listed=(addressees.of_any_board if has_modules else addressees.of_board(unit)) - later,
        later=later,
        unsupported=pics.unsupported,
    )
    cards = pics.bays
    if cards is None:
        cards = tuple(BayPics(number=number) for number in range(1, len(bays) + 1))
    places = [board] if pics.motherboard else []
    for card in sorted(cards, key=lambda card: card.number):
        module = facts.units[card.unit] if card.unit else unit
        listed = addressees.of_module(module) if has_modules else addressees.of_card(module)
        places.append(_place(facts, module, pics, bays[card.number - 1], listed, card))
    return tuple(places)


@dataclass(frozen=True)
class _Addressees:
    """The addressees of messages in a rack.

    :param everybody: messages for every address, and unsolicited ones.
    :param board: messages for the motherboard.
    :param unit: messages for the whole unit: for the motherboard of a rack of cards, or for each module,
        which has its own inputs.
    """

    everybody: frozenset[str]
    board: frozenset[str]
    unit: frozenset[str]

    @classmethod
    def of(cls, registry: dict[str, Any]) -> _Addressees:
        """Return the addressees of a registry."""
        found: dict[str | None, set[str]] = {"every": set(), "motherboard": set(), "unit": set()}
        for entry in registry["messages"]:
            is_of_all = entry["chapter"] == "generic" and entry["exchange"].get("unsolicited")
            addressee = "every" if is_of_all else entry.get("addressee")
            found.setdefault(addressee, set()).add(entry["name"])
        return cls(*(frozenset(found[whom]) for whom in ("every", "motherboard", "unit")))

    @property
    def of_any_board(self) -> frozenset[str]:
        """The messages of the motherboard of a rack of modules, which has no documented list."""
        return self.everybody | self.board

    def of_board(self, unit: Unit) -> frozenset[str]:
        """Return the messages of the motherboard of a rack of cards."""
        return unit.messages & (self.everybody | self.board | self.unit)

    def of_card(self, unit: Unit) -> frozenset[str]:
        """Return the messages of a card."""
        return unit.messages - self.board - self.unit

    def of_module(self, unit: Unit) -> frozenset[str]:
        """Return the messages of a module."""
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
    channels = unit.channel_idents
    stated = {each.number: each for each in pics.channels if each.bay in (bay, None)}
    later = _later(facts, unit, pics)
    return Target(
        address=address,
        name=f"{address:#04x}",
        unit=unit,
        facts=facts,
        bay=bay,
        channels=channels,
        listed=listed - later,
        later=later,
        unsupported={**pics.unsupported, **(card.unsupported if card else {})},
        fitted={
            ident: attachment_of(unit, facts, stated.get(number, ChannelPics(number=number)))
            for number, ident in enumerate(channels, 1)
        },
    )
