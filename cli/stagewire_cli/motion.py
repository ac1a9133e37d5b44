"""``stagewire move``, ``home``, ``jog`` and ``stop``: move one axis, after a confirmation."""

from __future__ import annotations

from typing import Annotated

import typer

from stagewire_cli.devices import (
    Address,
    Bay,
    LinkUrl,
    ScaleSource,
    Unit,
    seconds_above_0,
    travel_options,
)
from stagewire_cli.errors import CalledWronglyError
from stagewire_cli.recordings import CsvFile, Overwrite, PlotFile, RecordFiles
from stagewire_cli.stages import StageName, StagesFile, chosen_stage

MOVE_EXAMPLE = """\b
Examples:
  stagewire move /dev/ttyUSB0 --stage Z8 --travel 12 --to 1.5
  stagewire move COM3 --stage PRM1-Z8 --to 30deg
  stagewire move COM3 --counts --by -2000
  stagewire move COM4 --unit MFF101 --to 2
  stagewire move COM5 --unit KIM101 --channel 3 --counts --by 200 --enable
  stagewire move COM6 --unit MPC320 --channel 2 --to 45deg
  stagewire move COM3 --stage Z8 --by 0.1 --csv step.csv --plot step.png
  stagewire move socket://10.0.0.5:4001 --unit BBD102 --stage MLS203 --bay 2 --to 10 --yes
"""
HOME_EXAMPLE = """\b
Examples:
  stagewire home /dev/ttyUSB0
  stagewire home COM6 --unit MPC320 --channel 2 --enable
  stagewire home "virtual://TDC001?stage=Z8" --yes
"""
JOG_EXAMPLE = """\b
Examples:
  stagewire jog /dev/ttyUSB0 forward --stage Z8
  stagewire jog COM5 reverse --unit KIM101 --channel 3 --enable
  stagewire jog "virtual://TDC001?stage=Z8" reverse --stage Z8 --yes
"""
STOP_EXAMPLE = """\b
Examples:
  stagewire stop /dev/ttyUSB0
  stagewire stop COM3 --unit BBD102 --bay 2
  stagewire stop COM4 --unit KLS635
"""

ChannelOption = Annotated[
    int | None, typer.Option("--channel", min=1, help="Channel of the controller, from 1.")
]
AxisOption = Annotated[
    str | None, typer.Option("--axis", metavar="NAME", help="Axis of an MS-2000, such as X.")
]
MoveTravel = Annotated[
    str | None,
    typer.Option(
        "--travel",
        metavar="LENGTH|LOW,HIGH",
        help="Allowed positions: 12 for 0 to 12 mm, -5,5, or -8,8deg. Others are refused.",
    ),
]
Enable = Annotated[
    bool,
    typer.Option(
        "--enable",
        help="Enable the channel first; on units such as the KIM101 this disables the others.",
    ),
]
Yes = Annotated[
    bool, typer.Option("--yes", help="Do not ask for confirmation; required without a terminal.")
]
Timeout = Annotated[
    float,
    typer.Option(
        "--timeout",
        parser=seconds_above_0,
        metavar="SECONDS",
        help="Stop the motion if it takes longer.",
    ),
]


def move(
    url: LinkUrl,
    to: Annotated[
        str | None,
        typer.Option(
            "--to", metavar="POSITION", help="Target position, such as 1.5 (mm) or 30deg."
        ),
    ] = None,
    by: Annotated[
        str | None,
        typer.Option(
            "--by", metavar="DISTANCE", help="Distance to move, such as -0.5 (mm) or -10deg."
        ),
    ] = None,
    counts: Annotated[
        bool, typer.Option("--counts", help="Read --to or --by as raw counts.")
    ] = False,
    unit: Unit = None,
    stage: StageName = None,
    stages: StagesFile = None,
    scale_source: ScaleSource = None,
    travel: MoveTravel = None,
    bay: Bay = None,
    address: Address = None,
    channel: ChannelOption = None,
    axis: AxisOption = None,
    timeout: Timeout = 60.0,
    csv: CsvFile = None,
    plot: PlotFile = None,
    overwrite: Overwrite = False,
    enable: Enable = False,
    yes: Yes = False,
) -> None:
    """Move one axis, and wait for the end of the motion.

    Prints the unit, its position and the target, and asks for confirmation. Ctrl-C stops the motion. The
    files of --csv and --plot are complete however the motion ends.
    """
    from stagewire_cli.motion_session import PartAddress, run_move
    from stagewire_cli.target import Target

    number = to if by is None else by
    if number is None or None not in (to, by):
        raise CalledWronglyError("give either --to (a position) or --by (a distance)")
    target = Target.parse(number, relative=by is not None, counts=counts)
    where = PartAddress(url, unit, bay, channel, axis)
    options = {
        "stage": chosen_stage(stage, stages),
        "address": address,
        "scale_source": scale_source,
        **travel_options(travel),
    }
    files = RecordFiles(csv, plot, overwrite)
    run_move(where, target, options, timeout=timeout, yes=yes, files=files, enable=enable)


