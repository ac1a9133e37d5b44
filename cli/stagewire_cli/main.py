"""The ``stagewire`` command: its sub-commands, exit codes and error output.

Exit codes: 0 for success, 1 if the checked input is wrong, 2 for wrong arguments, 130 if it was interrupted.
Commands with further exit codes list them in their help. Invalid input never causes a traceback.
"""

from __future__ import annotations

import contextlib
import gc
import io
import os
import sys
import warnings
from collections.abc import Sequence

import typer

import stagewire
from stagewire.errors import StagewireError
from stagewire_cli.advice import for_command
from stagewire_cli.commands import NAMES, Commands, add
from stagewire_cli.completion import completed_words
from stagewire_cli.errors import CALLED_WRONGLY, INTERRUPTED, OK, WRONG, CalledWronglyError
from stagewire_cli.output import printable

_WITHOUT_COMMAND = {(), ("-h",), ("--help",), ("--version",)}


def command(arguments: Sequence[str] | None = None) -> typer.Typer:
    """Return the command with the sub-command that the arguments name, or else with all sub-commands.

    Importing and describing all sub-commands takes longer than running most of them.

    :param arguments: None means any.
    """
    app = typer.Typer(
        name="stagewire",
        cls=Commands,
        help="Control, simulate and test motion controllers; encode and decode messages.",
        no_args_is_help=True,
        rich_markup_mode=None,
        pretty_exceptions_enable=False,
        add_completion=False,
        context_settings={"help_option_names": ["-h", "--help"]},
    )
    app.callback()(_options)
    words = completed_words()
    if words is not None:
        arguments = words
    elif arguments is not None and tuple(arguments) in _WITHOUT_COMMAND:
        return app
    for name in set(arguments[:1] if arguments else ()) & set(NAMES) or NAMES:
        add(app, name)
    return app


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"stagewire {stagewire.__version__}")
        raise typer.Exit(OK)


def _options(
    version: bool = typer.Option(
        False, "--version", callback=_version, is_eager=True, help="Print the version and exit."
    ),
) -> None:
    """Control, simulate and test motion controllers; encode and decode messages."""


def run() -> None:
    """Run the command with the arguments of this process, and end the process."""
    # Most objects live until the end of the process, so frequent garbage collection would only cost a tenth
    # of the time.
    gc.set_threshold(100_000, 50, 50)
    code = main(sys.argv[1:])
    gc.freeze()  # otherwise the end of the process searches all objects, for up to a tenth of the time
    try:
        sys.stdout.flush()
    except BrokenPipeError:
        _drop_output()
    sys.exit(code)


def main(arguments: Sequence[str]) -> int:
    """Run the command and return its exit code; print errors as sentences on standard error."""
    _open_what_is_closed()
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("default", FutureWarning)
            warnings.showwarning = _warn
            command(arguments)(list(arguments), prog_name="stagewire")
    except SystemExit as end:
        return end.code if isinstance(end.code, int) else OK if end.code is None else WRONG
    except CalledWronglyError as error:
        return _fail(error, CALLED_WRONGLY)
    except BrokenPipeError:
        _drop_output()
        return WRONG
    except StagewireError as error:
        return _fail(error, WRONG)
    except OSError as error:
        named = f"{error.filename}: " if error.filename else ""
        return _fail(f"{named}{error.strerror or error}", CALLED_WRONGLY)
    except KeyboardInterrupt:
        return _fail("interrupted", INTERRUPTED)
    return OK


def _open_what_is_closed() -> None:
    """Open standard streams that were closed when the process started (``>&-``)."""
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, mode, encoding="utf-8"))  # noqa: SIM115


def _warn(
    message: Warning | str,
    category: type[Warning],
    filename: str,
    lineno: int,
    file: object = None,
    line: object = None,
) -> None:
    """Print only the text of a warning, without the source line."""
    with contextlib.suppress(OSError):
        print(printable(for_command(f"warning: {message}")), file=sys.stderr)


def _fail(problem: object, code: int) -> int:
    lines = [printable(line) for line in for_command(f"stagewire: {problem}").split("\n")]
    with contextlib.suppress(OSError):  # no one left to report to
        print("\n".join(lines), file=sys.stderr)
    return code


def _drop_output() -> None:
    """Discard buffered output, because its reader has closed the pipe."""
    with contextlib.suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
