"""The base of virtual controllers: bytes in, bytes out, and a clock.

A :class:`Unit` is the registry's description of a unit, in the form that virtual controllers need.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from stagewire.protocols import Protocol, available_protocols, load_protocol
from stagewire_virtual.clock import Clock
from stagewire_virtual.errors import UnknownUnitError, VirtualError


@dataclass(frozen=True, eq=False)
class Unit:
    """A unit of a protocol's registry; equal only to itself.

    :param name: its name, such as ``TDC001``.
    :param protocol: its protocol.
    :param facts: its entry in the registry's JSON.
    :param family: the entry of its family; empty without one.
    :param registry: the whole registry; shared, do not modify it.
    """

    name: str
    protocol: Protocol
    facts: Mapping[str, Any] = field(repr=False)
    family: Mapping[str, Any] = field(repr=False)
    registry: Mapping[str, Any] = field(repr=False)

    @functools.cached_property
    def messages(self) -> frozenset[str]:
        """The names of the messages that it accepts and sends."""
        return frozenset(self.facts["messages"])

    @functools.cached_property
    def _entries(self) -> Mapping[str, Mapping[str, Any]]:
        return {entry["name"]: entry for entry in self.registry["messages"]}

    def message(self, name: str) -> Mapping[str, Any]:
        """Return the registry's entry of a message; raise :class:`KeyError` for an unknown name."""
        return self._entries[name]


def units_of(protocol: Protocol, registry: Mapping[str, Any] | None = None) -> dict[str, Unit]:
    """Return the units of a protocol by name, from ``registry`` instead of its own if one is given."""
    return dict(_own_units(protocol) if registry is None else _units(protocol, registry))


@functools.cache  # so that all controllers of a unit share the values that it caches
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
    """Return the units of all installed protocols by name; packages are searched only once."""
    return dict(_installed_units())


@functools.cache  # searching the installed packages takes longer than making a controller
def _installed_units() -> Mapping[str, Unit]:
    found: dict[str, Unit] = {}
    for name in available_protocols():
        found.update(units_of(load_protocol(name)))
    return found


def find_unit(name: str) -> Unit:
    """Return the unit of an installed protocol with this name, in any case.

    Raises :class:`~stagewire_virtual.errors.UnknownUnitError` if no unit has this name, and
    :class:`~stagewire_virtual.errors.VirtualError` for a unit that the registry lists as unsupported.
    """
    units = _installed_units()
    unit = units.get(name.upper())
    if unit is None:
        reason = _unsupported().get(name.upper())
        if reason is not None:
            raise VirtualError(f"{name} cannot be simulated: {reason}")
        raise UnknownUnitError(name, sorted(units))
    return unit


@functools.cache
def _unsupported() -> Mapping[str, str]:
    """Return the units that the registries of installed protocols list as unsupported, with the reasons."""
    return {
        unit: entry["reason"]
        for name in available_protocols()
        for unit, entry in load_protocol(name).registry().get("unsupported", {}).items()
    }


@dataclass(frozen=True, slots=True)
class Row:
    """One line of the live table: a channel or axis and its present state.

    :param part: the channel or axis, such as ``bay 1, channel 1`` or ``axis X``.
    :param position: its position with the unit, such as ``1.2500 mm`` or ``34304 counts``.
    :param state: its state in words: ``moving forward``, ``homed``.
    """

    part: str
    position: str
    state: str


class Instrument:
    """Base class of virtual controllers and of replays, without a line.

    A server passes the bytes of the host to :meth:`receive`, sets :attr:`on_send` to a callback that is
    called with each frame of the controller, and runs the clock. No bytes of a host make an instrument raise.

    :param unit: its unit in the registry.
    :param clock: its clock, which several instruments may share.
    """

    def __init__(self, unit: Unit, clock: Clock) -> None:
        self.unit = unit
        self.clock = clock
        self.on_send: Callable[[bytes], None] = ignore
        self.on_refusal: Callable[[str], None] = ignore
        """Called with a sentence that says why a request of the host was refused; for logs."""

    @classmethod
    def why_not(cls, unit: Unit) -> str:
        """Return why a unit cannot be simulated yet; empty if it can."""
        return ""

    @property
    def units(self) -> Sequence[Unit]:
        """The unit, and the units in its bays."""
        return [self.unit]

    def host_came(self) -> None:
        """Note that a host has connected. By default this has no effect."""

    def receive(self, data: bytes) -> None:
        """Process bytes from the host, in any chunks."""
        raise NotImplementedError

    def power_cycle(self) -> None:
        """Switch off and on. Only the EEPROM and the positions of the stages are kept."""
        raise NotImplementedError

    def rows(self) -> Sequence[Row]:
        """Return the rows of the live table."""
        raise NotImplementedError

    def stick(self, part: str, stuck: bool) -> None:
        """Block an axis, or release it; ``part`` is named as in :class:`Row`.

        Raises :class:`~stagewire_virtual.errors.UnknownPartError` for a part that does not exist or does not
        move.
        """
        raise NotImplementedError


def ignore(*_: object) -> None:
    """Do nothing; the default callback."""
