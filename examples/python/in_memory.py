"""Home and move a virtual stage in memory, as a test of a driver would, without waiting.

    python examples/python/in_memory.py

There is no port. The controller's clock advances only when the program reads with a timeout, so the program
prints the same times on every machine.
"""

from __future__ import annotations

import stagewire_virtual as virtual
from stagewire import FramedMessage
from stagewire_apt import messages as m
from stagewire_apt import stages

HOST, USB = 0x01, 0x50
POSITION = stages.Z8.scale("position", "TDC001")
TIMEOUT = 60.0  # seconds of the controller's time


def ask(tdc: virtual.VirtualController, message: FramedMessage) -> None:
    """Send a message and print it and its answers, with the time on the controller's clock."""
    show(tdc, ">", message)
    tdc.write(message.pack(dest=USB, source=HOST))
    for event in tdc.read_frames(timeout=TIMEOUT):
        show(tdc, "<", event.frame.message)


def show(tdc: virtual.VirtualController, direction: str, message: FramedMessage) -> None:
    """Print a message on one line, with its position."""
    position = getattr(message, "position", None)
    place = "" if position is None else f"  {float(POSITION.from_counts(position)):.4f} mm"
    print(f"{tdc.clock.now / 1e9:9.6f} s {direction} {message.layout.message}{place}")


def main() -> None:
    """Home, move to 1.5 mm and read the position."""
    with virtual.TDC001(stage=stages.Z8) as tdc:
        ask(tdc, m.HwReqInfo())
        ask(tdc, m.MotMoveHome(chan_ident=1))
        ask(tdc, m.MotMoveAbsolute(chan_ident=1, absolute_distance=POSITION.to_counts("1.5")))
        ask(tdc, m.MotReqDcStatusUpdate(chan_ident=1))


if __name__ == "__main__":
    main()
