"""``stagewire decode``: decode bytes to messages, for people or programs."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

import typer

from stagewire.capture import Heading
from stagewire.errors import CodecError
from stagewire.framing import End
from stagewire_cli import completion
from stagewire_cli.decoding import Counts, Decoding, opened
from stagewire_cli.devices import ScaleSource
from stagewire_cli.errors import WRONG, CalledWronglyError
from stagewire_cli.formats.format import Format, check_format, writing
from stagewire_cli.framings.framing import DirectionOption
from stagewire_cli.output import check_output, output, progress
from stagewire_cli.protocols import PROTOCOL_HELP
from stagewire_cli.selection import Selection
from stagewire_cli.stage_values import StageValues
from stagewire_cli.stages import StagesFile, check_unit, one_stage
from stagewire_cli.values import parse_hex

EXAMPLE = """\b
Examples:
  stagewire decode "53 04 06 00 D0 01 01 00 40 0D 03 00"
  stagewire decode capture.bin --end host --status dc --format jsonl
  stagewire decode --direction command "18 54 03 A0 86 01 3A"
  stagewire decode --command READ_MOTOR_POSITION "A0 86 01"
  stagewire decode capture.bin --message MOT_GET_DCSTATUSUPDATE --format csv --output status.csv
  stagewire decode --stage Z8 --unit TDC001 "12 04 06 00 81 50 01 00 00 86 00 00"
  stagewire decode session.txt                     # as recorded by stagewire virtual --log
