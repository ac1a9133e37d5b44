"""``stagewire move``, ``home``, ``jog`` and ``stop``: one axis by hand, after having asked."""

from __future__ import annotations

from typing import Annotated

import typer

from stagewire_cli.devices import Bay, LinkUrl, Stage, Unit, seconds_above_0, travel_in_mm
from stagewire_cli.errors import CalledWronglyError

MOVE_EXAMPLE = """\b
Examples:
  stagewire move /dev/ttyUSB0 --stage Z8 --travel 12 --to 1.5
  stagewire move COM3 --counts --by -2000
  stagewire move socket://10.0.0.5:4001 --unit BBD102 --stage MLS203 --bay 2 --to 10 --yes
"""
HOME_EXAMPLE = """\b
Examples:
  stagewire home /dev/ttyUSB0
  stagewire home "virtual://TDC001?stage=Z8" --yes
"""
JOG_EXAMPLE = """\b
Examples:
  stagewire jog /dev/ttyUSB0 forward --stage Z8
  stagewire jog "virtual://TDC001?stage=Z8" reverse --stage Z8 --yes
"""
STOP_EXAMPLE = """\b
Examples:
  stagewire stop /dev/ttyUSB0
  stagewire stop COM3 --unit BBD102 --bay 2
"""

ChannelOption = Annotated[
    int | None, typer.Option("--channel", min=1, help="Channel of the controller; the first is 1.")
]
AxisOption = Annotated[
    str | None, typer.Option("--axis", metavar="NAME", help="Axis of an MS-2000, such as X.")
]
MoveTravel = Annotated[
    str | None,
    typer.Option(
        "--travel",
        metavar="MM|LOW,HIGH",
        help="Travel of the stage, as 12 or as -5,5; positions outside are refused.",
    ),
]
Yes = Annotated[bool, typer.Option("--yes", help="Do not ask; required without a terminal.")]
Timeout = Annotated[
    float,
    typer.Option(
        "--timeout", parser=seconds_above_0, metavar="SECONDS", help="How long its end may take."
    ),
]


def move(
    url: LinkUrl,
    to: Annotated[
        str | None, typer.Option("--to", metavar="MM", help="Position to go to, in mm.")
    ] = None,
    by: Annotated[
        str | None, typer.Option("--by", metavar="MM", help="Distance to go, in mm.")
    ] = None,
    counts: Annotated[
        bool, typer.Option("--counts", help="The number is one of raw counts, not of mm.")
    ] = False,
    unit: Unit = None,
    stage: Stage = None,
    travel: MoveTravel = None,
    bay: Bay = None,
    channel: ChannelOption = None,
    axis: AxisOption = None,
    timeout: Timeout = 60.0,
    yes: Yes = False,
) -> None:
    """Move one axis to a position or by a distance, and wait until it is there.

    Says what will move from where to where, and asks. Ctrl-C stops it.
    """
    from stagewire_cli.motion_session import PartAddress, Target, run_move

    number = to if by is None else by
    if number is None or None not in (to, by):
        raise CalledWronglyError("where to? give one of --to (a position) and --by (a distance)")
    target = Target.parse(number, relative=by is not None, counts=counts)
    where = PartAddress(url, unit, bay, channel, axis)
    length = None if travel is None else travel_in_mm(travel)
    run_move(where, target, stage=stage, travel=length, timeout=timeout, yes=yes)


def home(
    url: LinkUrl,
    unit: Unit = None,
    bay: Bay = None,
    channel: ChannelOption = None,
    axis: AxisOption = None,
    timeout: Timeout = 60.0,
    yes: Yes = False,
) -> None:
    """Send one axis to its home position, and wait until it is there.

    Direction, limit switch and speed are those that the controller has stored; none is changed. Asks before
    it moves. Ctrl-C stops it.
    """
    from stagewire_cli.motion_session import PartAddress, run_home

    run_home(PartAddress(url, unit, bay, channel, axis), timeout=timeout, yes=yes)


def jog(
    url: LinkUrl,
    direction: Annotated[
        str,
        typer.Argument(metavar="DIRECTION", help="As the controller names it: forward or reverse."),
    ],
    unit: Unit = None,
    stage: Stage = None,
    travel: MoveTravel = None,
    bay: Bay = None,
    channel: ChannelOption = None,
    axis: AxisOption = None,
    timeout: Timeout = 60.0,
    yes: Yes = False,
) -> None:
    """Jog one axis by the step that its controller has stored, and wait until it is there.

    The document does not say whether positions rise or fall in direction forward: try a small step first.
    Says what is stored, and asks before it moves. Ctrl-C stops it.
    """
    from stagewire_cli.motion_session import PartAddress, run_jog

    where = PartAddress(url, unit, bay, channel, axis)
    length = None if travel is None else travel_in_mm(travel)
    run_jog(where, direction, stage=stage, travel=length, timeout=timeout, yes=yes)


def stop(
    url: LinkUrl,
    unit: Unit = None,
    bay: Bay = None,
    channel: ChannelOption = None,
    axis: AxisOption = None,
    to: Annotated[str | None, typer.Option("--to", hidden=True)] = None,
    by: Annotated[str | None, typer.Option("--by", hidden=True)] = None,
    stage: Annotated[str | None, typer.Option("--stage", hidden=True)] = None,
    travel: Annotated[str | None, typer.Option("--travel", hidden=True)] = None,
    timeout: Annotated[str | None, typer.Option("--timeout", hidden=True)] = None,
    counts: Annotated[bool, typer.Option("--counts", hidden=True)] = False,
    yes: Annotated[bool, typer.Option("--yes", hidden=True)] = False,
) -> None:
    """Stop all that moves, or one bay, channel or axis; asks nothing.

    If --unit or the USB plug identifies the unit, the stop is sent first. Options of move and home are
    accepted and ignored, so that you can repeat a command line with `stop` in it.
    """
    from stagewire_cli.motion_session import PartAddress, run_stop

    run_stop(PartAddress(url, unit, bay, channel, axis))
