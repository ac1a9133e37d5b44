"""From tables, of a file or of a command line, to a bench; all mistakes are reported at once."""

from __future__ import annotations

import functools
import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import Any, Final

from stagewire import Stage
from stagewire.errors import StagewireError
from stagewire_virtual.blueprint import Blueprint
from stagewire_virtual.clock import SteppedClock
from stagewire_virtual.errors import BenchError
from stagewire_virtual.options import Line, Options, Settings
from stagewire_virtual.serving.bench.bench import Bench, BenchUnit
from stagewire_virtual.serving.bench.tables import (
    Convert,
    Table,
    called_by_key,
    flag,
    integer,
    list_of,
    table_of,
    tables_of,
    text,
)
from stagewire_virtual.serving.bench.values import (
    fault_of,
    line_called,
    module_called,
    pty_place,
    stage_of,
    tcp_place,
    unit_called,
)
from stagewire_virtual.serving.places import Place, PtyPlace, TcpPlace, parse_tcp
from stagewire_virtual.thorlabs_apt.rack import RACK
from stagewire_virtual.units import Unit

__all__ = ["load_bench", "make_bench"]

_SHORT: Final = ("stage", "travel", "position")
"""Keys of a unit that stand for a channel with them."""


def load_bench(path: str | Path, bind: str | None = None) -> Bench:
    """Read a bench from a TOML file.

    :param bind: the address of the network that its TCP ports may be on; see
        :func:`~stagewire_virtual.serving.places.parse_tcp`.

    Raises :class:`~stagewire_virtual.errors.BenchError` with everything that is wrong with it.
    """
    try:
        contents = tomllib.loads(Path(path).read_text(encoding="utf-8"))
    except OSError as error:
        raise BenchError([f"{path}: cannot be read: {error.strerror or error}"]) from error
    except RecursionError as error:
        raise BenchError([f"{path}: is nested too deeply"]) from error
    except ValueError as error:  # of TOML or of UTF-8
        raise BenchError([f"{path}: is no TOML file: {error}"]) from error
    problems: list[str] = []
    top = Table(contents, str(path), problems)
    tables = top.take("unit", tables_of("unit"), ())
    top.refuse_others()
    if not tables and not problems:
        top.wrong("unit", "there is no unit; each begins with a line [[unit]]")
    return _bench(tables, str(path), bind, problems, called_by_key)


def make_bench(
    tables: Sequence[Mapping[str, Any]],
    source: str = "the command line",
    bind: str | None = None,
    called: Callable[[str], str] = called_by_key,
) -> Bench:
    """Make a bench of tables with the keys of a TOML file: ``[{"name": "TDC001", "tcp": "4001"}]``.

    :param source: where they come from; begins each line of an error.
    :param called: gives a key the name by which an error calls it.

    Raises :class:`~stagewire_virtual.errors.BenchError` with everything that is wrong with it.
    """
    return _bench(tables, source, bind, [], called)


def _bench(
    tables: Sequence[Mapping[str, Any]],
    source: str,
    bind: str | None,
    problems: list[str],
    called: Callable[[str], str],
) -> Bench:
    units: list[BenchUnit] = []
    taken: dict[str, str] = {}
    for number, values in enumerate(tables, 1):
        name = values.get("name")
        shown = f" ({name})" if isinstance(name, str) else ""
        table = Table(values, f"{source}: unit {number}{shown}", problems, called)
        unit = _unit(table, number - 1, bind)
        if unit is not None:
            _check_place(table, unit.place, taken)
            units.append(unit)
    if problems:
        raise BenchError(problems)
    return Bench(tuple(units))


def _unit(table: Table, index: int, bind: str | None) -> BenchUnit | None:
    """Return the unit that a table describes; None where it cannot be told what it is."""
    name = table.take("name", text, "")
    if "name" not in table:
        table.wrong("name", f"missing; it is a unit such as TDC001, or {RACK} for modules in bays")
    is_rack = name.upper() == RACK
    unit = None if is_rack else table.take("name", unit_called, None) if name else None
    bays = table.take("bays", list_of(module_called), None) if is_rack else _no_bays(table)
    if is_rack and "bays" not in table:
        table.wrong("bays", 'missing; it lists the modules, such as ["MST601", "", "MPZ601"]')
    channels = _channels(table, [known for known in (unit, *(bays or ())) if known is not None])
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
        line=table.take("line", line_called, Line.USB),
        quirks=frozenset(table.take("quirks", list_of(text), ())),
        answer_unsupported=table.take("answer_unsupported", flag, False),
        empty_bays=frozenset(table.take("empty_bays", list_of(integer), ())),
        strategies=table.take("strategies", table_of(text), {}),
    )
    table.refuse_others()
    if (unit is None and not is_rack) or bays is None:
        return None
    blueprint = Blueprint(unit=unit, bays=bays, options=options, faults=faults)
    _try(table, blueprint)
    return BenchUnit(blueprint, place, label)


def _try(table: Table, blueprint: Blueprint) -> None:
    """Note what the unit refuses: each option by itself, lest one hide another; all of them; each fault."""

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
    # What is refused only then is more channels than are left by the bays that are empty.
    if any(alone) or refused(channels, replace(blueprint, faults=())):
        return
    for fault in blueprint.faults:
        refused("faults", replace(blueprint, faults=(fault,)))


def _channels(table: Table, units: Sequence[Unit]) -> tuple[Settings, ...]:
    """Return the settings of the channels, of the short form or one by one."""
    stage = functools.partial(stage_of, units)
    short = _settings(table, stage)
    channels = tuple(
        _channel(table.inner(values, f"channel {number}"), stage)
        for number, values in enumerate(table.take("channel", tables_of("unit.channel"), ()), 1)
    )
    if short != Settings() and channels:
        table.wrong(
            "channel", "give stage, travel and position of the unit, or of each channel; not both"
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


def _place(table: Table, bind: str | None) -> Place:
    tcp = table.take("tcp", functools.partial(tcp_place, bind), None)
    pty = table.take("pty", pty_place, None)
    if tcp is not None and pty is not None:
        table.wrong("pty", "give tcp or pty, not both")
    return pty or tcp or parse_tcp("0", bind)


def _check_place(table: Table, place: Place, taken: dict[str, str]) -> None:
    """Note a port or a symbolic link that another unit has."""
    match place:
        case TcpPlace(port=port, host=host) if port:
            key, spot = "tcp", f"port {port} of {host}"
        case PtyPlace(symlink=Path() as symlink):
            key, spot = "pty", str(symlink)
        case _:
            return
    first = taken.setdefault(spot, table.where)
    if first != table.where:
        table.wrong(key, f"{spot} is already taken; see {first}")


def _no_bays(table: Table) -> tuple[Unit | None, ...]:
    """Return the bays that can be told of a unit that is no rack of modules: none."""
    if "bays" in table:
        table.take("bays", lambda value: value, None)
        table.wrong("bays", f'only name = "{RACK}", a rack of modules, has bays with names')
    return ()
