"""Benches: virtual controllers that are served together, described by a file or a command line.

A bench is read from TOML tables; all errors are reported together. The functions at the top convert values:
names of units and stages, endpoints, and faults.
"""

from __future__ import annotations

import difflib
import functools
import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any, Final

from stagewire import Stage
from stagewire.errors import StagewireError
from stagewire.quantities import find_stages
from stagewire_virtual.clock import Clock, SteppedClock
from stagewire_virtual.errors import BadOptionError, BenchError, UnknownUnitError
from stagewire_virtual.factory import Blueprint
from stagewire_virtual.faults.fault import Fault, parse_fault
from stagewire_virtual.instrument import Unit, find_unit
from stagewire_virtual.options import (
    LinkKind,
    Options,
    Settings,
    check_stage,
    parse_link_kind,
    stage_units,
)
from stagewire_virtual.serving.endpoints import Endpoint, PtyEndpoint, TcpEndpoint, parse_tcp
from stagewire_virtual.serving.link import Observer, ServedLink
from stagewire_virtual.thorlabs_apt.rack import RACK
from stagewire_virtual.toml_tables import (
    Convert,
    Table,
    flag,
    integer,
    key_label,
    list_of,
    table_of,
    tables_of,
    text,
)


@dataclass(frozen=True, slots=True)
class BenchUnit:
    """One controller of a bench.

    :param blueprint: the controller to make.
    :param place: the endpoint to serve it at.
    :param label: a name for people.
    """

    blueprint: Blueprint
    place: Endpoint
    label: str

    def link(self, clock: Clock, observer: Observer | None = None) -> ServedLink:
        """Make the controller and return its link, which a server then opens."""
        return self.place.link(self.blueprint.make(clock), label=self.label, observer=observer)


@dataclass(frozen=True, slots=True)
class Bench:
    """Controllers that are served together, in the order of the description."""

    units: tuple[BenchUnit, ...]


_ONE_OF_TWO: Final = 0.5
"""How similar a stage name must be to be suggested: one of two letters."""


def stage_of(units: Sequence[Unit], own: Mapping[str, Stage], value: Any) -> Stage | None:
    """Return the stage with this name of the protocol of the units; None if no unit is known.

    :param own: the stages of the user, by name.
    :param value: the name, or a stage of the user.
    """
    if isinstance(value, Stage):
        return value
    name = text(value)
    for known_name, stage in own.items():
        if known_name.upper() == name.upper():
            check_stage(stage, [unit.name for unit in units])
            return stage
    if not units:
        return None
    protocol = units[0].protocol
    found = find_stages(protocol.package, name)
    if len(found) > 1:
        several = ", ".join(each.name for each in found)
        raise BadOptionError(f"{name} is the catalogue name of several stages; choose {several}")
    if not found:
        known = {stage.upper(): stage for stage in _stages_on(units)}
        close = difflib.get_close_matches(name.upper()[:40], known, n=1, cutoff=_ONE_OF_TWO)
        hint = f"; did you mean {known[close[0]]}?" if close else ""
        on = " or ".join(unit.name for unit in units)
        choices = f"available on {on}: {', '.join(known.values())}" if known else "none available"
        raise BadOptionError(f"{protocol.title} has no stage {name}{hint} ({choices})")
    check_stage(found[0], [unit.name for unit in units])
    return found[0]


def _stages_on(units: Sequence[Unit]) -> list[str]:
    """Return the names of the stages whose scales are known on any of the units."""
    names = {unit.name for unit in units}
    entries = units[0].registry["stages"]
    stages = [find_stages(units[0].protocol.package, entry["name"])[0] for entry in entries]
    return sorted(stage.name for stage in stages if names & stage_units(stage))


def tcp_endpoint(bind: str | None, value: Any) -> TcpEndpoint:
    """Return the endpoint of a port: ``4001`` or ``"127.0.0.1:4001"``."""
    return parse_tcp(str(value), bind)


def pty_endpoint(value: Any) -> PtyEndpoint | None:
    """Return the endpoint of a pseudo-terminal, for True or the name of a symbolic link; None for False."""
    if isinstance(value, bool):
        return PtyEndpoint() if value else None
    if not isinstance(value, str) or not value:
        raise BadOptionError("expected true, or the name of a symbolic link to create")
    return PtyEndpoint(Path(value))


