"""Record a move to CSV while it runs, and plot the position over time.

    python examples/python/log_and_plot.py
    python examples/python/log_and_plot.py /dev/ttyUSB0

Requires matplotlib. For a real controller, change the class and the stage below. Without an argument the
controller is virtual.
"""

from __future__ import annotations

import csv
import sys

from matplotlib.figure import Figure

from stagewire_apt import TDC001, stages


def main(url: str = "virtual://TDC001?stage=Z8", name: str = "move") -> None:
    """Record two moves, and draw them."""
    file = f"{name}.csv"
    with (
        TDC001.open(url, stage=stages.Z8, travel_mm=12) as tdc,
        tdc.record(file, overwrite=True) as recording,  # a row for each status
    ):
        for target in (1.0, 0.5):
            tdc.move_absolute(mm=target)
    print(f"{recording.rows} rows in {file}")

    with open(file, newline="") as table:
        rows = list(csv.DictReader(table))
    times = [float(row["time_s"]) for row in rows]
    positions = [float(row["position_mm"]) for row in rows]
    figure = Figure()
    axes = figure.subplots()
    axes.plot(times, positions, ".-")
    axes.set_xlabel("time / s")
    axes.set_ylabel("position / mm")
    figure.savefig(f"{name}.png")
    print(f"plotted in {name}.png")


if __name__ == "__main__":
    main(*sys.argv[1:])
