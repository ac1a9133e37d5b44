"""``stagewire conformance codec``: whether a codec in any language does what the documents say."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from stagewire_cli.conformance.files import Html, Json, Junit, ReportFiles
from stagewire_cli.errors import CalledWronglyError

__all__ = ["EXAMPLE", "codec"]

_LONGEST = 86_400
"""Seconds; a system waits for so long, and nobody longer."""

EXAMPLE = """\b
Examples:
  stagewire conformance codec -- stagewire testee
  stagewire conformance codec --protocol thorlabs_apt --html report.html -- ./testee --quiet
  stagewire conformance codec --expected expected.toml --junit report.xml -- java -jar testee.jar
  stagewire conformance codec --only MOT_SET_VELPARAMS -- ./testee
  stagewire conformance codec --only 'thorlabs_apt/cut/*' --list
\b
Exit status:
  0    all cases passed; a failure that is expected counts as passed
  1    a case failed, or passed though it is expected to fail
  2    called wrongly: there is no such program, no such case, or the file of expected failures is wrong
  4    the run did not come to its end: no testee answers, or it had to be started too often
  130  interrupted
"""


def codec(
    command: Annotated[
        list[str] | None,
        typer.Argument(metavar="COMMAND...", help="The testee and its arguments, behind --."),
    ] = None,
    protocol: Annotated[
        list[str] | None,
        typer.Option("--protocol", metavar="NAME", help="Only this protocol; may be repeated."),
    ] = None,
    timeout: Annotated[
        float, typer.Option("--timeout", metavar="SECONDS", help="How long an answer may take.")
    ] = 5.0,
    expected: Annotated[
        Path | None,
        typer.Option(
            "--expected", metavar="FILE", help="Cases that are known to fail, and why (TOML)."
        ),
    ] = None,
    only: Annotated[
        list[str] | None,
        typer.Option(
            "--only",
            metavar="NAME",
            help="Only cases of this id or group (with * and ?), or about this message.",
        ),
    ] = None,
    list_cases: Annotated[
        bool, typer.Option("--list", help="Print the cases; start no testee.")
    ] = False,
    seed: Annotated[
        int, typer.Option("--seed", metavar="NUMBER", help="The same seed sends the same lines.")
    ] = 1,
    junit: Junit = None,
    json: Json = None,
    html: Html = None,
) -> None:
    """Ask a codec all that it has to know, and say what it gets wrong.

    COMMAND is a program that reads requests from standard input, one JSON object a line, and writes an answer
    to each: docs/codec-conformance.md says how. It is asked every example of the documents, every case of
    the registry, streams cut at every place, and lines that are no requests. Where it crashes or does not
    answer, it is started again, and the run goes on.
    """
    from stagewire_cli.conformance.codec_session import Asked, run_session, show_list
    from stagewire_cli.conformance.screen import listing
    from stagewire_cli.protocols import one_or_all

    files = ReportFiles(junit, json, html, others=(("--expected", expected),))
    files.check()
    if not 0 < timeout <= _LONGEST:
        raise CalledWronglyError(
            f"--timeout is a number of seconds above 0, at most {_LONGEST}, not {timeout:g}"
        )
    names: list[str | None] = [*dict.fromkeys(protocol or [])]
    protocols = [one for name in names or [None] for one in one_or_all(name, whole=True)]
    asked = Asked(
        tuple(command or ()),
        tuple(protocols),
        bool(names),
        timeout,
        expected,
        tuple(only or ()),
        seed,
    )
    if list_cases:
        with listing():
            show_list(asked)
        return
    if not command:
        raise CalledWronglyError("which testee? give its command behind --, such as -- ./testee")
    code = run_session(asked, files)
    if code:
        raise typer.Exit(code)
