"""Home a stage, scan 20 positions, and write what a detector reads at each to a CSV file.

    python examples/python/scan.py
    python examples/python/scan.py /dev/ttyUSB0

For a real controller, change the class and the stage below. Without an argument the controller is virtual.
"""

from __future__ import annotations

import csv
import math
import sys
import time

from stagewire_apt import TDC001, stages

START_MM, STEP_MM, POSITIONS = 1.0, 0.02, 20


def detector(position_mm: float) -> float:
    """Return a simulated reading, with a line at 1.2 mm; read your instrument here."""
    return math.exp(-(((position_mm - 1.2) / 0.1) ** 2))


def main(url: str = "virtual://TDC001?stage=Z8&position=20000", file: str = "scan.csv") -> None:
    """Home, and write a row for each position."""
    with TDC001.open(url, stage=stages.Z8, travel_mm=12) as tdc, open(file, "w", newline="") as out:
        table = csv.writer(out)
        table.writerow(["position_mm", "signal"])
        tdc.home()
        for number in range(POSITIONS):
            tdc.move_absolute(mm=START_MM + number * STEP_MM)
            time.sleep(0.02)  # let the stage settle
            position = tdc.position_mm  # where it is, not where it should be
            signal = detector(position)
            table.writerow([f"{position:.5f}", f"{signal:.5f}"])
            print(f"{position:8.4f} mm  {signal:.4f}")


if __name__ == "__main__":
    main(*sys.argv[1:])
