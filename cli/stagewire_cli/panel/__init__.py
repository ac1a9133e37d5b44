"""``stagewire panel``: watch and move several axes on one screen, with one key that stops them all.

``axis.py`` and ``stops.py`` work without Textual. ``app.py``, ``card.py`` and ``dialogues.py`` draw.
"""

from __future__ import annotations

from typing import Annotated

import typer

from stagewire_cli import completion
from stagewire_cli.stages import StagesFile, chosen_stage

EXAMPLE = """\b
Examples:
  stagewire panel "virtual://TDC001?stage=Z8" --stage Z8 --travel 12
  stagewire panel /dev/ttyUSB0 /dev/ttyUSB1 --stage Z825B --stage MTS50-Z8
  stagewire panel socket://10.0.0.5:4001 --unit BBD102 --stage MLS203
"""


def panel(
    line: Annotated[
        list[str],
        typer.Argument(
            metavar="URL",
            help="Ports, socket://HOST:PORT, virtual://NAME or other URLs.",
            autocompletion=completion.urls,
        ),
    ],
    unit: Annotated[
        list[str] | None,
        typer.Option(
            "--unit",
            metavar="NAME",
            help="Name of the unit, such as TDC001; detected without it.",
            autocompletion=completion.units,
        ),
    ] = None,
    stage: Annotated[
        list[str] | None,
        typer.Option(
            "--stage",
            metavar="NAME",
            help="Stage on the controller; needed for mm and degrees.",
            autocompletion=completion.stages,
        ),
    ] = None,
    stages: StagesFile = None,
    scale_source: Annotated[
        list[str] | None,
        typer.Option(
            "--scale-source",
            metavar="NAME",
            help="Source of scales on which sources disagree, such as vendor.",
        ),
    ] = None,
    travel: Annotated[
        list[str] | None,
        typer.Option(
            "--travel",
            metavar="LENGTH|LOW,HIGH",
            help="Allowed positions: 12 for 0 to 12 mm, -5,5, or -8,8deg.",
        ),
    ] = None,
    bay: Annotated[
        list[int] | None,
        typer.Option("--bay", min=1, help="Bay of a module in its rack, from 1."),
    ] = None,
) -> None:
    """Watch and move several axes on one screen. The space bar stops them all.

    Shows the position, travel, limit switches and state of every axis, and the keys. Nothing moves on
    start, and no setting is written. Quitting stops all axes. Give an option once for all URLs, or once
    for each in their order. Needs a terminal and the extra stagewire[panel].
    """
    from stagewire_cli.panel.session import Line, run

    chosen = [chosen_stage(name, stages) for name in stage] if stage else None
    run(Line.each(line, unit=unit, stage=chosen, scale_source=scale_source, travel=travel, bay=bay))
