"""Reads the tables of a PICS, and holds them against the registry."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import partial
from typing import Final

from stagewire.devices import Unit
from stagewire.protocols import CommandProtocol
from stagewire_conformance.device.declared import RACK, facts_of, known_units
from stagewire_conformance.device.pics import BayPics, Pics, Timing
from stagewire_conformance.device.pics.channels import ChannelsReader, unique
from stagewire_conformance.device.pics.values import (
    as_it_is,
    line,
    milliseconds,
    one_of,
    reasons,
    version,
    within,
)
from stagewire_virtual.toml_tables import Table, integer, tables_of, text

__all__ = ["PicsReader"]

_VERSION: Final = 1


class PicsReader:
    """Reads one PICS; what is wrong is noted in its table."""

    def __init__(self, top: Table, digest: str) -> None:
        self._top = top
        self._digest = digest
        self._known = known_units()

    def read(self) -> Pics | None:
        """Return what is declared; None where it cannot be told what it is about."""
        top = self._top
        if top.take("schema_version", integer, None) != _VERSION:
            top.wrong("schema_version", f"expected schema_version = {_VERSION}")
        name = top.take("unit", partial(one_of, "unit", [*self._known]), None)
        protocol = top.take("protocol", text, "")
        if "unit" not in top:
            top.wrong("unit", 'missing; it names the controller, such as unit = "TDC001"')
        if name is None:
            self._pass_over()
            return None
        self._protocol = self._known[name]
        self._is_rack = name == RACK
        self._unit = None if self._is_rack else facts_of(self._protocol).units[name]
        if protocol and protocol != self._protocol.name:
            top.wrong("protocol", f"{name} speaks {self._protocol.name}, not {protocol}")
        bays = self._bays()
        channels = ChannelsReader(top, self._protocol, self._unit, bays).read()
        listed = self._messages(unit for unit in self._units(bays) if unit)
        pics = Pics(
            unit=name,
            protocol=self._protocol.name,
            line=self._line(),
            unsupported=top.take("unsupported", partial(reasons, listed, name), {}),
            channels=channels,
            bays=bays,
            timing=self._timing(),
            firmware=self._firmware(),
            digest=self._digest,
        )
        top.refuse_others()
        return pics

    def _pass_over(self) -> None:
        """Look at what can be looked at without a unit: whether the keys are keys."""
        keys = ("line", "firmware", "unsupported", "channel", "bay", "timing")
        for key in keys:
            self._top.take(key, lambda value: value, None)
        self._top.refuse_others()

    # What stands at the top

    def _line(self) -> str:
        found = self._top.take("line", line, "usb")
        if "line" in self._top and self._is_of_commands:
            self._top.wrong("line", "a controller of commands wants no signs of life on any line")
        return found

    def _firmware(self) -> str:
        firmware = self._top.take("firmware", version, "")
        if "firmware" in self._top and not self._protocol_has_versions():
            self._top.wrong("firmware", "nothing in the document of this unit depends on it")
        return firmware

    def _timing(self) -> Timing:
        values = self._top.take("timing", as_it_is, {})
        table = self._top.inner(values, "[timing]")
        timing = Timing(reply_p99_ms=table.take("reply_p99_ms", milliseconds, None))
        table.refuse_others()
        return timing

    @property
    def _is_of_commands(self) -> bool:
        return isinstance(self._protocol, CommandProtocol)

    def _protocol_has_versions(self) -> bool:
        return any(entry.get("firmware") for entry in self._protocol.registry()["messages"])

    # Bays

    def _bays(self) -> tuple[BayPics, ...] | None:
        top = self._top
        tables = top.take("bay", tables_of("bay"), None)
        has_bays = self._is_rack or (self._unit is not None and self._unit.kind == "rack")
        if tables is not None and not has_bays:
            assert self._unit is not None
            top.wrong("bay", f"{self._unit.name} has no bays; unit = {RACK!r} is a rack of modules")
            return None
        if tables is None:
            if self._is_rack:
                top.wrong("bay", "missing; each bay that is occupied begins with a line [[bay]]")
            return None
        found = [self._bay(top.inner(values, f"bay {at}")) for at, values in enumerate(tables, 1)]
        return tuple(bay for bay in unique(found, top, "bay") if bay)

    def _bay(self, table: Table) -> BayPics | None:
        facts = facts_of(self._protocol)
        modules = {unit.name: unit for unit in facts.units.values() if unit.kind == "bay"}
        own = modules if self._unit is None else {self._unit.name: self._unit}
        count = len((self._unit or next(iter(modules.values()))).bays)
        number = table.take("number", partial(within, 1, count), None)
        if "number" not in table:
            table.wrong("number", f"missing; bays are counted from 1 to {count}")
        name = table.take("unit", partial(one_of, "unit", [*own]), "")
        if self._is_rack and "unit" not in table:
            table.wrong("unit", f"missing; it is one of {', '.join(sorted(modules))}")
        module = own.get(name) or self._unit
        listed = self._messages([module]) if module else frozenset[str]()
        unsupported = table.take("unsupported", partial(reasons, listed, name), {})
        table.refuse_others()
        if number is None:
            return None
        return BayPics(number=number, unit=name, unsupported=unsupported)

    def _units(self, bays: Sequence[BayPics] | None) -> list[Unit | None]:
        units = facts_of(self._protocol).units
        return [self._unit, *(units[bay.unit] for bay in bays or () if bay.unit)]

    def _messages(self, units: Iterable[Unit]) -> frozenset[str]:
        return frozenset[str]().union(*(unit.messages for unit in units))
