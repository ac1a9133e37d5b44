"""Continue a series of moves after the USB plug was pulled and put back.

    python examples/python/recover.py
    python examples/python/recover.py /dev/ttyUSB0

Pull the plug of a real controller while the program runs. Without an argument the controller is virtual, and
its line is cut during the third move.
"""

from __future__ import annotations

import sys
import time

from stagewire.errors import StagewireError, TransportLostError
from stagewire_apt import TDC001, stages

TARGETS_MM = (0.2, 0.4, 0.6, 0.8)
UNPLUGGED = "to_host disconnect frame message=MOT_MOVE_COMPLETED at=3"


def back(tdc: TDC001) -> None:
    """Reopen the line, wait until the stage has stopped, and home it if it lost its position."""
    while True:
        try:
            tdc.reconnect()
            break
        except StagewireError as error:
            print(f"not yet: {error}")
            time.sleep(1)
    while tdc.is_moving():  # no stop could be sent
        time.sleep(0.1)
    if not tdc.is_homed():  # it also lost its power
        print("homing again")
        tdc.home()


def main(url: str = f"virtual://TDC001?stage=Z8&position=20000&faults={UNPLUGGED}") -> None:
    """Home, and move to each target; after a loss of the line, continue with the same target."""
    with TDC001.open(url, stage=stages.Z8, travel_mm=12) as tdc:
        tdc.home()
        for target in TARGETS_MM:
            try:
                tdc.move_absolute(mm=target)
            except TransportLostError:
                print("the line was lost")
                back(tdc)
                tdc.move_absolute(mm=target)  # the library never sends a move twice by itself
            print(f"at {tdc.position_mm:.4f} mm")


if __name__ == "__main__":
    main(*sys.argv[1:])
