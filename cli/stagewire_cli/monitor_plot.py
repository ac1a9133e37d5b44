"""``stagewire monitor --plot``: a picture of position and velocity over time."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from stagewire_cli.errors import CalledWronglyError
from stagewire_cli.monitor_readings import Track
from stagewire_cli.outputs import output

__all__ = ["check_plot", "plot"]

_FORMATS = (".png", ".svg")
_MISSING = "--plot needs matplotlib: pip install 'stagewire[plot]'"


def check_plot(path: Path) -> None:
    """Raise :class:`CalledWronglyError` where no picture could be made, before anything is recorded."""
    if path.suffix.lower() not in _FORMATS:
        raise CalledWronglyError(f"--plot {path}: a picture ends in {' or '.join(_FORMATS)}")
    if not path.absolute().parent.is_dir():
        raise CalledWronglyError(f"--plot {path}: there is no folder {path.absolute().parent}")
    if path.exists() and not path.is_file():
        raise CalledWronglyError(f"--plot {path}: it is no regular file")
    try:
        import matplotlib  # noqa: F401
    except ImportError:
        raise CalledWronglyError(_MISSING) from None


def plot(path: Path, title: str, tracks: Mapping[str, Track]) -> None:
    """Draw position above velocity, a line for each part, and one column for each unit.

    :param path: where the picture goes; its ending says of which kind it is.
    :param title: what it shows, in one line.
    :param tracks: what was recorded, by part.

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
