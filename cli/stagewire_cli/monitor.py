"""``stagewire monitor``: the live status of a controller."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from stagewire_cli.devices import Address, Bay, LinkUrl, ScaleSource, Unit, seconds_above_0
from stagewire_cli.errors import CalledWronglyError
from stagewire_cli.recordings import CsvFile, Overwrite, PlotFile, RecordFiles
from stagewire_cli.stages import StageName, StagesFile, chosen_stage

EXAMPLE = """\b
Examples:
  stagewire monitor /dev/ttyUSB0 --stage Z8
  stagewire monitor "virtual://TDC001?stage=Z8" --stage Z8 --for 5 --plot move.png
  stagewire monitor COM3 --stage Z8 --csv run.csv
  stagewire monitor COM3 --json --for 60 | jq .position_mm
  stagewire monitor socket://10.0.0.5:4001 --unit BBD102 --log session.txt
"""


def monitor(
    url: LinkUrl,
    unit: Unit = None,
    stage: StageName = None,
    stages: StagesFile = None,
    scale_source: ScaleSource = None,
    bay: Bay = None,
    address: Address = None,
    seconds: Annotated[
        float | None,
        typer.Option(
            "--for",
            parser=seconds_above_0,
            metavar="SECONDS",
            help="Exit after this time.",
        ),
    ] = None,
    listen: Annotated[
        bool,
        typer.Option(
            "--listen",
            help="Send nothing: show what another program asks for, by stagewire serve. Needs --unit.",
        ),
    ] = False,
    csv: CsvFile = None,
    overwrite: Overwrite = False,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print each status as a JSON object on one line.")
    ] = False,
    plot: PlotFile = None,
    log: Annotated[
        Path | None,
        typer.Option("--log", metavar="FILE", help="Record the traffic as a capture."),
    ] = None,
) -> None:
    """Show the status of a controller live; nothing moves.

    Shows every bay, channel and axis until Ctrl-C or the end of --for: as a live table on a terminal,
    otherwise one line per status. Status messages are switched on while it runs. A unit that does not send
    any is polled five times a second. The rows of --csv and --json have the same columns.
    """
    from stagewire_cli.monitor_session import watch

    named = [path.resolve() for path in (csv, plot, log) if path is not None]
    if len(set(named)) < len(named):
        raise CalledWronglyError("--csv, --plot and --log must name different files")
    if listen and unit is None:
        raise CalledWronglyError("--listen requires --unit, because nothing is asked")
    options = {
        "stage": chosen_stage(stage, stages),
        "scale_source": scale_source,
        "address": address,
        "identify": False if listen else None,
        "line": "rs232" if listen else None,  # no keep-alive messages
    }
    watch(
        url,
        unit,
        options,
        bay,
        seconds=seconds,
        as_json=as_json,
        files=RecordFiles(csv, plot, overwrite),
        log=log,
        listen=listen,
    )
