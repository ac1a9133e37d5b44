"""Reads the tables of the channels of a PICS, and holds them against the registry."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any, Final, TypeVar

from stagewire.devices import Unit
from stagewire.errors import UnknownScaleError
from stagewire.protocols import CommandProtocol, Protocol
from stagewire_conformance.device.declared import axes_of, facts_of
from stagewire_conformance.device.permissions import RangeError
from stagewire_conformance.device.pics import BayPics, ChannelPics
from stagewire_conformance.device.pics.values import (
    factor,
    occupied,
    one_of,
    refuse,
    span,
    within,
)
from stagewire_conformance.device.places import connected, moves_stages
from stagewire_virtual.toml_tables import Table, flag, tables_of, text

__all__ = ["ChannelsReader", "unique"]

_STAGE_KEYS: Final = ("stage", "counts_per_mm", "travel", "homes", "limit_switches")

_T = TypeVar("_T")


class ChannelsReader:
    """Reads what is connected to the channels, or to the axes; what is wrong is noted in their tables.

    :param top: the table of the whole PICS.
    :param unit: the controller; None: a rack of modules.
    :param bays: those that are occupied; None: all, or there are none.
    """

    def __init__(
        self, top: Table, protocol: Protocol, unit: Unit | None, bays: Sequence[BayPics] | None
    ) -> None:
        self._top = top
        self._protocol = protocol
        self._unit = unit
        self._bays = bays

    def read(self) -> tuple[ChannelPics, ...]:
        """Return what is declared of each."""
        tables = self._top.take("channel", tables_of("channel"), ())
        found = [
            self._channel(self._top.inner(values, f"channel {at}"))
            for at, values in enumerate(tables, 1)
        ]
        return tuple(each for each in unique(found, self._top, "channel") if each)

    @property
    def _is_of_commands(self) -> bool:
        return isinstance(self._protocol, CommandProtocol)

    def _channel(self, table: Table) -> ChannelPics | None:
        bay, axis = self._bay_of(table), self._axis_of(table)
        unit = self._unit_in(bay)
        number = self._number_of(table, unit)
        stated = ChannelPics(
            number=number or 1,
            bay=bay,
            axis=axis,
            stage=table.take("stage", partial(self._stage, unit), ""),
            counts_per_mm=table.take("counts_per_mm", factor, None),
            travel=table.take("travel", span, None),
            homes=table.take("homes", flag, True),
            limit_switches=table.take("limit_switches", flag, True),
        )
        table.refuse_others()
        if unit is not None:
            self._check_stage(table, unit, stated)
        return None if number is None else stated

    def _bay_of(self, table: Table) -> int | None:
        """Return the bay of a channel; None for what is in no bay, and where it cannot be told."""
        there = self._occupied()
        bay = table.take("bay", partial(occupied, there), None)
        if there and "bay" not in table:
            table.wrong("bay", f"missing; of a rack it is one of {', '.join(map(str, there))}")
        return bay

    def _occupied(self) -> list[int]:
        if self._bays is not None:
            return [bay.number for bay in self._bays]
        if self._unit is None or self._unit.kind != "rack":
            return []
        return [*range(1, len(self._unit.bays) + 1)]

    def _axis_of(self, table: Table) -> str | None:
        if not isinstance(self._protocol, CommandProtocol):
            return table.take("axis", partial(refuse, "there are channels, and no axes"), None)
        axes = axes_of(self._protocol)
        axis = table.take("axis", partial(one_of, "axis", [*axes]), None)
        if "axis" not in table:
            table.wrong("axis", f"missing; it is one of {', '.join(axes)}")
        return axis

    def _number_of(self, table: Table, unit: Unit | None) -> int | None:
        if self._is_of_commands:
            table.take("number", partial(refuse, "there are axes, and no channels"), None)
            return 1
        count = 1 if unit is None else unit.channels
        return table.take("number", partial(within, 1, count), None if "number" in table else 1)

    def _unit_in(self, bay: int | None) -> Unit | None:
        """Return the unit that a channel belongs to; None where it cannot be told."""
        units = facts_of(self._protocol).units
        named = next(
            (each.unit for each in self._bays or () if each.number == bay and each.unit), ""
        )
        return units[named] if named else self._unit

    def _stage(self, unit: Unit | None, value: Any) -> str:
        if self._is_of_commands:
            return text(value)  # which is refused with the others
        known = [entry["name"] for entry in self._protocol.registry()["stages"]]
        return one_of("stage", known if unit is None else unit.stages or known, value)

    def _check_stage(self, table: Table, unit: Unit, stated: ChannelPics) -> None:
        """Note what cannot be said of the stage on a channel of a unit."""
        given = [key for key in _STAGE_KEYS if key in table]
        if given and not moves_stages(unit):
            table.wrong(given, f"{unit.name} moves no stage")
            return
        scaled = [key for key in ("stage", "counts_per_mm") if key in table]
        if scaled and self._is_of_commands:
            table.wrong(scaled, f"{unit.name} counts in tenths of a micrometre, whatever its stage")
            return
        if len(scaled) > 1:
            table.wrong(scaled, "give one of them, not both")
            return
        if stated.stage and stated.stage not in unit.stages:
            table.wrong("stage", f"the scales of {stated.stage} on {unit.name} are not known")
            return
        try:
            connected(unit, facts_of(self._protocol), stated)
        except (RangeError, UnknownScaleError) as error:
            table.wrong("travel", f"{error}; give stage, or counts_per_mm, or a travel in counts")


def unique(found: Sequence[_T | None], top: Table, key: str) -> Sequence[_T | None]:
    """Note what is there twice."""
    seen: dict[object, int] = {}
    for at, each in enumerate(found, 1):
        place = (
            (each.bay, each.axis, each.number)
            if isinstance(each, ChannelPics)
            else getattr(each, "number", None)
        )
        if each is not None and seen.setdefault(place, at) != at:
            top.wrong(key, f"{key} {at} is the same as {key} {seen[place]}")
    return found
