"""``stagewire conformance device`` and ``pics``: check a controller on a line, and draft its declaration.

The suite is imported only when one of them is called.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from stagewire_cli import completion
from stagewire_cli.conformance.sheets import Html, Json, Junit, ReportFiles, listing, several
from stagewire_cli.errors import CalledWronglyError
from stagewire_cli.output import output, printable, progress
from stagewire_cli.stages import StagesFile
from stagewire_conformance.reports import Verdict

DEVICE_EXAMPLE = """\b
Examples:
  stagewire conformance device /dev/ttyUSB0 --unit TDC001
  stagewire conformance device COM3 --pics pics.toml --allow-settings --html report.html
  stagewire conformance device "virtual://TDC001?stage=Z8" --pics pics.toml --allow-motion 0..3mm
  stagewire conformance device --unit BBD102 --list
\b
Exit status:
  0    all checks that ran passed
  1    a check failed
  2    invalid arguments, or an invalid PICS
  3    no check failed, but the controller departs from a recommendation
  4    the run did not finish: the controller does not answer, the connection was lost, or
       something is not at rest
  130  interrupted
"""


def device(
    url: Annotated[
        str | None,
        typer.Argument(
            metavar="URL",
            help="A port, socket://HOST:PORT, virtual://NAME or another URL.",
            autocompletion=completion.urls,
        ),
    ] = None,
    unit: Annotated[
        str | None,
        typer.Option(
            "--unit",
            metavar="NAME",
            help="Unit to assume without a PICS.",
            autocompletion=completion.units,
        ),
    ] = None,
    pics: Annotated[
        Path | None,
        typer.Option(
            "--pics",
            metavar="FILE",
            help="Declaration of the controller; stagewire conformance pics drafts one.",
        ),
    ] = None,
    stages: StagesFile = None,
    allow_settings: Annotated[
        bool,
        typer.Option("--allow-settings", help="Allow settings to be changed; they are restored."),
    ] = False,
    allow_tuning: Annotated[
        bool,
        typer.Option(
            "--allow-tuning",
            help="Allow gains and currents of control loops to be changed; they are restored.",
        ),
    ] = False,
    allow_motion: Annotated[
        str | None,
        typer.Option(
            "--allow-motion",
            metavar="MIN..MAX",
            help="Allow motion and outputs within this range: 0..5mm, 0..90deg, 0..20V or 0..2000counts "
            "(steps of a drive).",
        ),
    ] = None,
    allow_eeprom: Annotated[
        bool,
        typer.Option("--allow-eeprom", help="Allow saving the current settings to EEPROM."),
    ] = False,
    allow_laser: Annotated[
        bool,
        typer.Option(
            "--allow-laser",
            help="Allow lasers to be switched on, and their light to be changed.",
        ),
    ] = False,
    allow_heater: Annotated[
        bool,
        typer.Option(
            "--allow-heater",
            help="Allow the current of heaters and coolers to be changed.",
        ),
    ] = False,
    allow_shutter: Annotated[
        bool,
        typer.Option(
            "--allow-shutter",
            help="Allow shutters to be opened, with --allow-motion.",
        ),
    ] = False,
    allow_piezo: Annotated[
        bool,
        typer.Option(
            "--allow-piezo",
            help="Allow output voltages of piezo drivers to be changed, with --allow-motion.",
        ),
    ] = False,
    allow_zero: Annotated[
        bool,
        typer.Option(
            "--allow-zero",
            help="Allow piezo actuators to move through their whole range to find the zero.",
        ),
    ] = False,
    allow_inertial: Annotated[
        bool,
        typer.Option(
            "--allow-inertial",
            help="Allow drive voltages of inertial motors to be changed, with --allow-tuning.",
        ),
    ] = False,
    only: Annotated[
        list[str] | None,
        typer.Option(
            "--only",
            metavar="NAMES",
            help="Run only checks of these ids (with * and ?), kinds or messages, separated by commas; may "
            "be repeated.",
        ),
    ] = None,
    list_checks: Annotated[
        bool,
        typer.Option("--list", help="List the checks with their permissions and pages, and exit."),
    ] = False,
    seed: Annotated[
        int,
        typer.Option(
            "--seed",
            metavar="NUMBER",
            help="Seed of random choices; the same seed sends the same bytes.",
        ),
    ] = 1,
    junit: Junit = None,
    json: Json = None,
    html: Html = None,
    log: Annotated[
        Path | None,
        typer.Option("--log", metavar="FILE", help="Record the traffic as a capture."),
    ] = None,
) -> None:
    """Test a controller against its protocol document, and report the rules that it violates.

    By default the suite only sends requests and faulty frames, and starts and stops status updates. Each
    --allow option permits more. The suite prints its plan before the run. Each check restores the settings
    that it changes. After Ctrl-C, the suite first stops everything that it set in motion, and then restores
    the settings.
    """
    from stagewire_cli.conformance.device_run import plan_of, run_session, show_list

    files = ReportFiles(junit, json, html, others=(("--log", log), ("--pics", pics)))
    files.check()
    if log is not None:
        files.check_file(log, "--log")
    plan = plan_of(
        unit,
        pics,
        motion=allow_motion,
        granted={
            "settings": allow_settings,
            "tuning": allow_tuning,
            "eeprom": allow_eeprom,
            "laser": allow_laser,
            "heater": allow_heater,
            "shutter": allow_shutter,
            "piezo": allow_piezo,
            "zero": allow_zero,
            "inertial": allow_inertial,
        },
        only=several(only),
        seed=seed,
        stages=stages,
    )
    if list_checks:
        with listing():
            show_list(plan)
        return
    if url is None:
        raise CalledWronglyError("missing URL: give a port or a URL, such as /dev/ttyUSB0 or COM3")
    code = run_session(url, plan, files, log)
    if code:
        raise typer.Exit(code)


PICS_EXAMPLE = """\b
Examples:
  stagewire conformance pics --from /dev/ttyUSB0 --out pics.toml
  stagewire conformance pics --from COM3 --unit MS2000
