"""``stagewire virtual``: serve virtual controllers on TCP ports or pseudo-terminals."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer

from stagewire_cli import completion
from stagewire_cli.errors import OK, WRONG, CalledWronglyError
from stagewire_cli.stages import StagesFile, chosen_stage, own_stages

EXAMPLE = """\b
Examples:
  stagewire virtual TDC001 --stage Z8 --tcp 127.0.0.1:4001 --log -
  stagewire virtual BBD102 BSC103 TPZ001 --pty
  stagewire virtual TDC001 --model KDC101 --serial-number 27000001
  stagewire virtual TDC001 --quirk header_only_completion --fault "to_host drop frame every=10"
  stagewire virtual --bench bench.toml
  stagewire virtual --replay session.txt --tcp 4001
"""


def _list(wanted: bool) -> None:
    """Print all units, quirks, strategies and faults, and exit."""
    if wanted:
        from stagewire_cli.virtual_units import show_all

        show_all()
        raise typer.Exit(OK)


def _whole(text: str) -> int:
    try:
        return int(text)
    except ValueError:
        raise typer.BadParameter(f"expected a whole number, not {text!r}") from None


def _seconds(text: str) -> float:
    try:
        seconds = float(text)
    except ValueError:
        seconds = math.nan
    if not 0 <= seconds < math.inf:
        raise typer.BadParameter(
            f"expected a number of seconds, not {text!r}; without --for it runs until Ctrl-C"
        )
    return seconds


def virtual(
    units: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[UNIT]...",
            help="Names of units, such as TDC001; see --list.",
            autocompletion=completion.units,
        ),
    ] = None,
    bench: Annotated[
        Path | None,
        typer.Option("--bench", metavar="FILE", help="Serve the units described in a TOML file."),
    ] = None,
    replay: Annotated[
        Path | None,
        typer.Option(
            "--replay",
            metavar="CAPTURE",
            help="Act as the controller of a recorded session until the host disconnects.",
        ),
    ] = None,
    lenient: Annotated[
        bool,
        typer.Option(
            "--lenient",
            help="With --replay: on an unexpected request, continue at its next occurrence.",
        ),
    ] = False,
    tcp: Annotated[
        str | None,
        typer.Option(
            "--tcp",
            metavar="[HOST:]PORT",
            help="Serve on TCP; further units use the following ports. 0 chooses a free port.",
        ),
    ] = None,
    pty: Annotated[
        bool, typer.Option("--pty", help="Serve each unit on its own pseudo-terminal.")
    ] = False,
    bind: Annotated[
        str | None,
        typer.Option(
            "--bind",
            metavar="ADDRESS",
            help="Listen on this address.  [default: loopback only]",
        ),
    ] = None,
    stage: Annotated[
        str | None,
        typer.Option(
            "--stage",
            metavar="NAME",
            help="Stage on the controller, such as Z8.",
            autocompletion=completion.stages,
        ),
    ] = None,
    stages: StagesFile = None,
    travel: Annotated[
        int | None,
        typer.Option(
            "--travel", parser=_whole, metavar="COUNTS", help="Length of the travel of the stage."
        ),
    ] = None,
    position: Annotated[
        int | None,
        typer.Option(
            "--position",
            parser=_whole,
            metavar="COUNTS",
            help="Start position, from the lower end of the travel.",
        ),
    ] = None,
    seed: Annotated[
        int | None,
        typer.Option(
            "--seed",
            parser=_whole,
            metavar="NUMBER",
            help="The same seed produces the same bytes; further units count up from it.",
        ),
    ] = None,
    model: Annotated[
        str | None,
        typer.Option(
            "--model",
            metavar="TEXT",
            help="Model to report, such as KDC101; for a rack, that of its motherboard.",
        ),
    ] = None,
    serial_number: Annotated[
        int | None,
        typer.Option(
            "--serial-number",
            parser=_whole,
            metavar="NUMBER",
            help="Serial number to report; further units count up from it.",
        ),
    ] = None,
    hardware_type: Annotated[
        int | None,
        typer.Option(
            "--hardware-type",
            parser=_whole,
            metavar="NUMBER",
            help="Hardware type to report, such as 16.",
        ),
    ] = None,
    stage_id: Annotated[
        int | None,
        typer.Option(
            "--stage-id",
            parser=_whole,
            metavar="NUMBER",
            help="Stage id to report, as newer controllers do, such as 7.",
        ),
    ] = None,
    line: Annotated[
        str | None,
        typer.Option(
            "--line",
            metavar="usb|rs232",
            help="Line that the controller assumes; on usb it requires keep-alive messages.  "
            "[default: usb]",
        ),
    ] = None,
    quirk: Annotated[
        list[str] | None,
        typer.Option(
            "--quirk", metavar="NAME", help="Imitate a quirk of real controllers; see --list."
        ),
    ] = None,
    strategy: Annotated[
        list[str] | None,
        typer.Option(
            "--strategy",
            metavar="NAME=VALUE",
            help="Choice where the document of the MS-2000 is ambiguous; see --list.",
        ),
    ] = None,
    fault: Annotated[
        list[str] | None,
        typer.Option(
            "--fault",
            metavar="TEXT",
            help='Fault to inject, such as "to_host drop frame every=10"; see --list.',
        ),
    ] = None,
    answer_unsupported: Annotated[
        bool,
        typer.Option("--answer-unsupported", help="Answer unsupported messages with HW_RESPONSE."),
    ] = False,
    log: Annotated[
        str | None,
        typer.Option(
            "--log",
            metavar="FILE|-",
            help="Record all bytes, decoded, as a capture for --replay and stagewire decode.",
        ),
    ] = None,
    seconds: Annotated[
        float | None,
        typer.Option("--for", parser=_seconds, metavar="SECONDS", help="Exit after this time."),
    ] = None,
    _: Annotated[
        bool,
        typer.Option(
            "--list",
            callback=_list,
            is_eager=True,
            help="Print all units, quirks, strategies and faults, and exit.",
        ),
    ] = False,
) -> None:
    """Serve virtual controllers on TCP or pseudo-terminals.

    A virtual controller is software that exchanges the same bytes as the real one. Without --tcp or --pty
    each unit gets a free TCP port. Each address is printed on its own line; on a terminal a live table
    follows. The ports are reachable only from this machine, unless --bind gives another address.

    With several units, the options apply to all of them; a bench file has options for each. --log writes one
    file per unit, numbered if there are several.

    Ctrl-C ends the command with exit code 0. Exit code 1 means that a replayed session differed from the
    recording.
    """
    options = {
        "stage": chosen_stage(stage, stages),
        "travel": travel,
        "position": position,
        "seed": seed,
        "model": model,
        "serial_number": serial_number,
        "hardware_type": hardware_type,
        "stage_id": stage_id,
        "line": line,
        "quirks": quirk or None,
        "strategies": strategy or None,
        "faults": fault or None,
        "answer_unsupported": answer_unsupported or None,
    }
    _one_of({"UNIT": units, "--bench": bench, "--replay": replay})
    if bench:
        _without("--bench", {"tcp": tcp, "pty": pty or None, **options})
    if replay:
        _without("--replay", options)
    elif lenient:
        raise CalledWronglyError("--lenient requires --replay")
    if tcp is not None and pty:
        raise CalledWronglyError("give only one of --tcp and --pty")
    with _called_wrongly():
        from stagewire_cli.virtual_session import run_session
        from stagewire_cli.virtual_units import of_bench, of_names, of_replay

        if bench:
            makers = of_bench(bench, bind, own_stages(stages))
        elif replay:
            makers = of_replay(replay, tcp, pty, bind, lenient=lenient)
        else:
            makers = of_names(units or [], tcp, pty, bind, options)
        right = run_session(makers, log, seconds, source=bench or replay)
    if not right:
        raise typer.Exit(WRONG)


def _one_of(given: Mapping[str, object]) -> None:
    """Raise unless exactly one of the sources of units is given."""
    names = [name for name, value in given.items() if value]
    if not names:
        raise CalledWronglyError(
            "nothing to serve: give names of units (stagewire virtual --list shows them), --bench or --replay"
        )
    if len(names) > 1:
        raise CalledWronglyError(f"give only one of {' and '.join(names)}")


def _without(option: str, others: Mapping[str, object]) -> None:
    """Raise for options that ``option`` excludes."""
    from stagewire_cli.virtual_units import option as called

    for name, value in others.items():
        if value is not None:
            raise CalledWronglyError(
                f"{called(name)} only applies to units named on the command line, not with {option}"
            )


@contextmanager
def _called_wrongly() -> Iterator[None]:
    """Turn errors about units, endpoints and files into exit code 2."""
    from stagewire.errors import StagewireError

    try:
        yield
    except StagewireError as error:
        raise CalledWronglyError(str(error)) from None
