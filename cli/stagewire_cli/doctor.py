"""``stagewire doctor``: why no controller is found, or why one does not answer."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from stagewire.errors import BadValueError
from stagewire_cli.errors import WRONG, CalledWronglyError
from stagewire_cli.progress import progress
from stagewire_cli.terminal import printable

if TYPE_CHECKING:
    from stagewire.discovery import Diagnosis

__all__ = ["EXAMPLE", "doctor"]

EXAMPLE = """\b
Examples:
  stagewire doctor
  stagewire doctor /dev/ttyUSB0
  stagewire doctor COM3 --unit MS2000
"""

_MARKS = {"fine": "fine ", "note": "note ", "wrong": "WRONG"}


def doctor(
    url: Annotated[
        str | None,
        typer.Argument(
            metavar="[URL]",
            help="A port, socket://HOST:PORT or other line to ask; without it the computer is looked at.",
        ),
    ] = None,
    unit: Annotated[
        str | None, typer.Option("--unit", metavar="NAME", help="Unit that should be there.")
    ] = None,
    ask: Annotated[
        bool,
        typer.Option(
            "--ask", help="Without a URL: open the ports of controllers, and ask who is there."
        ),
    ] = False,
) -> None:
    """Say what is wrong with ports and controllers, and what to do about it.

    Looks for missing ports and permissions, and for drivers that give no port. What is asked of a
    controller, when it is, changes nothing: its identity, at the documented baud rates if need be.
    """
    from stagewire.discovery import Verdict, diagnose_computer, diagnose_line

    if url is None and unit is not None:
        raise CalledWronglyError(f"--unit {unit}: on which line? give its URL, too")
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
        _tell(one)
    if any(one.verdict is Verdict.WRONG for one in told):
        raise typer.Exit(WRONG)


def _tell(diagnosis: Diagnosis) -> None:
    about, text = printable(diagnosis.about), printable(diagnosis.text)
    typer.echo(f"{_MARKS[diagnosis.verdict.value]}  {about}: {text}")
    if diagnosis.advice:
        typer.echo(f"       {printable(diagnosis.advice)}")