def home(
    url: LinkUrl,
    unit: Unit = None,
    stage: StageName = None,
    stages: StagesFile = None,
    scale_source: ScaleSource = None,
    bay: Bay = None,
    address: Address = None,
    channel: ChannelOption = None,
    axis: AxisOption = None,
    timeout: Timeout = 60.0,
    csv: CsvFile = None,
    plot: PlotFile = None,
    overwrite: Overwrite = False,
    enable: Enable = False,
    yes: Yes = False,
) -> None:
    """Home one axis, and wait for the end of the motion.

    Uses the direction, limit switch and speed that are stored in the controller, and changes none of them.
    Asks for confirmation. Ctrl-C stops the motion.
    """
    from stagewire_cli.motion_session import PartAddress, run_home

    files = RecordFiles(csv, plot, overwrite)
    where = PartAddress(url, unit, bay, channel, axis)
    options = {
        "stage": chosen_stage(stage, stages),
        "address": address,
        "scale_source": scale_source,
    }
    run_home(where, options, timeout=timeout, yes=yes, files=files, enable=enable)


def jog(
    url: LinkUrl,
    direction: Annotated[
        str,
        typer.Argument(
            metavar="DIRECTION", help="forward or reverse, as the controller defines them."
        ),
    ],
    unit: Unit = None,
    stage: StageName = None,
    stages: StagesFile = None,
    scale_source: ScaleSource = None,
    travel: MoveTravel = None,
    bay: Bay = None,
    address: Address = None,
    channel: ChannelOption = None,
    axis: AxisOption = None,
    timeout: Timeout = 60.0,
    csv: CsvFile = None,
    plot: PlotFile = None,
    overwrite: Overwrite = False,
    enable: Enable = False,
    yes: Yes = False,
) -> None:
    """Jog one axis by the step stored in its controller.

    The document does not state whether forward raises or lowers the position, so try a small step first.
    Prints the stored step and asks for confirmation. Waits for the end of the motion. Ctrl-C stops it.
    """
    from stagewire_cli.motion_session import PartAddress, run_jog

    where = PartAddress(url, unit, bay, channel, axis)
    options = {
        "stage": chosen_stage(stage, stages),
        "address": address,
        "scale_source": scale_source,
        **travel_options(travel),
    }
    files = RecordFiles(csv, plot, overwrite)
    run_jog(where, direction, options, timeout=timeout, yes=yes, files=files, enable=enable)


def stop(
    url: LinkUrl,
    unit: Unit = None,
    bay: Bay = None,
    address: Address = None,
    channel: ChannelOption = None,
    axis: AxisOption = None,
    to: Annotated[str | None, typer.Option("--to", hidden=True)] = None,
    by: Annotated[str | None, typer.Option("--by", hidden=True)] = None,
    stage: Annotated[str | None, typer.Option("--stage", hidden=True)] = None,
    stages: Annotated[str | None, typer.Option("--stages", hidden=True)] = None,
    scale_source: Annotated[str | None, typer.Option("--scale-source", hidden=True)] = None,
    travel: Annotated[str | None, typer.Option("--travel", hidden=True)] = None,
    timeout: Annotated[str | None, typer.Option("--timeout", hidden=True)] = None,
    counts: Annotated[bool, typer.Option("--counts", hidden=True)] = False,
    csv: Annotated[str | None, typer.Option("--csv", hidden=True)] = None,
    plot: Annotated[str | None, typer.Option("--plot", hidden=True)] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", hidden=True)] = False,
    enable: Annotated[bool, typer.Option("--enable", hidden=True)] = False,
    yes: Annotated[bool, typer.Option("--yes", hidden=True)] = False,
) -> None:
    """Stop all axes, or one bay, channel or axis, without asking.

    If --unit or the USB plug identifies the unit, the stop is the first message that is sent. Options of move
    and home are accepted and ignored, so you can repeat a command line with `stop` instead of `move`.

    A laser or heater is switched off. A NanoTrak ends its tracking, and a position aligner opens its loops. A
    piezo driver ends its waveform and holds its voltage. A shutter gets the stop of a motor; check that it
    closes. A TTC001 is first asked for its sensor.
    """
    from stagewire_cli.motion_session import PartAddress, run_stop

    run_stop(PartAddress(url, unit, bay, channel, axis), address)
