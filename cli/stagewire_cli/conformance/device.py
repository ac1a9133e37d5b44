"""``stagewire conformance device``: whether a controller on a line does what its document says."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from stagewire_cli.conformance.files import Html, Json, Junit, ReportFiles
from stagewire_cli.errors import CalledWronglyError

__all__ = ["EXAMPLE", "device"]

EXAMPLE = """\b
Examples:
  stagewire conformance device /dev/ttyUSB0 --unit TDC001
  stagewire conformance device COM3 --pics pics.toml --allow-settings --html report.html
  stagewire conformance device "virtual://TDC001?stage=Z8" --pics pics.toml --allow-motion 0..3mm
  stagewire conformance device --unit BBD102 --list
\b
Exit status:
  0    all that was run passed
  1    a check failed
  2    called wrongly
  3    nothing failed, but something departs from what the document advises
  4    the run did not come to its end: nothing answers, or the line was lost
  130  interrupted
"""


def device(
    url: Annotated[
        str | None,
        typer.Argument(
            metavar="URL", help="A port, socket://HOST:PORT, virtual://NAME or another line."
        ),
    ] = None,
    unit: Annotated[
        str | None,
        typer.Option("--unit", metavar="NAME", help="Unit that is there, where no PICS says it."),
    ] = None,
    pics: Annotated[
        Path | None,
        typer.Option(
            "--pics",
            metavar="FILE",
            help="What the vendor declares of the controller; see stagewire conformance pics.",
        ),
    ] = None,
    allow_settings: Annotated[
        bool, typer.Option("--allow-settings", help="Change settings, and restore them.")
    ] = False,
    allow_motion: Annotated[
        str | None,
        typer.Option(
            "--allow-motion",
            metavar="MIN..MAX",
            help="Move within this range, such as 0..5mm, 0..20V or 0..100000counts; switch outputs.",
        ),
    ] = None,
    allow_eeprom: Annotated[
        bool,
        typer.Option(
            "--allow-eeprom", help="Let settings be written to the EEPROM, as they stand."
        ),
    ] = False,
    only: Annotated[
        list[str] | None,
        typer.Option(
            "--only",
            metavar="NAME",
            help="Only checks of this id (with * and ?), this kind or this message.",
        ),
    ] = None,
    list_checks: Annotated[
        bool, typer.Option("--list", help="Print the checks, what they need and pages; run none.")
    ] = False,
    seed: Annotated[
        int, typer.Option("--seed", metavar="NUMBER", help="The same seed sends the same bytes.")
    ] = 1,
    junit: Junit = None,
    json: Json = None,
    html: Html = None,
    log: Annotated[
        Path | None,
        typer.Option("--log", metavar="FILE", help="Record what is said, as a capture."),
    ] = None,
) -> None:
    """Check a controller against its document, and say which rules it breaks.

    Asks, and does nothing else, unless it is allowed to: each --allow option says what it opens. What will be
    done is said before. Ctrl-C, and whatever else ends the run, sends stops first, then restores settings.
    """
    from stagewire_cli.conformance.device_plan import planned
    from stagewire_cli.conformance.device_screen import show_list
    from stagewire_cli.conformance.screen import listing

    files = ReportFiles(junit, json, html, others=(("--log", log), ("--pics", pics)))
    files.check()
    if log is not None:
        files.check_file(log, "--log")
    what = planned(
        unit,
        pics,
        settings=allow_settings,
        motion=allow_motion,
        eeprom=allow_eeprom,
        only=tuple(only or ()),
        seed=seed,
    )
    if list_checks:
        with listing():
            show_list(what)
        return
    if url is None:
        raise CalledWronglyError("which line? give a port or a URL, such as /dev/ttyUSB0 or COM3")
    from stagewire_cli.conformance.device_session import run_session

    code = run_session(url, what, files, log)
    if code:
        raise typer.Exit(code)
