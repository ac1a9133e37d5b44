"""A virtual controller without a link: bytes in, bytes out, and a clock.

A :class:`Unit` is what the registry says of one, as virtual controllers need it.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from stagewire.protocols import Protocol, available_protocols, load_protocol
from stagewire_virtual.clock import Clock
from stagewire_virtual.errors import UnknownUnitError


@dataclass(frozen=True, eq=False)
class Unit:
    """A unit of a protocol's registry; equal only to itself.

    :param name: such as ``TDC001``.
    :param protocol: the protocol that it speaks.
    :param facts: its entry in the registry's JSON.
    :param family: the entry of its family; empty where it has none.
    :param registry: the whole registry; shared, not to be modified.
    """

    name: str
    protocol: Protocol
    facts: Mapping[str, Any] = field(repr=False)
    family: Mapping[str, Any] = field(repr=False)
    registry: Mapping[str, Any] = field(repr=False)

    @functools.cached_property
    def messages(self) -> frozenset[str]:
        """The names of the messages that it takes and gives."""
        return frozenset(self.facts["messages"])

    @functools.cached_property
    def _entries(self) -> Mapping[str, Mapping[str, Any]]:
        return {entry["name"]: entry for entry in self.registry["messages"]}

    def message(self, name: str) -> Mapping[str, Any]:
        """Return the registry's entry of a message; raises :class:`KeyError` for a name that it has not."""
        return self._entries[name]


def units_of(protocol: Protocol, registry: Mapping[str, Any] | None = None) -> dict[str, Unit]:
    """Return the units of a protocol by name; of ``registry`` if one is given instead of its own."""
    return dict(_own_units(protocol) if registry is None else _units(protocol, registry))


@functools.cache  # what is looked up once for a unit then serves all its controllers
def _own_units(protocol: Protocol) -> Mapping[str, Unit]:
    return _units(protocol, protocol.registry())


def _units(protocol: Protocol, registry: Mapping[str, Any]) -> dict[str, Unit]:
    families = registry["families"]
    return {
        entry["name"]: Unit(
            entry["name"], protocol, entry, families.get(entry.get("family"), {}), registry
        )
        for entry in registry["units"]
    }


def all_units() -> dict[str, Unit]:
    """Return the units of all protocols that are installed, by name; packages are looked for once."""
    return dict(_installed_units())


@functools.cache  # to look through what is installed takes longer than to make a controller
def _installed_units() -> Mapping[str, Unit]:
    found: dict[str, Unit] = {}
    for name in available_protocols():
        found.update(units_of(load_protocol(name)))
    return found


def find_unit(name: str) -> Unit:
    """Return a unit of an installed protocol, by its name in any case.

    Raises :class:`~stagewire_virtual.errors.UnknownUnitError` when there is none.
    """
    units = _installed_units()
    unit = units.get(name.upper())
    if unit is None:
        raise UnknownUnitError(name, sorted(units))
    return unit


@dataclass(frozen=True, slots=True)
class Row:
    """One line of the live table: a channel or axis, and what it does at this instant.

    :param part: such as ``bay 1, channel 1`` or ``axis X``.
    :param position: where it is, with its unit, such as ``1.2500 mm`` or ``34304 counts``.
    :param state: what it does, in words: ``moving forward``, ``homed``.
    """

    part: str
    position: str
    state: str


class Instrument:
    """A virtual controller without a line: the base of all of them, and of what is played in place of one.

    Whoever serves it feeds what the host sends to :meth:`receive`, sets :attr:`on_send` to take what the
    controller says, one call for each frame, and lets the clock go on. Nothing that a host sends makes it
    raise.

    :param unit: what the registry says of it.
    :param clock: its time; several may share one.
    """

    def __init__(self, unit: Unit, clock: Clock) -> None:
        self.unit = unit
        self.clock = clock
        self.on_send: Callable[[bytes], None] = ignore
        self.on_refusal: Callable[[str], None] = ignore
        """Told in a sentence why something that the host sent was not done; for logs."""

    @property
    def units(self) -> Sequence[Unit]:
        """All that speak here: the unit, and what is in its bays."""
        return [self.unit]

    def host_came(self) -> None:
        """Hear that a host has come; what has no wire for that does not notice."""

    def receive(self, data: bytes) -> None:
        """Take what the host sends, cut at any byte."""
        raise NotImplementedError

    def power_cycle(self) -> None:
        """Switch it off and on: all is forgotten but what is in its EEPROM and where its stages stand."""
        raise NotImplementedError

    def rows(self) -> Sequence[Row]:
        """Return what the live table shows."""
        raise NotImplementedError

    def stick(self, part: str, stuck: bool) -> None:
        """Let an axis stick, or free it; ``part`` is named as in :class:`Row`.

        Raises :class:`~stagewire_virtual.errors.UnknownPartError` for a part that it has not, and for one
        that moves nothing.
        """
        raise NotImplementedError


def ignore(*_: object) -> None:
    """Take a callback, such as of bytes that are said, while nothing is connected to it."""
