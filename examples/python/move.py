"""Home a stage and move it with messages only, over any port that pyserial can open.

    python examples/python/move.py socket://127.0.0.1:4001 1.5

The controller is a TDC001 with a stage of the Z8 series, or a virtual one:
``stagewire virtual TDC001 --stage Z8 --tcp 4001``.
"""

from __future__ import annotations

import sys
import time

import serial

from stagewire import End, Frame, FramedMessage, StagewireError
from stagewire_apt import PROTOCOL, stages
from stagewire_apt import messages as m

HOST, USB = 0x01, 0x50
# Seconds between keep-alive messages; without them a controller on USB falls silent (page 80).
ALIVE_EVERY = 1.0
TIMEOUT = 60.0

POSITION = stages.Z8.scale("position", "TDC001")


class Controller:
    """A TDC001 at the other end of a port."""

    def __init__(self, url: str) -> None:
        self.port = serial.serial_for_url(url, baudrate=115200, timeout=0.1)
        self.framer = PROTOCOL.framer(End.HOST)

    def send(self, message: FramedMessage) -> None:
        """Send a message."""
        self.port.write(message.pack(dest=USB, source=HOST))

    def ask(self, message: FramedMessage, answer: str) -> Frame:
        """Send a message and return the next frame with the answer; ignore all others."""
        self.send(message)
        deadline, alive = time.monotonic() + TIMEOUT, time.monotonic() + ALIVE_EVERY
        while time.monotonic() < deadline:
            if time.monotonic() >= alive:
                self.send(m.MotAckDcStatusUpdate())
                alive += ALIVE_EVERY
            for event in self.framer.feed(self.port.read(self.port.in_waiting or 1)):
                frame = getattr(event, "frame", None)  # garbage has no frame
                if frame is not None and frame.message.layout.message == answer:
                    return frame
        raise SystemExit(f"no {answer} within {TIMEOUT:.0f} s")


def main(url: str, millimetres: str) -> None:
    """Home, move and print the position."""
    controller = Controller(url)
    info = controller.ask(m.HwReqInfo(), "HW_GET_INFO").message
    print(f"{info.model_number} {info.serial_number}")
    controller.ask(m.MotMoveHome(chan_ident=1), "MOT_MOVE_HOMED")
    print("homed")
    counts = POSITION.to_counts(millimetres)
    controller.ask(m.MotMoveAbsolute(chan_ident=1, absolute_distance=counts), "MOT_MOVE_COMPLETED")
    status = controller.ask(m.MotReqDcStatusUpdate(chan_ident=1), "MOT_GET_DCSTATUSUPDATE").message
    print(f"at {float(POSITION.from_counts(status.position)):.4f} mm")
    controller.port.close()


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit("usage: python move.py URL MILLIMETRES, such as socket://127.0.0.1:4001 1.5")
    try:
        main(*sys.argv[1:3])
    except (serial.SerialException, StagewireError) as error:
        sys.exit(f"{sys.argv[1]}: {error}")
