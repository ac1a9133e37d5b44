"""Read a PICS from a TOML file, and compare it with the registry.

An error lists all mistakes, each with its key and what was expected. ``spec/schema/pics.schema.json`` has the
keys for editors. Facts from the registry, such as the messages of a unit, are checked only here.
"""

from __future__ import annotations

import hashlib
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final, TypeVar

from stagewire.devices import Unit
from stagewire.errors import UnknownScaleError
from stagewire.protocols import CommandProtocol, Protocol
from stagewire.quantities import Stage, find_stages
from stagewire_conformance.device.declaration import (
    axes_of,
    facts_of,
    issues_of,
    known_units,
)
from stagewire_conformance.device.errors import PicsError
from stagewire_conformance.device.permissions import RangeError
from stagewire_conformance.device.pics import BayPics, Certificate, ChannelPics, Pics, Timing
from stagewire_conformance.device.pics_values import (
    as_it_is,
    channel_in,
    factor,
    line,
    milliseconds,
    occupied,
    one_line,
    one_of,
    reasons,
    refuse,
    span,
    version,
    within,
)
from stagewire_conformance.device.targets import RACK, attachment_of, moves_stages
from stagewire_virtual.toml_tables import Table, flag, integer, tables_of, text

_STAGE_KEYS: Final = ("stage", "counts_per_mm", "travel", "homes", "limit_switches")

_LONGEST_NAME: Final = 20  # characters of a value that names a table

_T = TypeVar("_T")


