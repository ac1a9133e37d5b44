"""What the registry says of a unit, as the virtual controllers need it."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from stagewire.protocol import Protocol, available_protocols, load_protocol
from stagewire_virtual.errors import UnknownUnitError

__all__ = ["Unit", "all_units", "find_unit", "units_of"]


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