\b
Exit status:
  0    the file was written
  2    invalid arguments
  4    no controller answers, or the connection was lost
"""


def pics(
    url: Annotated[
        str,
        typer.Option(
            "--from",
            metavar="URL",
            help="A port, socket://HOST:PORT, virtual://NAME or another URL.",
        ),
    ],
    unit: Annotated[
        str | None,
        typer.Option("--unit", metavar="NAME", help="Unit to assume.  [default: as reported]"),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out", metavar="FILE", help="Write the PICS to this file, which must not exist yet."
        ),
    ] = None,
) -> None:
    """Draft a PICS: the declaration of what a controller supports.

    The command reads the identity of the controller and its bays, and sends every request of the unit once.
    Requests that get no answer are listed as unsupported. No setting is changed, and nothing moves. Add the
    stages, their travel and the reply time yourself.
    """
    from stagewire.errors import BadValueError, StagewireError, TransportError
    from stagewire.links import open_link
    from stagewire_conformance.device.errors import NothingAnswersError
    from stagewire_conformance.device.pics_draft import draft_pics

    if out is not None:
        ReportFiles.check_file(out, "--out")
        if out.exists():
            raise CalledWronglyError(
                f"--out: {out} already exists, and may have been edited; choose another file name"
            )
    try:
        with progress() as say, open_link(url) as link:
            draft = draft_pics(link, unit or "", lambda about: say(printable(about)))
    except (NothingAnswersError, TransportError) as error:
        typer.echo(f"stagewire: {printable(str(error))}", err=True)
        raise typer.Exit(Verdict.UNFINISHED.exit_status) from None
    except (StagewireError, BadValueError) as error:
        raise CalledWronglyError(str(error)) from None
    if draft.doubt:
        typer.echo(f"stagewire: warning: {printable(draft.doubt)}", err=True)
    with output(out) as stream:
        stream.write(draft.text)
    if out is not None:
        typer.echo(
            f"written: {printable(str(out))}; complete it, then run: "
            "stagewire conformance device URL --pics FILE"
        )
