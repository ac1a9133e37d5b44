"""Firmware of a BSC101, a benchtop stepper controller, written from Issue 3 of the APT document alone.

It drives a stage with 25,600 microsteps per mm (page 77) over RS-232, so that it needs no keep-alive. The
stage has no encoder. The backlash distance is not zero: a move in reverse goes further and comes back.
"""

from __future__ import annotations

import struct
from typing import ClassVar

from corpus_motor import HOME, JOG, MotorController, settings_of_motor

COUNTS_PER_MM = 25600


class Stepper(MotorController):
    """The controller and its stage.

    :param clock: returns the time in seconds.
    """

    SETTINGS: ClassVar = settings_of_motor(
        velocity=(0, 204800, 102400),
        jog=(2, 2560, 0, 102400, 51200, 2),
        general=(1280,),
        relative=(5120,),
        absolute=(12800,),
        home=(2, 1, 51200, 7680),
        limits=(3, 3, 307200, 0, 1),
    )
    STATUS_REQUEST, STATUS = 0x0480, 0x0481
    SERIAL, MODEL, HARDWARE, VERSION = 40801234, b"BSC101", 30, bytes((1, 0, 4, 0))
    NOTES = b"Stepper drive, one channel"
    SPAN = 7680 + 12.5 * COUNTS_PER_MM
    START = 5.0 * COUNTS_PER_MM

    encoder_count = 0

    def encoder(self) -> int:
        """Return the last encoder count that was set: nothing counts without an encoder."""
        return self.encoder_count

    def set_encoder(self, frame: bytes) -> None:
        self.encoder_count = self.number(frame)

    def status_packet(self) -> bytes:
        """Return the packet of a status update."""
        return struct.pack("<HiiI", 1, self.position(), self.encoder(), self.status_bits())

    def status_bits(self) -> int:
        """Return the status bits. Jogging and homing are reported together with the direction."""
        motion = self.axis.motion
        bits = 0x100 | self.limit_bits() | self.soft_limit_bits()
        if motion:
            bits |= self.motion_bits((0x10, 0x20))
            bits |= self.motion_bits((0x40, 0x80)) if motion == JOG else 0
            bits |= 0x200 if motion == HOME else 0
        return bits | (0x400 if self.axis.homed else 0)

    def soft_limit_bits(self) -> int:
        """Return the bits of the software limits, if they are used."""
        cw, ccw, mode = self.kept("limits")[2:]
        if mode & 0x7F == 1:
            return 0
        return 0x04 * (self.position() >= cw) | 0x08 * (self.position() <= ccw)
