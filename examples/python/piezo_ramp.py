"""Ramp the output of a piezo driver up and down in small steps, and back to 0 V whatever happens.

    python examples/python/piezo_ramp.py
    python examples/python/piezo_ramp.py /dev/ttyUSB0

Before you use a real driver, check the maximum voltage of your actuator. Without an argument the driver is
virtual.
"""

from __future__ import annotations

import sys
import time

from stagewire_apt import TPZ001

TOP_VOLTS, STEP_VOLTS, PAUSE_S = 30, 2, 0.02


def main(url: str = "virtual://TPZ001") -> None:
    """Ramp up and down, and print the voltage that the driver reports."""
    with TPZ001.open(url, max_volts=75) as piezo:
        up = list(range(0, TOP_VOLTS, STEP_VOLTS))
        try:
            for volts in [*up, TOP_VOLTS, *reversed(up)]:
                piezo.set_output_volts(volts=volts)
                time.sleep(PAUSE_S)
                print(f"{volts:3d} V asked, {piezo.get_output_volts().volts:6.2f} V at the output")
        finally:
            piezo.set_output_volts(volts=0)


if __name__ == "__main__":
    main(*sys.argv[1:])
