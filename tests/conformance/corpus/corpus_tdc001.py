"""Firmware of a TDC001, a T-Cube for a DC servo motor, written from Issue 3 of the APT document alone.

It drives an actuator of the Z8 series (34,304 counts per mm, page 56) over USB.
"""

from __future__ import annotations

import struct
from itertools import pairwise
from typing import ClassVar

from corpus_motor import HOME, JOG, MotorController, Setting, settings_of_motor

COUNTS_PER_MM = 34304
REPORTED_PER_MM_S = 204.8  # page 79


class Tdc001(MotorController):
    """The controller and its actuator.

    :param clock: returns the time in seconds.
    """

    SETTINGS: ClassVar = {
        **settings_of_motor(
            velocity=(0, 137216, 68608),
            jog=(2, 3430, 0, 68608, 34304, 2),
            general=(0,),
            relative=(6860,),
            absolute=(17152,),
            home=(2, 1, 51456, 10291),
            limits=(2, 2, 411648, 0, 1),
        ),
        "pid": Setting(0x04A0, "IIIIH", (435, 195, 993, 195, 0x0F)),
        "led": Setting(0x04B3, "H", (11,)),
        "pot": Setting(0x04B0, "HiHiHiHi", (20, 3430, 50, 6860, 80, 10290, 100, 17152)),
        "buttons": Setting(0x04B6, "HiiHH", (1, 17152, 41165, 2000, 0)),
    }
    STATUS_REQUEST, STATUS = 0x0490, 0x0491
    SERIAL, MODEL, HARDWARE, VERSION = 83812345, b"TDC001", 16, bytes((3, 1, 2, 0))
    NOTES = b"DC servo drive T-Cube"
    SPAN = 10291 + 12.5 * COUNTS_PER_MM
    START = 3.0 * COUNTS_PER_MM
    KEEP_ALIVE = True

    def start_updates(self, frame: bytes) -> None:
        """Start updates; a rate of 0 means the usual ten per second."""
        self.updates_every = 1 / min(frame[2] or 10, 50)
        super().start_updates(frame)

    def accepted(self, name: str, values: tuple[int, ...]) -> tuple[int, ...] | None:
        """Return the values to keep; None if one of them is not allowed."""
        if name == "pid" and not all(value <= 32767 for value in values[:4]):
            return None
        if name == "led" and values[0] & ~11:
            return None
        if name == "pot":
            deflections = values[0::2]
            rising = all(low <= high for low, high in pairwise(deflections))
            return values if rising and deflections[-1] <= 127 else None
        if name == "buttons":
            return (*values[:4], 0) if values[0] in (1, 2) else None
        return super().accepted(name, values)

    def reported_velocity(self) -> int:
        return round(self.speed() / COUNTS_PER_MM * REPORTED_PER_MM_S)

    def position_in_status(self) -> int:
        return self.position()

    def status_packet(self) -> bytes:
        """Return the packet of a DC status update."""
        velocity = max(-32768, min(32767, self.reported_velocity()))
        position = self.position_in_status()
        return struct.pack("<HihHI", 1, position, velocity, 0, self.status_bits())

    def status_bits(self) -> int:
        """Return the status bits. Jogging and homing have bits of their own."""
        motion = self.axis.motion
        bits = self.limit_bits()
        if motion == HOME:
            bits |= 0x200
        elif motion:
            bits |= self.motion_bits((0x40, 0x80) if motion == JOG else (0x10, 0x20))
        bits |= 0x400 if self.axis.homed else 0
        if self.axis.enabled:
            bits |= 0x80001000 | (0 if motion else 0x2000)
        return bits


class ShortTdc001(Tdc001):
    """The controller with an actuator so short that both of its ends are within the allowed range."""

    SPAN = 10291 + 5.0 * COUNTS_PER_MM
