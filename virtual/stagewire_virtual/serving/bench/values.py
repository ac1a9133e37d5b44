"""What the values of a bench mean: names of units and stages, places, faults."""

from __future__ import annotations

import difflib
import importlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

from stagewire import Stage
from stagewire_virtual.errors import BadOptionError, UnknownUnitError
from stagewire_virtual.faults import Fault, parse_fault
from stagewire_virtual.options import Line, check_stage, parse_line
from stagewire_virtual.serving.bench.tables import text
from stagewire_virtual.serving.places import PtyPlace, TcpPlace, parse_tcp
from stagewire_virtual.thorlabs_apt.rack import RACK
from stagewire_virtual.units import Unit, find_unit

__all__ = [
    "fault_of",
    "line_called",
    "module_called",
    "pty_place",
    "stage_of",
    "tcp_place",
    "unit_called",
]

_ONE_OF_TWO: Final = 0.5
"""How alike names of stages are that may be mistaken: of two letters, one."""


def stage_of(units: Sequence[Unit], value: Any) -> Stage | None:
    """Return a stage of the protocol of the units, by name; None where none of them is known."""
    name = text(value)
    if not units:
        return None
    protocol = units[0].protocol
    known = {entry["name"].upper(): entry["name"] for entry in units[0].registry["stages"]}
    if name.upper() not in known:
        close = difflib.get_close_matches(name.upper()[:40], known, n=1, cutoff=_ONE_OF_TWO)
        hint = f"; did you mean {known[close[0]]}?" if close else ""
        there = f"there are: {', '.join(sorted(known.values()))}" if known else "there is none"
        raise BadOptionError(f"{protocol.title} has no stage {name}{hint} ({there})")
    stages = importlib.import_module(f"{protocol.package}.stages")
    stage: Stage = getattr(stages, known[name.upper()])
    check_stage(stage, [unit.name for unit in units])
    return stage


def tcp_place(bind: str | None, value: Any) -> TcpPlace:
    """Return a port: ``4001`` or ``"127.0.0.1:4001"``."""
    return parse_tcp(str(value), bind)


def pty_place(value: Any) -> PtyPlace | None:
    """Return a pseudo-terminal, with a link to it if one is named; None where none is wanted."""
    if isinstance(value, bool):
        return PtyPlace() if value else None
    if not isinstance(value, str) or not value:
        raise BadOptionError("expected true, or the name of a symbolic link to be made")
    return PtyPlace(Path(value))


def unit_called(value: Any) -> Unit:
    """Return a unit by name; where there is none, a rack is among those that there are."""
    try:
        return find_unit(text(value))
    except UnknownUnitError as error:
        raise UnknownUnitError(error.name, sorted([*error.known, RACK])) from None


def module_called(value: Any) -> Unit | None:
    """Return the module in a bay; an empty name is an empty bay."""
    name = text(value)
    return find_unit(name) if name else None


def line_called(value: Any) -> Line:
    """Return the line of a name."""
    return parse_line(text(value))


def fault_of(value: Any) -> Fault:
    """Return the fault of a text."""
    return parse_fault(text(value))
