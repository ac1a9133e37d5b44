"""The board of ``stagewire monitor``: the latest status of every part, and the rate of updates.

With ``--plot`` it is drawn as a picture of position and velocity over time.
"""

from __future__ import annotations

from array import array
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from stagewire_cli.errors import CalledWronglyError
from stagewire_cli.output import output
from stagewire_cli.status import Reading

_RATE_OVER = 2.0  # seconds over which the rate of messages is counted


@dataclass(slots=True)
class Track:
    """Positions and velocities of one part over time, for a picture.

    :param position_unit: the unit of the positions; empty for counts.
    """

    position_unit: str = ""
    times: array[float] = field(default_factory=lambda: array("d"))
    positions: array[float] = field(default_factory=lambda: array("d"))
    velocities: array[float] = field(default_factory=lambda: array("d"))
    _sent: bool = True

    def add(self, reading: Reading) -> None:
        """Add the position and velocity of a reading."""
        position = reading.values.get("position")
        if position is None:
            return
        self.position_unit = position.unit
        velocity = reading.values.get("velocity")
        # Raw velocities are not in counts of the position per second.
        if velocity is None or not velocity.unit:
            self._sent = False
        self.times.append(reading.time)
        self.positions.append(position.number)
        self.velocities.append(0.0 if velocity is None else velocity.number)

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


class Board:
    """The latest reading of every part, with the rate of readings.

    :param track: whether to keep all positions for a picture.
    """

    def __init__(self, *, track: bool = False) -> None:
        self.latest: dict[str, Reading] = {}
        self.tracks: dict[str, Track] = {}
        self.dropped = 0
        self.count = 0
        self._times: dict[str, deque[float]] = {}
        self._track = track

    def add(self, reading: Reading) -> None:
        """Add a reading."""
        self.count += 1
        self.latest[reading.part] = reading
        times = self._times.setdefault(reading.part, deque())
        times.append(reading.time)
        if self._track:
            self.tracks.setdefault(reading.part, Track()).add(reading)

    def rate(self, part: str, now: float) -> float:
        """Return the number of readings of a part per second, over the last two seconds."""
        times = self._times[part]
        while times and times[0] < now - _RATE_OVER:
            times.popleft()
        return len(times) / min(_RATE_OVER, max(now, 0.1))


_FORMATS = (".png", ".svg")
_MISSING = "--plot requires matplotlib; install it with pip install 'stagewire[plot]'"


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
    :param tracks: the recorded tracks by part.

    Raises :class:`OSError` for a file that cannot be written.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    units = list(dict.fromkeys(track.position_unit for track in tracks.values())) or [""]
    figure = Figure(figsize=(9 * len(units), 6), layout="constrained")
    FigureCanvasAgg(figure)
    figure.suptitle(title)
    axes = figure.subplots(2, len(units), sharex=True, squeeze=False)
    for column, unit in enumerate(units):
        above, below = axes[0][column], axes[1][column]
        for part, track in tracks.items():
            if track.position_unit == unit:
                above.plot(track.times, track.positions, label=part or None)
                below.plot(*track.velocity(), label=part or None)
        name = unit or "counts"
        above.set_ylabel(f"position / {name}")
        below.set_ylabel(f"velocity / ({name}/s)")
        below.set_xlabel("time / s")
        for one in (above, below):
            one.grid(visible=True, alpha=0.3)
        if any(part for part in tracks):
            above.legend(loc="best")
    with output(path, binary=True) as file:
        figure.savefig(file, format=path.suffix[1:].lower(), dpi=120)
