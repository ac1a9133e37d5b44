"""``stagewire list`` and ``stagewire doctor``: ports and the controllers connected to them.

The first lists the serial ports of this computer; the second explains why no controller is found or why one
does not answer.
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Annotated

import typer

from stagewire.errors import BadValueError
from stagewire_cli.advice import for_command
from stagewire_cli.errors import WRONG, CalledWronglyError
from stagewire_cli.output import console, echo_wrapped, printable, progress, table

if TYPE_CHECKING:
    from stagewire.discovery import Diagnosis, Found

LIST_EXAMPLE = """\b
Examples:
  stagewire list
  stagewire list --ask --json
"""


def list_ports(
    ask: Annotated[
        bool,
        typer.Option(
            "--ask",
            help="Also open the ports of controllers and read identity and bays; nothing moves.",
        ),
    ] = False,
    as_json: Annotated[bool, typer.Option("--json", help="One JSON object per line.")] = False,
) -> None:
    """List controllers and serial ports.

    Without --ask no port is opened: the first digits of the USB serial number identify the unit.
    """
    from stagewire.discovery import discover

    found = discover(ask)
    if as_json:
        for one in found:
            typer.echo(json.dumps(_record(one)))
        return
    if found:
        _show(found, ask)
    if not any(one.is_controller for one in found):
        typer.echo("no controller found; to find out why, run stagewire doctor", err=True)


def _show(found: list[Found], ask: bool) -> None:
    said = ("firmware", "bays") if ask else ()
    shown = table("port", "unit", "serial number", *said, "description")
    for one in found:
        cells = [one.url, one.unit or "", one.serial_number if one.is_controller else ""]
        if ask:
            cells += [one.identity.firmware if one.identity else "", _bays(one)]
        what = f"{one.what}; {one.problem}" if one.problem else one.what
        shown.add_row(*map(printable, cells), printable(what), style="red" if one.problem else None)
    console().print(shown)


def _bays(found: Found) -> str:
    return "" if found.bays is None else ", ".join(map(str, found.bays)) or "none"


def _record(found: Found) -> dict[str, object]:
    """Return the facts about a port for programs."""
    return {
        "url": found.url,
        "unit": found.unit,
        "units": [known.name for known in found.known],
        "messages_of": [known.unit for known in found.known],
        "controller": found.is_controller,
        "serial_number": found.serial_number,
        "usb": found.port.usb,
        "description": found.port.description,
        "manufacturer": found.port.manufacturer,
        "model": found.identity.model if found.identity else None,
        "firmware": found.identity.firmware if found.identity else None,
        "bays": found.bays,
        "what": found.what,
        "problem": found.problem,
    }


DOCTOR_EXAMPLE = """\b
Examples:
  stagewire doctor
  stagewire doctor /dev/ttyUSB0
  stagewire doctor COM3 --unit MS2000
"""

_MARKS = {"fine": "fine ", "note": "note ", "wrong": "WRONG"}
_INDENT = " " * 7


def doctor(
    url: Annotated[
        str | None,
        typer.Argument(
            metavar="[URL]",
            help="A port, socket://HOST:PORT or another URL.  [default: check the computer]",
        ),
    ] = None,
    unit: Annotated[
        str | None, typer.Option("--unit", metavar="NAME", help="Unit expected at the URL.")
    ] = None,
    ask: Annotated[
        bool,
        typer.Option(
            "--ask", help="Without a URL: also open the ports of controllers and identify them."
        ),
    ] = False,
) -> None:
    """Find out why a controller is missing or does not answer.

    Without a URL it checks ports, permissions and drivers. With a URL it asks the controller for its
    identity, if necessary at each documented baud rate, and changes nothing. Each problem is printed with a
    remedy, and each usable controller with the class to import and a next command.

    Exit code 1 means that there is a problem.
    """
    from stagewire.discovery import Verdict, diagnose_computer, diagnose_line

    if url is None and unit is not None:
        raise CalledWronglyError(f"--unit {unit} requires a URL")
    with progress() as say:
        if url is None:
            say("looking at ports")
            told = diagnose_computer(ask)
        else:
            say(f"asking {url}")
            try:
                told = diagnose_line(url, unit)
            except BadValueError as error:
                raise CalledWronglyError(str(error)) from None
    for one in told:
        _print_diagnosis(one)
    if any(one.verdict is Verdict.WRONG for one in told):
        raise typer.Exit(WRONG)


def _print_diagnosis(diagnosis: Diagnosis) -> None:
    about, text = printable(diagnosis.about), printable(for_command(diagnosis.text))
    echo_wrapped(f"{_MARKS[diagnosis.verdict.value]}  {about}: {text}", indent=_INDENT)
    if diagnosis.advice:
        advice = printable(for_command(diagnosis.advice))
        echo_wrapped(f"{_INDENT}{advice}", indent=_INDENT)