def unit_named(value: Any) -> Unit:
    """Return a unit by name; the error for an unknown name also lists RACK."""
    try:
        return find_unit(text(value))
    except UnknownUnitError as error:
        raise UnknownUnitError(error.name, sorted([*error.known, RACK])) from None


def module_named(value: Any) -> Unit | None:
    """Return a module by name; None for an empty name, which is an empty bay."""
    name = text(value)
    return find_unit(name) if name else None


def link_kind(value: Any) -> LinkKind:
    """Return a kind of line by name."""
    return parse_link_kind(text(value))


def fault_of(value: Any) -> Fault:
    """Return the fault that a string describes."""
    return parse_fault(text(value))


_SHORT: Final = ("stage", "travel", "position")
"""Keys of a unit that apply to every channel."""


def load_bench(
    path: str | Path, bind: str | None = None, own_stages: Mapping[str, Stage] | None = None
) -> Bench:
    """Read a bench from a TOML file.

    :param bind: the network address on which its TCP ports may listen; see
        :func:`~stagewire_virtual.serving.endpoints.parse_tcp`.
    :param own_stages: the stages of the user that it may name, by name.

    Raises :class:`~stagewire_virtual.errors.BenchError` with all problems of the file.
    """
    try:
        contents = tomllib.loads(Path(path).read_text(encoding="utf-8"))
    except OSError as error:
        raise BenchError([f"{path}: cannot be read: {error.strerror or error}"]) from error
    except RecursionError as error:
        raise BenchError([f"{path}: nested too deeply"]) from error
    except ValueError as error:  # of TOML or of UTF-8
        raise BenchError([f"{path}: not a valid TOML file: {error}"]) from error
    problems: list[str] = []
    own = own_stages or {}
    top = Table(contents, str(path), problems)
    tables = top.take("unit", tables_of("unit"), ())
    top.refuse_others()
    if not tables and not problems:
        top.wrong("unit", "missing; each unit begins with a line [[unit]]")
    return _bench(tables, str(path), bind, problems, key_label, own)


def make_bench(
    tables: Sequence[Mapping[str, Any]],
    source: str = "the command line",
    bind: str | None = None,
    called: Callable[[str], str] = key_label,
) -> Bench:
    """Make a bench from tables with the keys of a TOML file: ``[{"name": "TDC001", "tcp": "4001"}]``.

    :param source: the origin of the tables, with which each problem begins.
    :param called: returns the name of a key in a problem.

    Raises :class:`~stagewire_virtual.errors.BenchError` with all problems of the tables.
    """
    return _bench(tables, source, bind, [], called, {})


def _bench(
    tables: Sequence[Mapping[str, Any]],
    source: str,
    bind: str | None,
    problems: list[str],
    called: Callable[[str], str],
    own: Mapping[str, Stage],
) -> Bench:
    units: list[BenchUnit] = []
    taken: dict[str, str] = {}
    for number, values in enumerate(tables, 1):
        name = values.get("name")
        shown = f" ({name})" if isinstance(name, str) else ""
        table = Table(values, f"{source}: unit {number}{shown}", problems, called)
        unit = _unit(table, number - 1, bind, own)
        if unit is not None:
            _check_place(table, unit.place, taken)
            units.append(unit)
    if problems:
        raise BenchError(problems)
    return Bench(tuple(units))


def _unit(table: Table, index: int, bind: str | None, own: Mapping[str, Stage]) -> BenchUnit | None:
    """Return the unit that a table describes; None if its kind is unknown."""
    name = table.take("name", text, "")
    if "name" not in table:
        table.wrong("name", f"missing; give a unit such as TDC001, or {RACK} for modules in bays")
    is_rack = name.upper() == RACK
    unit = None if is_rack else table.take("name", unit_named, None) if name else None
    bays = table.take("bays", list_of(module_named), None) if is_rack else _no_bays(table)
    if is_rack and "bays" not in table:
        table.wrong("bays", 'missing; list the modules, for example ["MST601", "", "MPZ601"]')
    known = [each for each in (unit, *(bays or ())) if each is not None]
    channels = _channels(table, known, own)
    label = table.take("label", text, "") or name
    place = _place(table, bind)
    faults = table.take("faults", list_of(fault_of), ())
    options = Options(
        channels=channels,
        seed=table.take("seed", integer, index),
        model=table.take("model", text, None),
        serial_number=table.take("serial_number", integer, None),
        hardware_type=table.take("hardware_type", integer, None),
        stage_id=table.take("stage_id", integer, None),
        line=table.take("line", link_kind, LinkKind.USB),
        quirks=frozenset(table.take("quirks", list_of(text), ())),
        answer_unsupported=table.take("answer_unsupported", flag, False),
        empty_bays=frozenset(table.take("empty_bays", list_of(integer), ())),
        strategies=table.take("strategies", table_of(text), {}),
    )
    table.refuse_others()
    if (unit is None and not is_rack) or bays is None:
        return None
    blueprint = Blueprint(unit=unit, bays=bays, options=options, faults=faults)
    _check_options(table, blueprint)
    return BenchUnit(blueprint, place, label)


