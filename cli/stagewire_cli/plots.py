"""Pictures of ``--plot``: position and velocity over time, drawn from the rows of a recording."""

from __future__ import annotations

from array import array
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from stagewire_cli.errors import CalledWronglyError
from stagewire_cli.output import output

_FORMATS = (".png", ".svg")
_MISSING = "--plot requires matplotlib; install it with pip install 'stagewire[plot]'"


@dataclass(slots=True)
class Track:
    """Positions and velocities of one part over time.

    :param unit: the unit of the positions; empty for counts.
    :param target: where a motion was to end, in this unit; None: unknown.
    """

    unit: str = ""
    times: array[float] = field(default_factory=lambda: array("d"))
    positions: array[float] = field(default_factory=lambda: array("d"))
    velocities: array[float] = field(default_factory=lambda: array("d"))
    target: float | None = None
    _sent: bool = True

    def add(self, row: Mapping[str, Any]) -> None:
        """Add the position and velocity of a row."""
        for name, position in row.items():
            quantity, _, unit = name.partition("_")
            if quantity == "position" and position is not None:
                break
        else:
            return
        self.unit = "" if unit == "counts" else unit
        velocity = row.get(f"velocity_{unit}_per_s")  # raw ones are not in counts per second
        if velocity is None:
            self._sent = False
        self.times.append(row["time_s"])
        self.positions.append(position)
        self.velocities.append(velocity or 0.0)

    def velocity(self) -> tuple[list[float], list[float]]:
        """Return times and velocities, as sent by the controller or else derived from positions."""
        if self._sent:
            return list(self.times), list(self.velocities)
        times, speeds = [], []
        for index in range(1, len(self.times)):
            seconds = self.times[index] - self.times[index - 1]
            if seconds > 0:
                times.append((self.times[index] + self.times[index - 1]) / 2)
                speeds.append((self.positions[index] - self.positions[index - 1]) / seconds)
        return times, speeds


class Tracks(dict[str, Track]):
    """The tracks of a controller by part; the only part has an empty name."""

    def add(self, row: Mapping[str, Any]) -> None:
        """Add a row to the track of its part."""
        self.setdefault(row.get("part", ""), Track()).add(row)


def check_plot(path: Path) -> None:
    """Raise :class:`CalledWronglyError` if the picture cannot be drawn, before anything is recorded."""
    if path.suffix.lower() not in _FORMATS:
        raise CalledWronglyError(
            f"--plot {path}: the file name must end in {' or '.join(_FORMATS)}"
        )
    if not path.absolute().parent.is_dir():
        raise CalledWronglyError(f"--plot {path}: missing folder {path.absolute().parent}")
    if path.exists() and not path.is_file():
        raise CalledWronglyError(f"--plot {path}: not a regular file")
    try:
        import matplotlib  # noqa: F401
    except ImportError:
        raise CalledWronglyError(_MISSING) from None


def plot(path: Path, title: str, tracks: Mapping[str, Track]) -> None:
    """Draw position above velocity, with one line per part and one column per unit.

    :param path: the file; its suffix selects the format.
    :param title: the title of the picture, in one line.
    :param tracks: the recorded tracks by part; a target is drawn as a dashed line.

    Raises :class:`OSError` for a file that cannot be written.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    units = list(dict.fromkeys(track.unit for track in tracks.values())) or [""]
    figure = Figure(figsize=(9 * len(units), 6), layout="constrained")
    FigureCanvasAgg(figure)
    figure.suptitle(title)
    axes = figure.subplots(2, len(units), sharex=True, squeeze=False)
    for column, unit in enumerate(units):
        above, below = axes[0][column], axes[1][column]
        for part, track in tracks.items():
            if track.unit == unit:
                above.plot(track.times, track.positions, label=part or None)
                below.plot(*track.velocity(), label=part or None)
                if track.target is not None:
                    above.axhline(track.target, linestyle="--", color="0.5", label="target")
        name = unit or "counts"
        above.set_ylabel(f"position / {name}")
        below.set_ylabel(f"velocity / ({name}/s)")
        below.set_xlabel("time / s")
        for one in (above, below):
            one.grid(visible=True, alpha=0.3)
        if above.get_legend_handles_labels()[1]:
            above.legend(loc="best")
    with output(path, binary=True) as file:
        figure.savefig(file, format=path.suffix[1:].lower(), dpi=120)
