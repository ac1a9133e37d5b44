"""What a generated package says of its units: data, and nothing that does anything."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from importlib import import_module
from typing import Any, Literal

from stagewire._codec.flags import Enumeration
from stagewire._codec.message import Message
from stagewire._codec.protocol import Protocol
from stagewire._devices.candidates import Candidate
from stagewire._devices.scales import Rule
from stagewire._devices.tables import ParameterSet, Poll, Query
from stagewire._devices.values import Values
from stagewire._framings.header.protocol import FramedProtocol
from stagewire._framings.slots.protocol import CommandProtocol
from stagewire.quantities import Scale


@dataclass(frozen=True, slots=True)
class Told:
    """A message that tells a setting.

    :param set: sets it; None where nothing does.
    :param req: asks for it; None where nothing does.
    :param get: answers; None where nothing does.
    :param field: of both that holds it.
    :param scale: of the field, for a setting that is a number.
    :param values: value of the field -> that of the setting, where a table says it.
    """

    set: type[Message] | None
    req: type[Message] | None
    get: type[Message] | None
    field: str
    scale: Scale | None = None
    values: Mapping[int, int | Fraction | str] | None = None


@dataclass(frozen=True, slots=True)
class Setting:
    """A setting of a controller that scales depend on.

    :param unit: empty where it is a case.
    :param told: the messages that tell it.
    """

    name: str
    unit: str
    told: tuple[Told, ...]


@dataclass(frozen=True, slots=True)
class Alias:
    """A unit that is newer than the document. It has the messages of another unit, and scales of its own.

    :param like: the unit whose messages it takes; empty where none is known to fit.
    :param source: where it is from that it is like the other.
    :param prefixes: of its serial numbers; empty where none is known.
    :param reported_as: models that it reports besides its name.
    :param scales: group of units in whose scales it shares -> the source for that; empty: it has no scales.
    """

    name: str
    title: str
    like: str = ""
    source: str = ""
    prefixes: tuple[int, ...] = ()
    reported_as: tuple[str, ...] = ()
    scales: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Hindrance:
    """A state that may keep something from moving, or from moving on.

    :param cause: the state in a few words.
    :param name: of the bit or value that shows it.
    :param mask: the bits of the field that show it; -1: the whole field.
    :param value: of those bits while the state holds.
    :param limit: whether the state is an end of the travel.
    """

    cause: str
    name: str
    mask: int
    value: int
    limit: bool = False


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Unit:
    """A unit of the document.

    :param messages_from: where the list of its messages comes from, for people.
    :param kind: whether it has one address, bays with an address each, or stands in a bay itself.
    :param address: its own; of a ``bay`` that of the rack.
    :param bays: the addresses of its bays, from bay 1 on; of a ``bay`` those where it may stand.
    :param channels: of one address.
    :param messages: by their names in the registry.
    :param status: which form of status it sends, where bytes cannot tell.
    :param keep_alive: what it has to hear again and again on USB.
    :param prefixes: of its serial numbers and those of its cards; empty where none is known.
    :param reported_as: models that it reports besides its name.
    :param stages: names of those that the document knows on it.
    :param pause_ms: after what has no reply; None: nothing is known.
    :param also_at: other addresses at which it is known to answer.
    :param moving: status -> its field, and the bits in it that mean motion.
    :param status_query: what asks for such a status; it also carries the position.
    :param hindrances: message -> its field, and the states in it that may hinder a motion.
    :param diagnosis: the questions that tell all of these states, each of which adds some.
    :param idle: how an axis is asked whether it moves, where no bits say it.
    :param quantities: those that its messages carry.
    :param settable: those that its messages to the controller carry.
    """

    name: str
    title: str
    page: int
    messages_from: str
    kind: Literal["generic_usb", "rack", "bay", "line"]
    messages: frozenset[str]
    address: int = 0
    bays: tuple[int, ...] = ()
    channels: int = 1
    family: str = ""
    status: str | None = None
    keep_alive: type[Message] | None = None
    update_rate_hz: int | None = None
    usb_prefix: int | None = None
    card_usb_prefix: int | None = None
    prefixes: tuple[int, ...] = ()
    reported_as: tuple[str, ...] = ()
    stages: tuple[str, ...] = ()
    pause_ms: int | None = None
    pause_source: str = ""
    also_at: tuple[int, ...] = ()
    moving: Mapping[type[Message], tuple[str, int]] = field(default_factory=dict)
    status_query: ParameterSet[Any] | Query[Any] | None = None
    hindrances: Mapping[type[Message], tuple[str, tuple[Hindrance, ...]]] = field(
        default_factory=dict
    )
    diagnosis: tuple[ParameterSet[Any] | Query[Any], ...] = ()
    idle: Poll | None = None
    quantities: tuple[str, ...] = ()
    settable: tuple[str, ...] = ()

    def __repr__(self) -> str:
        return f"<Unit {self.name}: {self.title}>"

    def hindered(self, message: Message) -> Iterator[Hindrance]:
        """Give the states that a message shows and that may hinder a motion."""
        field, states = self.hindrances.get(type(message), ("", ()))
        for state in states:
            if getattr(message, field) & state.mask == state.value:
                yield state


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Facts:
    """What a generated package says of all its units.

    :param units: by name.
    :param settings: by name.
    :param quantities: quantity -> the rule of its scale.
    :param aliases: units that are newer than the document, by name.
    :param identity: asks a unit what it is: its serial number, its model and its firmware.
    :param bay_used: asks a rack whether a bay is fitted.
    :param channels: names the channels; None where nothing does.
    """

    protocol: Protocol
    package: str
    units: Mapping[str, Unit]
    settings: Mapping[str, Setting] = field(default_factory=dict)
    quantities: Mapping[str, Rule] = field(default_factory=dict)
    aliases: Mapping[str, Alias] = field(default_factory=dict)
    identity: ParameterSet[Any] | Query[Any] | None = None
    bay_used: ParameterSet[Any] | Query[Any] | None = None
    channels: type[Enumeration] | None = None

    def candidates(self) -> list[Candidate]:
        """Return everything that a controller may be."""
        return [
            *(self._candidate(unit, unit) for unit in self.units.values()),
            *(self._candidate(one, self.units.get(one.like)) for one in self.aliases.values()),
        ]

    def _candidate(self, one: Unit | Alias, unit: Unit | None) -> Candidate:
        kinships: list[object] = [(unit.kind, unit.family)] if unit else []
        if unit is one and unit is not None:
            kinships.append((unit.kind, unit.status, unit.stages))
        name = unit.name if unit else None
        return Candidate(one.name, name, one.prefixes, one.reported_as, tuple(kinships))

    def aliases_of(self, unit: Unit) -> list[Alias]:
        """Return the newer units that take the messages of a unit."""
        return [alias for alias in self.aliases.values() if alias.like == unit.name]

    def values_of(self, message: type[Message]) -> Callable[..., Values[Any]] | None:
        """Return the class of the values of a message; None for one that carries none."""
        return self.all_values().get(message)

    def all_values(self) -> Mapping[type[Message], type[Values[Any]]]:
        """Return the class of the values of each message that carries some."""
        classes: Mapping[type[Message], type[Values[Any]]] = import_module(
            f"{self.package}.devices.values"
        ).VALUES
        return classes

    def telling(self, unit: Unit) -> Iterator[tuple[Setting, Told]]:
        """Give every setting of a unit with the messages that tell it there."""
        for setting in self.settings.values():
            for told in setting.told:
                classes = (told.set, told.get)
                if any(cls is not None and cls.layout.message in unit.messages for cls in classes):
                    yield setting, told


def framed(facts: Facts) -> FramedProtocol:
    """Return the protocol of units whose messages have frames."""
    assert isinstance(
        facts.protocol, FramedProtocol
    )  # the generator chooses the base of its devices
    return facts.protocol


def commanded(facts: Facts) -> CommandProtocol:
    """Return the protocol of units whose commands have no frame."""
    assert isinstance(facts.protocol, CommandProtocol)
    return facts.protocol
