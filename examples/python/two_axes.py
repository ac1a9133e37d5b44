"""Move the two axes of a stage at the same time, and wait for both.

    python examples/python/two_axes.py
    python examples/python/two_axes.py socket://10.0.0.5:4001

Without an argument the rack is virtual.
"""

from __future__ import annotations

import sys

from stagewire_apt import BBD102, stages

CORNERS_MM = [(2, 1), (2, 3), (4, 3), (4, 1)]


def main(url: str = "virtual://BBD102?stage=MLS203") -> None:
    """Home both axes, then move them along a rectangle."""
    with BBD102.open(url, stage=stages.MLS203, travel_mm=100) as rack:
        x, y = rack.bays
        for homing in [x.start_home(), y.start_home()]:
            homing.wait()
        for x_mm, y_mm in CORNERS_MM:
            # start_… returns at once; wait() returns when the motion has ended, or raises.
            motions = [x.start_move_absolute(mm=x_mm), y.start_move_absolute(mm=y_mm)]
            seconds = max(motion.wait().seconds for motion in motions)
            print(f"x {x.position_mm:.3f} mm, y {y.position_mm:.3f} mm after {seconds:.2f} s")


if __name__ == "__main__":
    main(*sys.argv[1:])
