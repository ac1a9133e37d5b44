"""A driver's test in miniature: a virtual stage is homed and moved, in no time.

    python examples/python/in_memory.py

Nothing is opened and nobody waits: the controller's clock goes on when the program says so, and the same
program prints the same times wherever it runs.
"""

from __future__ import annotations

import stagewire_virtual as virtual
from stagewire import FramedMessage
from stagewire_apt import messages as m
from stagewire_apt import stages

HOST, USB = 0x01, 0x50
POSITION = stages.Z8.scale("position", "TDC001")
PATIENCE = 60.0  # seconds of the controller's time


def ask(tdc: virtual.VirtualController, message: FramedMessage) -> None:
    """Send a message and show what comes back, each with the time on the controller's clock."""
    show(tdc, ">", message)
    tdc.write(message.pack(dest=USB, source=HOST))
    for event in tdc.read_frames(timeout=PATIENCE):
        show(tdc, "<", event.frame.message)


def show(tdc: virtual.VirtualController, direction: str, message: FramedMessage) -> None:
    """Print a message in a line."""
    position = getattr(message, "position", None)
    place = "" if position is None else f"  {float(POSITION.from_counts(position)):.4f} mm"
    print(f"{tdc.clock.now / 1e9:9.6f} s {direction} {message.layout.message}{place}")


def main() -> None:
    """Home, move by 1.5 mm, and ask where the stage is."""
    with virtual.TDC001(stage=stages.Z8) as tdc:
        ask(tdc, m.HwReqInfo())
        ask(tdc, m.MotMoveHome(chan_ident=1))
        ask(tdc, m.MotMoveAbsolute(chan_ident=1, absolute_distance=POSITION.to_counts("1.5")))
        ask(tdc, m.MotReqDcStatusUpdate(chan_ident=1))


if __name__ == "__main__":
    main()
