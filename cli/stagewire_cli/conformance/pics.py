"""``stagewire conformance pics``: a first declaration of a controller, by asking it what it answers."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from stagewire_cli.conformance.files import UNFINISHED, ReportFiles
from stagewire_cli.errors import CalledWronglyError
from stagewire_cli.output import output, printable, progress

__all__ = ["EXAMPLE", "pics"]

EXAMPLE = """\b
Examples:
  stagewire conformance pics --from /dev/ttyUSB0 --out pics.toml
  stagewire conformance pics --from COM3 --unit MS2000
\b
Exit status:
  0    the file was written
  2    called wrongly
  4    nothing answers, or the line was lost
"""


def pics(
    url: Annotated[
        str,
        typer.Option(
            "--from",
            metavar="URL",
            help="A port, socket://HOST:PORT, virtual://NAME or another line.",
        ),
    ],
    unit: Annotated[
        str | None,
        typer.Option("--unit", metavar="NAME", help="Unit that is there.  [default: what it says]"),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out", metavar="FILE", help="Write it to a file, which must not be there yet."
        ),
    ] = None,
) -> None:
    """Write a PICS, in which a vendor declares what a controller can do.

    The controller is asked what it is, which bays are used, and then every request of its unit once. What
    does not answer is written down as unsupported. Nothing is set, and nothing moves. Stages, travels and
    promises are for you to fill in.
    """
    from stagewire.errors import BadValueError, StagewireError, TransportError
    from stagewire.links import open_link
    from stagewire_cli.conformance.told import contradiction
    from stagewire_conformance.device.errors import NothingAnswersError
    from stagewire_conformance.device.pics_draft import ask_pics

    if out is not None:
        ReportFiles.check_file(out, "--out")
        if out.exists():
            raise CalledWronglyError(
                f"--out: {out} is there already, and may have been filled in by hand; name another file"
            )
    try:
        with progress() as say, open_link(url) as link:
            text = ask_pics(link, unit or "", lambda about: say(printable(about)))
            doubt = contradiction(link, unit) if unit else ""
    except (NothingAnswersError, TransportError) as error:
        typer.echo(f"stagewire: {printable(str(error))}", err=True)
        raise typer.Exit(UNFINISHED) from None
    except (StagewireError, BadValueError) as error:
        raise CalledWronglyError(str(error)) from None
    if doubt:
        typer.echo(f"stagewire: warning: {doubt}", err=True)
        text = f"# Doubtful: {doubt}.\n{text}"
    with output(out) as stream:
        stream.write(text)
    if out is not None:
        typer.echo(
            f"written: {printable(str(out))}; fill in the stages, then run: "
            "stagewire conformance device URL --pics FILE"
        )