def _check_options(table: Table, blueprint: Blueprint) -> None:
    """Add a problem for each option and each fault that the unit refuses.

    Options are tried one at a time, so that one error does not hide another, and then all together.
    """

    def refused(key: str | Sequence[str], attempt: Blueprint) -> bool:
        try:
            attempt.make(SteppedClock())
        except StagewireError as error:
            table.wrong(key, str(error))
            return True
        return False

    bare = replace(blueprint, options=Options(), faults=())
    if refused("name" if blueprint.unit else "bays", bare):
        return
    short = [key for key in _SHORT if key in table]
    channels = ["channel"] if "channel" in table else short
    alone = [
        refused(
            channels if option == "channels" else option,
            replace(bare, options=Options(**{option: value})),
        )
        for option in (field.name for field in fields(Options))
        if (value := getattr(blueprint.options, option)) != getattr(bare.options, option)
    ]
    # All together can still be refused: empty bays may leave fewer channels than have settings.
    if any(alone) or refused(channels, replace(blueprint, faults=())):
        return
    for fault in blueprint.faults:
        refused("faults", replace(blueprint, faults=(fault,)))


def _channels(
    table: Table, units: Sequence[Unit], own: Mapping[str, Stage]
) -> tuple[Settings, ...]:
    """Return the settings of the channels, from the keys of the unit or of each channel."""
    stage = functools.partial(stage_of, units, own)
    short = _settings(table, stage)
    channels = tuple(
        _channel(table.inner(values, f"channel {number}"), stage)
        for number, values in enumerate(table.take("channel", tables_of("unit.channel"), ()), 1)
    )
    if short != Settings() and channels:
        table.wrong(
            "channel", "give stage, travel and position for the unit or for each channel, not both"
        )
    return channels or (() if short == Settings() else (short,))


def _channel(table: Table, stage: Convert[Stage | None]) -> Settings:
    settings = _settings(table, stage)
    table.refuse_others()
    return settings


def _settings(table: Table, stage: Convert[Stage | None]) -> Settings:
    return Settings(
        stage=table.take("stage", stage, None),
        travel=table.take("travel", integer, None),
        position=table.take("position", integer, None),
    )


def _place(table: Table, bind: str | None) -> Endpoint:
    tcp = table.take("tcp", functools.partial(tcp_endpoint, bind), None)
    pty = table.take("pty", pty_endpoint, None)
    if tcp is not None and pty is not None:
        table.wrong("pty", "give tcp or pty, not both")
    return pty or tcp or parse_tcp("0", bind)


def _check_place(table: Table, place: Endpoint, taken: dict[str, str]) -> None:
    """Add a problem for a port or a symbolic link that another unit already has."""
    match place:
        case TcpEndpoint(port=port, host=host) if port:
            key, spot = "tcp", f"port {port} of {host}"
        case PtyEndpoint(symlink=Path() as symlink):
            key, spot = "pty", str(symlink)
        case _:
            return
    first = taken.setdefault(spot, table.where)
    if first != table.where:
        table.wrong(key, f"{spot} is already taken; see {first}")


def _no_bays(table: Table) -> tuple[Unit | None, ...]:
    """Return no bays for a unit that is not a rack of modules, and add a problem if some are given."""
    if "bays" in table:
        table.take("bays", lambda value: value, None)
        table.wrong("bays", f'only a rack of modules (name = "{RACK}") has named bays')
    return ()
