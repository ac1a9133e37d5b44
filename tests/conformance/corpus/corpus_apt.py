"""The line of an APT unit: messages of a header and a packet, and the count of status messages.

Written from Issue 3 of the APT document alone. It imports nothing of Stagewire: bytes arrive and leave, and
time comes from a clock.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping

HOST, UNIT = 0x01, 0x50
GAP = 0.1
"""Seconds without a byte after which the controller drops an incomplete message."""

Command = Callable[[bytes], None]


class AptUnit:
    """A unit with an address of its own.

    :param clock: returns the time in seconds.
    """

    KEEP_ALIVE = False
    address = UNIT
    commands: Mapping[tuple[int, int], Command]
    """The commands by id and size of the data packet."""

    def __init__(self, clock: Callable[[], float]) -> None:
        self.clock = clock
        self.now = clock()
        self.arriving = bytearray()
        self.leaving = bytearray()
        self.arrived_at = self.now
        self.since_alive = 0

    def catch_up(self) -> None:
        """Do everything that is due, each at its own time."""
        raise NotImplementedError

    def write(self, data: bytes) -> None:
        """Receive bytes now."""
        self.catch_up()
        if self.arriving and self.now - self.arrived_at > GAP:
            self.arriving.clear()
        self.arrived_at = self.now
        self.arriving += data
        while len(self.arriving) >= (size := self.frame_size(self.arriving)):
            frame = bytes(self.arriving[:size])
            del self.arriving[:size]
            self.receive(frame)

    def read(self) -> bytes:
        """Return the bytes that were sent until now."""
        self.catch_up()
        data = bytes(self.leaving)
        self.leaving.clear()
        return data

    def frame_size(self, data: bytearray) -> int:
        """Return the size of the first message, as far as it is known."""
        if len(data) < 6 or not data[4] & 0x80:
            return 6
        return 6 + int.from_bytes(data[2:4], "little")

    def receive(self, frame: bytes) -> None:
        """Carry out a message for this unit; ignore any other."""
        if frame[4] & 0x7F != self.address:
            return
        id = int.from_bytes(frame[:2], "little")
        command = self.commands.get((id, len(frame) - 6))
        has_data = bool(frame[4] & 0x80)
        if command is None or has_data != (len(frame) > 6):
            return
        if self.names_channel(id) and self.channel_of(frame) != 1:
            return
        command(frame)

    def names_channel(self, id: int) -> bool:
        """Return whether a message names a channel: all motor messages but three, and the enable state."""
        return id in (0x0210, 0x0211) or (id >= 0x0400 and id not in (0x046B, 0x046C, 0x0492))

    def channel_of(self, frame: bytes) -> int:
        return frame[2] if len(frame) == 6 else int.from_bytes(frame[6:8], "little")

    def send_header(self, id: int, param1: int = 0, param2: int = 0, dest: int = HOST) -> None:
        self.leaving += struct.pack("<HBBBB", id, param1, param2, dest, self.address)

    def send_packet(self, id: int, packet: bytes, dest: int = HOST) -> None:
        self.leaving += struct.pack("<HHBB", id, len(packet), dest | 0x80, self.address) + packet

    def send_status(self, id: int, packet: bytes, dest: int = HOST) -> None:
        """Send a message of the status update kind, unless the host seems to be gone."""
        if self.KEEP_ALIVE:
            if self.since_alive >= 50:
                return
            self.since_alive += 1
        self.send_packet(id, packet, dest)