class ChannelsReader:
    """Reads the channels or axes. Problems are noted in their tables.

    :param top: the table of the whole PICS.
    :param unit: the controller; None for a rack of modules.
    :param bays: the occupied bays; None if all are occupied, or if the unit has no bays.
    :param own: the stages of the user, by name.
    """

    def __init__(
        self,
        top: Table,
        protocol: Protocol,
        unit: Unit | None,
        bays: Sequence[BayPics] | None,
        own: Mapping[str, Stage],
    ) -> None:
        self._own = {name.upper(): stage for name, stage in own.items()}
        self._top = top
        self._protocol = protocol
        self._unit = unit
        self._bays = bays

    def read(self) -> tuple[ChannelPics, ...]:
        """Return the declared channels or axes."""
        tables = self._top.take("channel", tables_of("channel"), ())
        found = [
            self._channel(self._top.inner(values, _table_label("channel", values, at)))
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
        stage = table.take("stage", partial(self._stage, unit), "")
        stated = ChannelPics(
            number=number or 1,
            bay=bay,
            axis=axis,
            stage=stage,
            own=self._own.get(stage.upper()),
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
        """Return the bay of a channel; None if it has none or an invalid one."""
        there = self._occupied()
        bay = table.take("bay", partial(occupied, there), None)
        if there and "bay" not in table:
            table.wrong("bay", f"missing; the occupied bays are {', '.join(map(str, there))}")
        return bay

    def _occupied(self) -> list[int]:
        if self._bays is not None:
            return [bay.number for bay in self._bays]
        if self._unit is None or self._unit.kind != "rack":
            return []
        return [*range(1, len(self._unit.bays) + 1)]

    def _axis_of(self, table: Table) -> str | None:
        if not isinstance(self._protocol, CommandProtocol):
            return table.take("axis", partial(refuse, "this unit has channels, not axes"), None)
        axes = axes_of(self._protocol)
        axis = table.take("axis", partial(one_of, "axis", [*axes]), None)
        if "axis" not in table:
            table.wrong("axis", f"missing; the axes are {', '.join(axes)}")
        return axis

    def _number_of(self, table: Table, unit: Unit | None) -> int | None:
        if self._is_of_commands:
            table.take("number", partial(refuse, "this unit has axes, not channels"), None)
            return 1
        return table.take("number", partial(channel_in, unit), None if "number" in table else 1)

    def _unit_in(self, bay: int | None) -> Unit | None:
        """Return the unit that a channel belongs to; None if unknown."""
        units = facts_of(self._protocol).units
        named = next(
            (each.unit for each in self._bays or () if each.number == bay and each.unit), ""
        )
        return units[named] if named else self._unit

    def _stage(self, unit: Unit | None, value: Any) -> str:
        if self._is_of_commands:
            return text(value)  # refused later, with the other stage keys
        own = self._own.get(text(value).upper())
        if own is not None:
            return own.name
        found = find_stages(self._protocol.package, text(value))
        if len(found) == 1:
            value = found[0].name  # it may be a name in the catalogue
        known = [entry["name"] for entry in self._protocol.registry()["stages"]]
        usable = known if unit is None else unit.stages or known
        return one_of("stage", [*usable, *(stage.name for stage in self._own.values())], value)

    def _check_stage(self, table: Table, unit: Unit, stated: ChannelPics) -> None:
        """Note invalid declarations of the stage on a channel."""
        given = [key for key in _STAGE_KEYS if key in table]
        if given and not moves_stages(unit):
            table.wrong(given, f"{unit.name} does not move a stage")
            return
        scaled = [key for key in ("stage", "counts_per_mm") if key in table]
        if scaled and self._is_of_commands:
            table.wrong(scaled, f"{unit.name} counts in tenths of a micrometre with every stage")
            return
        if len(scaled) > 1:
            table.wrong(scaled, "give only one of them")
            return
        if stated.stage and stated.own is None and stated.stage not in unit.stages:
            table.wrong("stage", f"the scales of {stated.stage} on {unit.name} are not known")
            return
        try:
            attachment_of(unit, facts_of(self._protocol), stated)
        except (RangeError, UnknownScaleError) as error:
            table.wrong("travel", f"{error}; give stage, counts_per_mm, or a travel in counts")


def unique(found: Sequence[_T | None], top: Table, key: str) -> Sequence[_T | None]:
    """Note duplicates."""
    seen: dict[object, int] = {}
    for at, each in enumerate(found, 1):
        place = (
            (each.bay, each.axis, each.number)
            if isinstance(each, ChannelPics)
            else getattr(each, "number", None)
        )
        if each is not None and seen.setdefault(place, at) != at:
            top.wrong(key, f"table {at} of [[{key}]] is a duplicate of table {seen[place]}")
    return found


def _table_label(key: str, values: Mapping[str, Any], at: int) -> str:
    """Return the label of a table of a list: the keys that name it, or otherwise its position."""
    named = {name: values[name] for name in ("bay", "axis", "number") if name in values}
    if named and all(isinstance(value, str | int) for value in named.values()):
        return f"[[{key}]] with " + " and ".join(
            f"{name} = {repr(value)[:_LONGEST_NAME]}" for name, value in named.items()
        )
    return f"table {at} of [[{key}]]"


_VERSION: Final = 1


class PicsReader:
    """Reads one PICS. Problems are noted in its table."""

    def __init__(self, top: Table, digest: str, own: Mapping[str, Stage]) -> None:
        self._top = top
        self._own = own
        self._digest = digest
        self._known = known_units()

    def read(self) -> Pics | None:
        """Return the declaration; None if its unit is missing or unknown."""
        top = self._top
        if top.take("schema_version", integer, None) != _VERSION:
            top.wrong("schema_version", f"expected schema_version = {_VERSION}")
        name = top.take("unit", partial(one_of, "unit", [*self._known]), None)
        protocol = top.take("protocol", text, "")
        if "unit" not in top:
            top.wrong("unit", 'missing; it names the controller, as in unit = "TDC001"')
        if name is None:
            self._pass_over()
            return None
        self._protocol = self._known[name]
        self._is_rack = name == RACK
        self._unit = None if self._is_rack else facts_of(self._protocol).units[name]
        if protocol and protocol != self._protocol.name:
            top.wrong("protocol", f"{name} uses {self._protocol.name}, not {protocol}")
        bays = self._bays()
        channels = ChannelsReader(top, self._protocol, self._unit, bays, self._own).read()
        listed = self._messages(unit for unit in self._units(bays) if unit)
        pics = Pics(
            unit=name,
            protocol=self._protocol.name,
            line=self._line(),
            unsupported=top.take("unsupported", partial(reasons, listed, name), {}),
            channels=channels,
            bays=bays,
            motherboard=self._motherboard(),
            certificate=self._certificate(),
            timing=self._timing(),
            issue=self._issue(name),
            firmware=self._firmware(),
            digest=self._digest,
        )
        top.refuse_others()
        return pics

    def _pass_over(self) -> None:
        """Check the names of the keys, which is all that is possible without a unit."""
        keys = (
            "line",
            "issue",
            "firmware",
            "unsupported",
            "channel",
            "bay",
            "motherboard",
            "certificate",
            "timing",
        )
        for key in keys:
            self._top.take(key, lambda value: value, None)
        self._top.refuse_others()

    # Keys at the top

    def _line(self) -> str:
        found = self._top.take("line", line, "usb")
        if "line" in self._top and self._is_of_commands:
            self._top.wrong("line", "this protocol has no keep-alive messages; omit the key")
        return found

    def _issue(self, name: str) -> str:
        return self._top.take(
            "issue", partial(one_of, "issue", issues_of(self._protocol, name)), ""
        )

    def _firmware(self) -> str:
        firmware = self._top.take("firmware", version, "")
        if "firmware" in self._top and not self._protocol_has_versions():
            self._top.wrong(
                "firmware", "the document of this unit does not depend on it; omit the key"
            )
        return firmware

    def _certificate(self) -> Certificate:
        table = self._top.inner(self._top.take("certificate", as_it_is, {}), "[certificate]")
        lines = {name: table.take(name, one_line, "") for name in Certificate.__dataclass_fields__}
        table.refuse_others()
        return Certificate(**lines)

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

    def _motherboard(self) -> bool:
        found = self._top.take("motherboard", flag, True)
        if "motherboard" in self._top and self._unit and not self._unit.bays:
            self._top.wrong("motherboard", f"{self._unit.name} has no bays; omit the key")
        return found

    def _bays(self) -> tuple[BayPics, ...] | None:
        top = self._top
        tables = top.take("bay", tables_of("bay"), None)
        has_bays = self._is_rack or (self._unit is not None and self._unit.kind == "rack")
        if tables is not None and not has_bays:
            assert self._unit is not None
            top.wrong(
                "bay", f"{self._unit.name} has no bays; for a rack of modules use unit = {RACK!r}"
            )
            return None
        if tables is None:
            if self._is_rack:
                top.wrong("bay", "missing; list each occupied bay in a table [[bay]]")
            return None
        found = [
            self._bay(top.inner(values, _table_label("bay", values, at)))
            for at, values in enumerate(tables, 1)
        ]
        return tuple(bay for bay in unique(found, top, "bay") if bay)

    def _bay(self, table: Table) -> BayPics | None:
        facts = facts_of(self._protocol)
        modules = {unit.name: unit for unit in facts.units.values() if unit.kind == "bay"}
        own = modules if self._unit is None else {self._unit.name: self._unit}
        count = len((self._unit or next(iter(modules.values()))).bays)
        number = table.take("number", partial(within, 1, count), None)
        if "number" not in table:
            table.wrong("number", f"missing; bays are numbered 1 to {count}")
        name = table.take("unit", partial(one_of, "unit", [*own]), "")
        if self._is_rack and "unit" not in table:
            table.wrong("unit", f"missing; the modules are {', '.join(sorted(modules))}")
        module = own.get(name) or self._unit
        listed = self._messages([module]) if module else frozenset[str]()
        of = module.name if module else "a module"
        unsupported = table.take("unsupported", partial(reasons, listed, of), {})
        table.refuse_others()
        if number is None:
            return None
        return BayPics(number=number, unit=name, unsupported=unsupported)

    def _units(self, bays: Sequence[BayPics] | None) -> list[Unit | None]:
        units = facts_of(self._protocol).units
        return [self._unit, *(units[bay.unit] for bay in bays or () if bay.unit)]

    def _messages(self, units: Iterable[Unit]) -> frozenset[str]:
        return frozenset[str]().union(*(unit.messages for unit in units))


def read_pics(path: str | Path, own: Mapping[str, Stage] = MappingProxyType({})) -> Pics:
    """Read a PICS from a TOML file.

    :param own: the stages of the user that it may name, by name.

    Raises :class:`.PicsError` with all problems.
    """
    try:
        contents = Path(path).read_bytes()
    except OSError as error:
        raise PicsError([f"{path}: cannot read the file: {error.strerror or error}"]) from error
    return parse_pics(contents, str(path), own)


def parse_pics(
    contents: bytes,
    source: str = "pics.toml",
    own: Mapping[str, Stage] = MappingProxyType({}),
) -> Pics:
    """Read a PICS from the contents of its file.

    :param source: the name of the file; begins each problem.
    :param own: the stages of the user that it may name, by name.

    Raises :class:`.PicsError` with all problems.
    """
    try:
        values = tomllib.loads(contents.decode("utf-8-sig"))
    except RecursionError as error:
        raise PicsError([f"{source}: nested too deeply"]) from error
    except ValueError as error:  # of TOML or of UTF-8
        raise PicsError([f"{source}: not a TOML file: {error}"]) from error
    problems: list[str] = []
    pics = PicsReader(
        Table(values, source, problems), hashlib.sha256(contents).hexdigest(), own
    ).read()
    if problems or pics is None:
        raise PicsError(problems)
    return pics
