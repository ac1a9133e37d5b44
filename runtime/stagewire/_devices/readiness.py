"""Whether a controller is in a state in which its motions can succeed.

The registry lists the state that a motion needs: parameters that are not 0, and an enabled channel. It is
read when a device is opened, and what was read or written later replaces it. A state that prevents motions is
logged, shown by ``print(device)``, and refused at the next motion.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, TypeAlias

from stagewire._codec.flags import Enumeration
from stagewire._codec.message import Message
from stagewire._devices.limits import Limits
from stagewire._devices.scales import Scales
from stagewire._devices.tables import Given, ParameterSet
from stagewire._devices.travel import MEASURES
from stagewire._devices.unit import Hindrance, Need, Unit
from stagewire.errors import UnknownScaleError, UnsupportedError

Place: TypeAlias = tuple[int, int | None]
"""Address and channel."""
State: TypeAlias = tuple[str, tuple[str, ...]]
"""A need: the name of its parameter set, and the fields that must be usable."""


def needs_of(unit: Unit) -> tuple[Need, ...]:
    """Return everything that some motion of a unit needs, each once."""
    return tuple({_state(need): need for needs in unit.needs.values() for need in needs}.values())


def needs_at_open(unit: Unit) -> tuple[Need, ...]:
    """Return the needs that are read when a device is opened: those that a message can change."""
    return tuple(need for need in needs_of(unit) if need.table.set is not None)


def faults_in(unit: Unit, need: Need, message: Message) -> tuple[str, ...]:
    """Return why motions cannot succeed while a controller holds the values of a message.

    :param message: reply with the parameters, or the message that wrote them.
    """
    field, states = _hindrances(unit, need.table)
    faults = [
        state.cause for state in states if getattr(message, field) & state.mask == state.value
    ]
    entries = {entry.field: entry for entry in need.table.given}
    for name in need.fields:
        value, entry = getattr(message, name), entries.get(name)
        table = None if entry is None else entry.choices
        if table is not None and issubclass(table, Enumeration):
            listed = ", ".join(f"{member.name} ({member.value})" for member in table)
            if value not in {member.value for member in table}:
                faults.append(f"{name} is {value}, not one of {listed}")
        elif value == 0:
            faults.append(f"{name} is 0")
    return tuple(faults)


def _hindrances(unit: Unit, table: ParameterSet[Any]) -> tuple[str, tuple[Hindrance, ...]]:
    """Return the field that can hinder motions, also in the message that writes it, and its states."""
    return unit.hindrances.get(table.get, ("", ())) if table.get else ("", ())


@dataclass(frozen=True, slots=True)
class Switch:
    """The parameter that enables a channel.

    :param table: parameter set with it.
    :param field: its field.
    :param on: value of an enabled channel.
    :param off: value of a disabled one.
    """

    table: ParameterSet[Any]
    field: str
    on: int
    off: int


def switch_of(unit: Unit) -> Switch | None:
    """Return the parameter that enables the channels of a unit; None if motions need no such parameter."""
    enabling = unit.enabling
    if enabling is not None and enabling.table is not None and not enabling.channels:
        return _switch_in(unit, enabling.table)
    return next(filter(None, (_switch_in(unit, need.table) for need in needs_of(unit))), None)


def check_enabling(unit: Unit, names: Iterable[str]) -> None:
    """Raise :class:`~stagewire.errors.UnsupportedError` for a unit without motor channels to enable.

    :param names: names of the methods of its channels; the error lists those that enable something else.
    """
    if switch_of(unit) is not None or (unit.enabling is not None and unit.enabling.channels):
        return
    calls = [f"{name}()" for name in names if re.match("(get|set)_.*enable|enable_", name)]
    instead = f"; use {' and '.join(calls)}" if calls else ""
    raise UnsupportedError(
        f"a {unit.name} has no motor channel that can be enabled or disabled{instead}"
    )


def _switch_in(unit: Unit, parameters: ParameterSet[Any]) -> Switch | None:
    """Return the field of a parameter set that enables channels; None if it has none."""
    field, states = _hindrances(unit, parameters)
    off = {state.value for state in states}
    for entry in parameters.given:
        table = entry.choices
        if entry.field == field and table and issubclass(table, Enumeration) and len(off) == 1:
            [on] = {member.value for member in table} - off
            return Switch(parameters, field, on, *off)
    return None


class Readiness:
    """The known state of the channels of one controller.

    :param unit: unit of the controller.
    """

    def __init__(self, unit: Unit) -> None:
        self._unit = unit
        self._faults: dict[tuple[Place, State], tuple[str, ...]] = {}
        self._needs: dict[type[Message], list[Need]] = {}
        for need in needs_at_open(unit):
            for cls in _messages(need.table):
                self._needs.setdefault(cls, []).append(need)

    def forget(self) -> None:
        """Forget everything, before it is read again on another line."""
        self._faults.clear()

    def needs(self, message: Message) -> bool:
        """Return whether a message reports or sets something that a motion needs."""
        return type(message) in self._needs

    def learn(self, place: Place, message: Message) -> None:
        """Store what a message reports or sets for a channel."""
        for need in self._needs.get(type(message), ()):
            self._faults[place, _state(need)] = faults_in(self._unit, need, message)

    def known_to_fail(self, place: Place, need: Need) -> bool:
        """Return whether the last known state of a channel prevents the motions with this need."""
        return bool(self._faults.get((place, _state(need))))

    def faults(self, place: Place) -> dict[str, tuple[str, ...]]:
        """Return the known faults of a channel: name of the parameter set -> faults."""
        return {
            name: faults
            for (where, (name, _)), faults in tuple(self._faults.items())
            if where == place and faults
        }


def _state(need: Need) -> State:
    return need.table.name, need.fields


def _messages(table: ParameterSet[Any]) -> set[type[Message]]:
    """Return the messages that report or set the parameters, in all their lengths."""
    found = [table.get, table.set, *(message for message, _ in table.forms)]
    for pair in table.others:
        found += pair
    return {cls for cls in found if cls is not None}


def advice(unit: Unit, name: str, faults: Iterable[str], scales: Scales, limits: Limits) -> str:
    """Return what a user can do about faults in a parameter set.

    :param name: name of the set.
    :param faults: as :func:`faults_in` returns them: those of a value begin with the name of its field.
    :param scales: scales of the channel, with its stage.
    :param limits: limits of the channel.
    """
    switch = switch_of(unit)
    if switch is not None and switch.table.name == name:
        return "call enable()"
    table = next(need.table for need in needs_of(unit) if need.table.name == name)
    assert table.set is not None  # what a motion needs can be written
    fields = {fault.partition(" ")[0] for fault in faults}
    defaults = {} if scales.stage is None else scales.stage.defaults
    if fields <= set(defaults.get(table.set.layout.message, ())):
        return f"call apply_stage_defaults() to write the values of the stage, or set_{name}(...)"
    given, within = [], []
    for entry in table.given:
        if entry.field not in fields:
            continue
        keyword, unit_given = _keyword(entry, scales)
        given.append(f"{keyword}=...")
        measure = MEASURES.get(unit_given, ("", 1))[0]
        within += [
            f"{float(one.value):.10g} {one.unit}"
            for one in limits.ceilings.values()
            if one.unit == measure
        ]
    ends = f", at most {' and '.join(within)}" if within else ""
    return f"call change_{name}({', '.join(given)}){ends}"


def _keyword(entry: Given, scales: Scales) -> tuple[str, str]:
    """Return the keyword for a value and its unit: that of the stage, or counts if the scale is unknown."""
    for keyword, unit, case in entry.ways:
        try:
            scales.of(entry.quantity, unit, case)
        except UnknownScaleError:
            continue
        return keyword, unit
    return entry.keyword, ""
