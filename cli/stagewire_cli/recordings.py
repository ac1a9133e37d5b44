"""``--csv`` and ``--plot``: record a part of a controller while a command watches or moves it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from stagewire_cli.errors import CalledWronglyError
from stagewire_cli.output import check_output
from stagewire_cli.status import Value

if TYPE_CHECKING:
    from stagewire_cli.plots import Tracks

CsvFile = Annotated[
    Path | None,
    typer.Option("--csv", metavar="FILE", help="Record every status as CSV, in the stage's units."),
]
PlotFile = Annotated[
    Path | None,
    typer.Option(
        "--plot", metavar="FILE", help="Plot position and velocity over time (.png, .svg)."
    ),
]
Overwrite = Annotated[bool, typer.Option("--overwrite", help="Replace an existing --csv file.")]


@dataclass(frozen=True, slots=True)
class RecordFiles:
    """The files of a recording.

    :param csv: file for the statuses as CSV; None writes none.
    :param picture: file for a picture; None draws none. An existing one is replaced.
    :param overwrite: whether to replace an existing ``csv``.
    """

    csv: Path | None = None
    picture: Path | None = None
    overwrite: bool = False

    def __post_init__(self) -> None:
        """Raise :class:`CalledWronglyError` for files that cannot be written, before a line is opened."""
        if self.csv is not None:
            check_output(self.csv, None, "--csv")
            if self.csv.suffix.lower() != ".csv":
                raise CalledWronglyError(f"--csv {self.csv}: the file name must end in .csv")
            if self.csv.exists() and not self.overwrite:
                raise CalledWronglyError(
                    f"--csv: {self.csv} exists; give another name, or --overwrite to replace it"
                )
        if self.picture is not None:
            from stagewire_cli.plots import check_plot

            check_plot(self.picture)


@contextmanager
def recorded(
    part: Any,
    title: str,
    files: RecordFiles,
    goal: Value | None = None,
    *,
    listen: bool = False,
) -> Iterator[None]:
    """Record a part within a block; the files are complete however the block ends.

    :param title: the title of the picture.
    :param goal: where a motion is to end; None: unknown.
    :param listen: whether to send nothing.
    """
    with ExitStack() as stack:
        if files.picture is not None:
            from stagewire_cli.plots import Tracks

            tracks = Tracks()
            stack.callback(_draw, files.picture, title, tracks, goal)
            stack.enter_context(part.record(tracks.add, listen=listen))
        if files.csv is not None:
            stack.enter_context(part.record(files.csv, overwrite=files.overwrite, listen=listen))
        yield


def _draw(picture: Path, title: str, tracks: Tracks, goal: Value | None) -> None:
    from stagewire_cli.plots import plot

    if tracks:
        for track in tracks.values():
            if goal is not None and goal.unit == track.unit:
                track.target = goal.number
        plot(picture, title, tracks)