"""


_SUFFIXES = (Format.JSONL.value, Format.CSV.value, Format.PARQUET.value)


def decode(
    source: Annotated[
        list[str],
        typer.Argument(metavar="HEX|FILE|-", help="Bytes in hex, a file, or - for stdin."),
    ],
    protocol: Annotated[str | None, typer.Option("--protocol", help=PROTOCOL_HELP)] = None,
    status: Annotated[
        str | None,
        typer.Option(
            "--status",
            metavar="NAME",
            help="Status block that the controller sends, such as dc or stepper.",
        ),
    ] = None,
    context: Annotated[
        list[str] | None,
        typer.Option(
            "--context",
            metavar="NAME=VALUE",
            help="Another fact that selects layouts, as the registry names it; may be repeated.",
        ),
    ] = None,
    direction: Annotated[
        DirectionOption | None,
        typer.Option(
            "--direction",
            case_sensitive=False,
            help="For protocols without frames: what the bytes are.",
        ),
    ] = None,
    command: Annotated[
        str | None,
        typer.Option(
            "--command",
            metavar="NAME",
            help="Decode the reply to this command.",
            autocompletion=completion.messages,
        ),
    ] = None,
    end: Annotated[
        End | None,
        typer.Option(
            "--end",
            case_sensitive=False,
            help="Receiver of the stream; none if unknown.  [default: none]",
        ),
    ] = None,
    message: Annotated[
        str | None,
        typer.Option(
            "--message",
            metavar="NAME[:FORM]",
            help="Only this message; CSV and Parquet then have one column per field.",
            autocompletion=completion.messages,
        ),
    ] = None,
    stage: Annotated[
        str | None,
        typer.Option(
            "--stage",
            metavar="NAME",
            help="Also show values in the units of this stage, such as Z8.",
            autocompletion=completion.stages,
        ),
    ] = None,
    stages: StagesFile = None,
    unit: Annotated[
        str | None,
        typer.Option(
            "--unit",
            metavar="NAME",
            help="With --stage: the controller, such as TDC001.  [default: that of the capture]",
            autocompletion=completion.units,
        ),
    ] = None,
    scale_source: ScaleSource = None,
    format: Annotated[
        Format | None,
        typer.Option(
            "--format",
            case_sensitive=False,
            help="Output format.  [default: by the suffix of --output, or table]",
        ),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="The same as --format jsonl.")] = False,
    target: Annotated[
        Path | None,
        typer.Option("--output", metavar="FILE", help="File to write; required for Parquet."),
    ] = None,
) -> None:
    """Decode a frame in hex, or a stream from a file or stdin.

    A frame on the command line must be complete and valid; otherwise the error is explained. A file
    contains hex text, raw bytes, or JSON captures: a list, or one object per line, each with one
    frame in "hex". A stream may be of any size.

    A file may also be a recorded session, which begins with "# stagewire capture" and names its protocol.
    Then line, time and direction are shown instead of offsets.

    Without --direction or --command, bytes are decoded as frames with a header. The commands and replies of
    an MS-2000 have no header: --direction command decodes a stream of commands, and --command NAME decodes
    one reply to that command.

    CSV and Parquet have one row per event, with the fields as JSON. With --message they have one row per
    frame of that message, and one typed column per field. Offsets count bytes from the beginning. An existing
    output file is replaced when everything has been written.

    With --stage, every format also shows positions, velocities and accelerations in mm or degrees: as the
    key or column "engineering" with names such as position_mm, and with --message as columns of their own.
    The stage applies to all channels.

    Exit code 1 means that a frame was invalid, or that a stream contained garbage, a packet too short
    for its message, or an incomplete end. An unknown message in a stream is not an error, because newer
    controllers send messages that the registry does not contain. As the only frame, or in a JSON capture, it
    is an error.
    """
    wanted = _format(format, as_json, target)
    if wanted is Format.PARQUET and target is None:
        raise CalledWronglyError("Parquet is binary: give --output FILE")
    given = _given(source)
    if target is not None:
        check_output(target, given if isinstance(given, Path) else None)
    total = Counts()
    with opened(given) as read:
        contexts = tuple(context or ())
        options = (protocol, status, direction, command, message, read.heading, contexts)
        task = Selection(*options).task()
        units_of = {"unit": unit, "scale_source": scale_source}
        task.stage_values = _stage_values(stage, stages, read.heading, units_of)
        try:
            check_format(wanted, task)
        except CodecError as error:
            raise CalledWronglyError(f"--message: {error}") from None
        with (
            output(target, binary=wanted is Format.PARQUET) as out,
            writing(wanted, task, out) as made,
            # Output that scrolls on a terminal is progress enough.
            progress(quiet=target is None and sys.stdout.isatty()) as say,
        ):
            Decoding(task, made, end, total, say).of(read)
    alone = isinstance(given, bytes) and end is None
    if target or (not alone and (wanted is not Format.JSONL or task.only)):
        typer.echo(total.summary, err=True)
    if not total.right:
        raise typer.Exit(WRONG)


def _format(format: Format | None, as_json: bool, target: Path | None) -> Format:
    """Return the format of the options; without one, that of the suffix of the output file."""
    if not as_json:
        suffix = "" if target is None else target.suffix.lower().removeprefix(".")
        return format or (Format(suffix) if suffix in _SUFFIXES else Format.TABLE)
    if format not in (None, Format.JSONL):
        raise CalledWronglyError(
            f"--json means --format jsonl and contradicts --format {format.value}"
        )
    return Format.JSONL


def _stage_values(
    name: str | None, file: Path | None, recorded: Heading | None, given: Mapping[str, str | None]
) -> StageValues | None:
    """Return the stage whose units are shown; raise :class:`CalledWronglyError` if it has no scales."""
    if name is None:
        for option, value in given.items():
            if value is not None:
                raise CalledWronglyError(f"--{option.replace('_', '-')} requires --stage")
        return None
    if given["unit"]:
        check_unit(given["unit"])
    unit = given["unit"].upper() if given["unit"] else recorded.unit if recorded else None
    values = StageValues(one_stage(name, file, unit), unit, given["scale_source"])
    values.check()
    return values


def _given(source: list[str]) -> Path | bytes | None:
    """Return the input that the arguments name: a file, bytes in hex, or None for standard input."""
    if source == ["-"]:
        return None
    if len(source) == 1 and _is_file(source[0]):
        return Path(source[0])
    for word in source:
        if word == "-" or (_is_file(word) and not _is_hex(word)):
            raise CalledWronglyError(f"{word} must be the only argument; give one file at a time")
    try:
        return parse_hex(" ".join(source))
    except ValueError as error:
        word = str(error).removeprefix("line 1: ")
        raise CalledWronglyError(f"not an existing file, and not bytes in hex: {word}") from None


def _is_file(name: str) -> bool:
    try:
        return bool(name) and Path(name).exists()
    except (OSError, ValueError):  # too long, or with a NUL: not the name of a file
        return False


def _is_hex(word: str) -> bool:
    try:
        return bool(parse_hex(word))
    except ValueError:
        return False
