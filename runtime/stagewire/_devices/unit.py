"""Data classes with which a generated package describes its units."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from dataclasses import field as field_of
from fractions import Fraction
from importlib import import_module
from typing import Any, Literal

from stagewire._codec.flags import Enumeration
from stagewire._codec.message import Message
from stagewire._codec.protocol import Protocol
from stagewire._devices.candidates import Candidate
from stagewire._devices.scales import Rule
from stagewire._devices.tables import Action, Command, Order, ParameterSet, Poll, Query
from stagewire._devices.values import Values
from stagewire._framings.header.protocol import FramedProtocol
from stagewire._framings.slots.protocol import CommandProtocol
from stagewire.quantities import Scale


@dataclass(frozen=True, slots=True)
class Told:
    """Messages that report a setting.

    :param set: message that sets it; None if there is none.
    :param req: message that requests it; None if there is none.
    :param get: message with the reply; None if there is none.
    :param field: field for the setting, in ``set`` and ``get``.
    :param scale: scale of the field, for a setting that is a number.
    :param values: value of the field -> value of the setting, if a table defines it.
    :param active: another field, and its values with which the setting applies; None: always.
    :param not_on: units on which the field has no meaning.
    """

    set: type[Message] | None
    req: type[Message] | None
    get: type[Message] | None
    field: str
    scale: Scale | None = None
    values: Mapping[int, int | Fraction | str] | None = None
    active: tuple[str, tuple[int, ...]] | None = None
    not_on: tuple[str, ...] = ()

    def applies(self, message: Message) -> bool:
        """Return whether the setting that a message reports applies."""
        return self.active is None or getattr(message, self.active[0]) in self.active[1]


@dataclass(frozen=True, slots=True)
class Setting:
    """A setting of a controller that scales depend on, or an end of the travel that it allows.

    :param unit: unit of its value; empty if it is a case or an end.
    :param told: messages that report it.
    :param quantity: quantity of an end, which is in counts.
    """

    name: str
    unit: str
    told: tuple[Told, ...]
    quantity: str = ""


@dataclass(frozen=True, slots=True)
class Alias:
    """A unit that is newer than the document, with the messages of another unit but its own scales.

    :param like: unit whose messages it supports; empty if none is known.
    :param source: source for ``like``.
    :param prefixes: prefixes of its serial numbers; empty if unknown.
    :param reported_as: models that it may report, in addition to its name.
    :param scales: group of units whose scales it shares -> source; empty: its scales are unknown.
    :param alike: prefixes that it shares with units that report the same model.
    """

    name: str
    title: str
    like: str = ""
    source: str = ""
    prefixes: tuple[int, ...] = ()
    reported_as: tuple[str, ...] = ()
    scales: Mapping[str, str] = field(default_factory=dict)
    alike: tuple[int, ...] = ()


@dataclass(frozen=True, slots=True)
class Unsupported:
    """A unit that is known but cannot be used.

    :param reason: why it cannot be used, in a sentence.
    :param prefixes: prefixes of its serial numbers; empty if unknown.
    :param alike: those of them that it shares with units that report the same model.
    """

    name: str
    title: str
    reason: str
    prefixes: tuple[int, ...] = ()
    alike: tuple[int, ...] = ()


@dataclass(frozen=True, slots=True)
class Hindrance:
    """A state of a controller that may prevent or interrupt a motion.

    :param cause: short description of the state.
    :param name: name of the bit or value that shows it.
    :param mask: bits of the field that show it; -1: the whole field.
    :param value: value of these bits in this state.
    :param limit: whether the stage is at a limit switch or at an end of its travel.
    """

    cause: str
    name: str
    mask: int
    value: int
    limit: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Need:
    """A state of the controller without which a motion cannot succeed.

    The state is refused if it hinders a motion (:class:`Hindrance`), or if a value cannot work.

    :param table: request that reads it.
    :param fields: fields that must not be 0 and, if their values have names, must be one of them.
    :param each_time: whether it is read before each motion; otherwise when the device is opened.
    """

    table: ParameterSet[Any]
    fields: tuple[str, ...] = ()
    each_time: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Enabling:
    """How the channels of a unit are enabled, if it is not one by one.

    :param table: parameter set that enables channels; None: the one that motions need.
    :param field: its field.
    :param channels: value of the field -> the channels that it enables, counted from 1, if the parameter set
        is that of the whole controller; empty if each channel has one.
    :param disables_others: whether enabling a channel disables the others.
    :param before_motions: whether a channel must be enabled again before each motion.
    """

    table: ParameterSet[Any] | None = None
    field: str = ""
    channels: Mapping[int, tuple[int, ...]] = field_of(default_factory=dict)
    disables_others: bool = False
    before_motions: bool = False

    def value_for(self, channels: tuple[int, ...]) -> int:
        """Return the value that enables exactly these channels."""
        return next(value for value, enabled in self.channels.items() if enabled == channels)


@dataclass(frozen=True, slots=True, eq=False)
class Positions:
    """The only positions of a unit, counted from 1, and how it moves to them.

    :param move: action that moves to a position.
    :param argument: its field for the position.
    :param read: request for the bits that show the position.
    :param field: field of the reply with these bits.
    :param places: value of the argument and mask of the bit, for each position.
    :param times: parameter set with the time of a move.
    :param time: its field with the time in ms.
    :param counts: its field with the same time in counts of the unit.
    :param factor: counts for a time of 1 ms.
    :param exponent: power of the time in ms that the factor is multiplied with.
    """

    move: Action
    argument: str
    read: ParameterSet[Any] | Query[Any]
    field: str
    places: tuple[tuple[int, int], ...]
    times: ParameterSet[Any]
    time: str
    counts: str
    factor: int
    exponent: float

    def counts_of(self, milliseconds: int) -> int:
        """Return a time in counts of the unit."""
        return int(self.factor * milliseconds**self.exponent + 0.5)

    def number_in(self, message: Message) -> int | None:
        """Return the position that a reply reports, counted from 1; None if it reports none or several."""
        bits = getattr(message, self.field)
        found = [number for number, (_, mask) in enumerate(self.places, 1) if bits & mask]
        return found[0] if len(found) == 1 else None


@dataclass(frozen=True, slots=True)
class StageReport:
    """Message in which a unit reports the stage on a channel.

    :param query: request for the message.
    :param field: message and field with the id, as in the ``ids`` of a stage.
    :param source: origin of the fact, for messages.
    """

    query: ParameterSet[Any] | Query[Any]
    field: str
    source: str

    @property
    def message(self) -> str:
        """Name of the message with the id."""
        return self.field.partition(".")[0]

    def id_in(self, message: Message) -> int:
        """Return the id in a message."""
        return int(getattr(message, self.field.partition(".")[2]))


@dataclass(frozen=True, slots=True, eq=False)
class Updates:
    """The status messages that a unit sends unsolicited.

    :param start: command that starts them.
    :param stop: command that stops them.
    :param messages: their classes.
    """

    start: Command
    stop: Command
    messages: tuple[type[Message], ...]


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Unit:
    """A unit of the document.

    :param messages_from: source of the list of its messages.
    :param kind: kind of unit: with one address, a rack of bays, a module for a bay, or commands over a line.
    :param address: its address; for a ``bay``, the address of the rack.
    :param bays: addresses of its bays, starting with bay 1; for a ``bay``, the addresses that it may have.
    :param channels: number of channels at one address.
    :param idents: enumeration with the values of the channels in messages; None: 1, 2, 3 and so on.
    :param messages: names of its messages in the registry.
    :param status: form of status that it sends, if the bytes do not show it.
    :param contexts: other context of its layouts -> its values, each with the firmware from which it applies,
        the latest first; () is any firmware.
    :param keep_alive: message that it must receive regularly on USB.
    :param prefixes: prefixes of its serial numbers and those of its cards; empty if unknown.
    :param reported_as: models that it may report, in addition to its name.
    :param alike: prefixes that it shares with units that report the same model.
    :param stages: names of the stages that the document lists for it.
    :param built_in: name of the stage that is built into it; None if there is none.
    :param reports_stage: message in which it reports its stage; None if it is not known to do so.
    :param pause_ms: pause after a message without a reply; None: unknown.
    :param also_at: other addresses at which it is known to answer.
    :param moving: status message -> its field, and the bits that indicate motion.
    :param status_query: request for such a status, which also contains the position; if the only status is
        that of several channels, the request for the position of one.
    :param hindrances: message -> its field, and the states that may prevent a motion.
    :param diagnosis: requests that together report all of these states.
    :param needs: message that starts a motion -> the state that it needs.
    :param reports_ends_after: parameters that it must receive before it reports the end of any motion; None:
        it always reports them.
    :param enabling: how its channels are enabled, if it is not one by one; None for others.
    :param positions: its positions, if it has only a few; None for others.
    :param farewell: message to send before the line is closed, if the host sent one of the messages whose
        effect it ends; one without such messages ends the connection.
    :param safe_state: messages that switch off its outputs that can burn or heat; sent when it is opened,
        when it is closed, and by ``stop()``.
    :param stop_state: messages that end its loops or other outputs; sent by ``stop()``.
    :param halts: other stops that ``stop()`` sends, if no single message of the unit is its stop.
    :param idle: request whether an axis is idle, if no status bits report it.
    :param quantities: quantities in its messages.
    :param settable: quantities in its messages to the controller.
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
    idents: type[Enumeration] | None = None
    family: str = ""
    status: str | None = None
    contexts: Mapping[str, tuple[tuple[tuple[int, ...], str], ...]] = field(default_factory=dict)
    keep_alive: type[Message] | None = None
    update_rate_hz: int | None = None
    usb_prefix: int | None = None
    card_usb_prefix: int | None = None
    prefixes: tuple[int, ...] = ()
    reported_as: tuple[str, ...] = ()
    alike: tuple[int, ...] = ()
    stages: tuple[str, ...] = ()
    built_in: str | None = None
    reports_stage: StageReport | None = None
    pause_ms: int | None = None
    pause_source: str = ""
    also_at: tuple[int, ...] = ()
    moving: Mapping[type[Message], tuple[str, int]] = field(default_factory=dict)
    status_query: ParameterSet[Any] | Query[Any] | None = None
    hindrances: Mapping[type[Message], tuple[str, tuple[Hindrance, ...]]] = field(
        default_factory=dict
    )
    diagnosis: tuple[ParameterSet[Any] | Query[Any], ...] = ()
    needs: Mapping[type[Message], tuple[Need, ...]] = field(default_factory=dict)
    reports_ends_after: ParameterSet[Any] | None = None
    enabling: Enabling | None = None
    positions: Positions | None = None
    farewell: Mapping[type[Message], tuple[type[Message], ...]] = field(default_factory=dict)
    safe_state: tuple[Order, ...] = ()
    stop_state: tuple[Order, ...] = ()
    halts: tuple[Action, ...] = ()
    idle: Poll | None = None
    quantities: tuple[str, ...] = ()
    settable: tuple[str, ...] = ()

    def __repr__(self) -> str:
        return f"<Unit {self.name}: {self.title}>"

    @property
    def channel_idents(self) -> tuple[int, ...]:
        """The values of the channels in messages, starting with channel 1."""
        if self.idents is None:
            return tuple(range(1, self.channels + 1))
        return tuple(sorted(int(member) for member in self.idents)[: self.channels])

    def channel_number(self, ident: int) -> int:
        """Return the number of the channel with this value in messages; the first has 1."""
        return self.channel_idents.index(ident) + 1

    @property
    def has_outputs_to_stop(self) -> bool:
        """Whether `stop()` of the whole unit ends outputs or loops."""
        return bool(self.safe_state or self.stop_state or self.halts)

    def contexts_of(self, firmware: tuple[int, ...] | None) -> dict[str, str]:
        """Return the contexts that select layouts of its messages.

        :param firmware: version of its firmware; None: unknown, so contexts that depend on it are left out.
        """
        found = {} if self.status is None else {"status": self.status}
        for name, values in self.contexts.items():
            if firmware is None:  # only a value that all firmware has is certain
                certain = [value for since, value in values if since == () and len(values) == 1]
            else:
                certain = [value for since, value in values if firmware >= since]
            found.update((name, value) for value in certain[:1])
        return found

    def hindered(self, message: Message) -> Iterator[Hindrance]:
        """Yield the states in a message that may prevent a motion."""
        field, states = self.hindrances.get(type(message), ("", ()))
        for state in states:
            if getattr(message, field) & state.mask == state.value:
                yield state


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Facts:
    """Data of a generated package about all its units.

    :param units: units by name.
    :param settings: settings by name.
    :param quantities: quantity -> rule of its scale.
    :param aliases: units that are newer than the document, by name.
    :param unsupported: units that are known but cannot be used, by name.
    :param identity: request for the serial number, the model and the firmware of a unit.
    :param bay_used: request to a rack whether a bay is occupied.
    :param channels: enumeration of the channels; None if they have no names.
    """

    protocol: Protocol
    package: str
    units: Mapping[str, Unit]
    settings: Mapping[str, Setting] = field(default_factory=dict)
    quantities: Mapping[str, Rule] = field(default_factory=dict)
    aliases: Mapping[str, Alias] = field(default_factory=dict)
    unsupported: Mapping[str, Unsupported] = field(default_factory=dict)
    identity: ParameterSet[Any] | Query[Any] | None = None
    bay_used: ParameterSet[Any] | Query[Any] | None = None
    channels: type[Enumeration] | None = None

    def candidates(self) -> list[Candidate]:
        """Return all units, aliases and unsupported units as candidates."""
        return [
            *(self._candidate(unit, unit) for unit in self.units.values()),
            *(self._candidate(one, self.units.get(one.like)) for one in self.aliases.values()),
            *(
                Candidate(one.name, None, one.prefixes, alike=one.alike)
                for one in self.unsupported.values()
            ),
        ]

    def _candidate(self, one: Unit | Alias, unit: Unit | None) -> Candidate:
        kinships: list[object] = [(unit.kind, unit.family)] if unit else []
        if unit is one and unit is not None:
            kinships.append((unit.kind, unit.status, unit.stages))
        name = unit.name if unit else None
        return Candidate(one.name, name, one.prefixes, one.reported_as, tuple(kinships), one.alike)

    def aliases_of(self, unit: Unit) -> list[Alias]:
        """Return the aliases that use the messages of a unit."""
        return [alias for alias in self.aliases.values() if alias.like == unit.name]

    def values_of(self, message: type[Message]) -> type[Values[Any]] | None:
        """Return the class of the values of a message; None if it has none."""
        return self.all_values().get(message)

    def all_values(self) -> Mapping[type[Message], type[Values[Any]]]:
        """Return the class of the values of each message that has values."""
        classes: Mapping[type[Message], type[Values[Any]]] = import_module(
            f"{self.package}.devices.values"
        ).VALUES
        return classes

    def writers(self) -> Mapping[str, ParameterSet[Any]]:
        """Return the parameter sets by the name of the message that writes them."""
        tables = vars(import_module(f"{self.package}.devices.tables")).values()
        return {
            table.set.layout.message: table
            for table in tables
            if isinstance(table, ParameterSet) and table.set is not None
        }

    def updates(self, unit: Unit) -> Updates | None:
        """Return how a unit is made to send status messages; None if it sends none."""
        tables = vars(import_module(f"{self.package}.devices.tables")).values()
        commands = [table for table in tables if isinstance(table, Command)]
        for stop, starters in unit.farewell.items():
            for start in (table for table in commands if table.message in starters):
                started = tuple(cls for cls in start.starts if cls.layout.message in unit.messages)
                ends = [table for table in commands if table.message is stop]
                if started and ends:
                    return Updates(start, ends[0], started)
        return None

    def telling(self, unit: Unit) -> Iterator[tuple[Setting, Told]]:
        """Yield every setting of a unit with the messages that report it."""
        for setting in self.settings.values():
            for told in setting.told:
                classes = (told.set, told.get) if unit.name not in told.not_on else ()
                if any(cls is not None and cls.layout.message in unit.messages for cls in classes):
                    yield setting, told

    def writers_of_settings(self, unit: Unit) -> dict[str, str]:
        """Return each setting of a unit that a message can change, with the name of that message."""
        known = ((setting.name, told.set) for setting, told in self.telling(unit))
        names = ((name, cls.layout.message) for name, cls in known if cls is not None)
        return {name: message for name, message in names if message in unit.messages}


def framed(facts: Facts) -> FramedProtocol:
    """Return the protocol of units whose messages have frames."""
    assert isinstance(facts.protocol, FramedProtocol)  # generated devices have the right base
    return facts.protocol


def commanded(facts: Facts) -> CommandProtocol:
    """Return the protocol of units whose commands have no frame."""
    assert isinstance(facts.protocol, CommandProtocol)
    return facts.protocol
