"""The units that ``stagewire virtual`` serves: by name, from a bench file or from a recorded session.

Command-line options are converted to the keys of a bench file, so that one reader checks both.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeAlias

from stagewire import Stage
from stagewire_cli.errors import CalledWronglyError
from stagewire_cli.output import console, table
from stagewire_virtual.clock import Clock
from stagewire_virtual.serving.endpoints import Endpoint, PtyEndpoint, TcpEndpoint, parse_tcp
from stagewire_virtual.serving.link import Observer, ServedLink

LinkMaker: TypeAlias = Callable[[Clock, Observer], ServedLink]
"""Makes one virtual controller with its link, which is not open yet."""

_ANY_PORT = "0"

_COUNTING = ("seed", "serial_number")
"""Options that count up from unit to unit."""

_SINGULAR = {"quirks": "quirk", "strategies": "strategy", "faults": "fault"}

_FAULT_TEXTS = """
--fault "to_host|to_controller FAULT [byte|frame] [KEY=VALUE ...]", such as "to_host drop frame every=10"
--fault "stick channel=N|axis=NAME [bay=N] [after=SECONDS] [for=SECONDS]"
"""


def option(key: str) -> str:
    """Return the command-line option for a key of a bench file."""
    return "the name" if key == "name" else f"--{_SINGULAR.get(key, key).replace('_', '-')}"


def of_names(
    names: Sequence[str],
    tcp: str | None,
    pty: bool,
    bind: str | None,
    options: Mapping[str, Any],
) -> list[LinkMaker]:
    """Return the units that are named on the command line.

    :param tcp: the port of the first unit; the others get the next ports. None: free ports.
    :param pty: whether each unit gets a pseudo-terminal instead.
    :param bind: the network address to listen on.
    :param options: the options of all units, by the keys of a bench file; None means not given. Seed and
        serial number are those of the first unit and count up for the others, so that serial numbers differ.

    Raises :class:`~stagewire_virtual.errors.VirtualError` with all problems.
    """
    from stagewire_virtual.bench import make_bench
    from stagewire_virtual.thorlabs_apt.rack import RACK

    if RACK in map(str.upper, names):
        raise CalledWronglyError(
            f'describe a {RACK} with its modules in a bench file (name = "{RACK}", '
            'bays = ["MST601", "", "MPZ601"]) and serve it with --bench FILE'
        )
    given = {key: value for key, value in options.items() if value is not None}
    if "strategies" in given:
        given["strategies"] = dict(map(_reading, given["strategies"]))
    first = parse_tcp(tcp or _ANY_PORT, bind)
    tables = []
    for number, name in enumerate(names):
        own: dict[str, Any] = {"name": name, "label": _label(names, number)}
        own |= {"pty": True} if pty else {"tcp": _port(first, number)}
        own |= {key: given[key] + number for key in _COUNTING if key in given}
        tables.append(given | own)
    return [unit.link for unit in make_bench(tables, bind=bind, called=option).units]


def of_bench(path: Path, bind: str | None, own: Mapping[str, Stage]) -> list[LinkMaker]:
    """Return the units of a bench file; raise the same errors as :func:`of_names`.

    :param own: the stages of the user that it may name, by name.
    """
    from stagewire_virtual.bench import load_bench

    return [unit.link for unit in load_bench(path, bind=bind, own_stages=own).units]


def of_replay(
    path: Path, tcp: str | None, pty: bool, bind: str | None, *, lenient: bool
) -> list[LinkMaker]:
    """Return the controller's side of a recorded session; see :class:`~stagewire_virtual.replay.Replay`.

    The returned maker raises :class:`~stagewire.errors.CaptureError` if the file is not a capture.
    """
    from stagewire_virtual.replay import load_replay

    place: Endpoint = PtyEndpoint() if pty else parse_tcp(tcp or _ANY_PORT, bind)

    def make(clock: Clock, observer: Observer) -> ServedLink:
        replay = load_replay(path, clock, lenient=lenient)
        return place.link(replay, label=path.name, observer=observer)

    return [make]


def show_all() -> None:
    """Print all units that can be simulated, and the names of their quirks, strategies and faults."""
    from stagewire_apt import PROTOCOL as APT
    from stagewire_virtual.asi_ms2000.instrument import STRATEGIES
    from stagewire_virtual.factory import simulated_units
    from stagewire_virtual.faults.fault import ACTIONS
    from stagewire_virtual.thorlabs_apt.quirks import QUIRKS
    from stagewire_virtual.thorlabs_apt.rack import RACK

    out = console()
    units = table("unit", "description", "protocol", "stages")
    for name, unit in sorted(simulated_units().items()):
        stages = ", ".join(unit.facts["stages"])
        units.add_row(name, unit.facts["title"], unit.protocol.name, stages)
    units.add_row(RACK, "rack of modules; a bench file names the module in each bay", APT.name)
    out.print(units)
    quirks = table("quirk", "effect")
    for name, sentence in QUIRKS.items():
        quirks.add_row(name, sentence)
    out.print()
    out.print(quirks)
    readings = table("strategy", "value", "reading of the document")
    for name, known in STRATEGIES.items():
        for reading, sentence in known.items():
            default = " (default)" if reading == next(iter(known)) else ""
            readings.add_row(name, f"{reading}{default}", sentence)
    out.print()
    out.print(readings)
    faults = table("fault", "applies to", "keys")
    for action, kind in ACTIONS.items():
        affected = "bytes or frames" if kind.piece else "an axis"
        faults.add_row(action.value, affected, ", ".join(kind.keys))
    out.print()
    out.print(faults)
    out.print(_FAULT_TEXTS)


def _label(names: Sequence[str], number: int) -> str:
    """Return a unique label: the name, with a number if several units have the same name."""
    alike = [index for index, name in enumerate(names) if name.upper() == names[number].upper()]
    name = names[number].upper()
    return name if len(alike) == 1 else f"{name} {alike.index(number) + 1}"


def _port(first: TcpEndpoint, number: int) -> str:
    """Return the address and port of the unit with this index, counted from 0."""
    host = f"[{first.host}]" if ":" in first.host else first.host
    return f"{host}:{first.port + number if first.port else 0}"


def _reading(text: str) -> tuple[str, str]:
    name, found, reading = text.partition("=")
    if not found:
        raise CalledWronglyError(f"--strategy {text}: expected NAME=VALUE; see --list")
    return name, reading
