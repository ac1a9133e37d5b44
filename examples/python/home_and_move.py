"""Home a stage and move it with the device class of its controller.

    python examples/python/home_and_move.py
    python examples/python/home_and_move.py /dev/ttyUSB0

Without an argument the controller is a virtual TDC001 with a stage of the Z8 series, in real time.
"""

from __future__ import annotations

import sys

from stagewire import StagewireError
from stagewire_apt import TDC001, stages


def main(url: str = "virtual://TDC001?stage=Z8") -> None:
    """Print the controller, home, make two moves, and change the jog step."""
    with TDC001.open(url, stage=stages.Z8, travel_mm=12) as tdc:
        print(tdc)
        ended = tdc.home()
        print(f"homed in {ended.seconds:.1f} s")
        for target in (1.5, 0.5):
            ended = tdc.move_absolute(mm=target)
            position = tdc.get_dc_status_update().position_mm
            print(f"at {position:.4f} mm after {ended.seconds:.1f} s")
        print(tdc.change_jog_params(step_size_mm=0.1))


if __name__ == "__main__":
    try:
        main(*sys.argv[1:2])
    except StagewireError as error:
        sys.exit(f"{type(error).__name__}: {error}")
