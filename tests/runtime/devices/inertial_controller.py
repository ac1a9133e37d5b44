"""A controller that names its channels by bits, for tests: it answers everything, and records what moves.

It reads bytes only, so that it does not share the registry's view of where a message names its channel.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from stagewire_virtual.clock import Clock
from stagewire_virtual.controller import VirtualController
from stagewire_virtual.instrument import Instrument, Row, find_unit

HEADER: Final = 6
PARAMETERS: Final = {
    0x03: 8, 0x05: 12, 0x07: 14, 0x09: 18, 0x0B: 10, 0x0F: 16, 0x11: 8, 0x13: 18, 0x15: 30, 0x17: 26,
    0x19: 48, 0x2B: 4, 0x2D: 22, 0x30: 18, 0x32: 8, 0x34: 8
}  # fmt: skip
"""Sub-message -> length of its parameters."""
SERIAL_NUMBERS: Final = {
    "KIM101": 97_000001,
    "TIM101": 65_000001,
    "MPC220": 38_000001,
    "MPC320": 38_000002,
}
"""Unit -> its serial number."""
OF_ALL_CHANNELS: Final = (0x17, 0x2B)
"""Sub-messages that name no channel: trigger ports, and enabled channels."""
INERTIAL_MOVES: Final = (0x08D3, 0x08D4, 0x08D5, 0x08D9)
MOTOR_MOVES: Final = (0x0453, 0x046A)
HOME: Final = 0x0443
STOPS: Final = {0x08D7: 0x08D8, 0x0465: 0x0466}


def channel_of(frame: bytes) -> int | None:
    """Return the channel in the bytes of a frame from the host; None if it concerns no single channel."""
    id = int.from_bytes(frame[:2], "little")
    if id == 0x08C0:
        return None if frame[6] in OF_ALL_CHANNELS else int.from_bytes(frame[8:10], "little")
    if id == 0x08C1:
        return None if frame[2] in OF_ALL_CHANNELS else frame[3]
    if id < 0x0100 or id in (0x0250, 0x08E0, 0x08E2, 0x0492, 0x0530, 0x0531):
        return None
    return int.from_bytes(frame[6:8], "little") if frame[4] & 0x80 else frame[2]


def moves(frame: bytes) -> bool:
    """Return whether a frame from the host starts a motion."""
    return int.from_bytes(frame[:2], "little") in (*INERTIAL_MOVES, *MOTOR_MOVES, HOME)


class InertialController(Instrument):
    """The controller; `frames` are those of the host, and `moved` the channels that moved, as sent."""

    def __init__(self, name: str, clock: Clock) -> None:
        super().__init__(find_unit(name), clock)
        self.frames: list[bytes] = []
        self.moved: list[int] = []
        self.ends = True
        self.enabled = 0x0F
        """Bits of the enabled channels of a TIM101 or an MPC; enabling one disables the others."""
        self._bytes = b""
        self._stored: dict[tuple[int, int], bytes] = {}

    def receive(self, data: bytes) -> None:
        self._bytes += data
        while len(self._bytes) >= HEADER:
            length = int.from_bytes(self._bytes[2:4], "little") if self._bytes[4] & 0x80 else 0
            frame, self._bytes = self._bytes[: HEADER + length], self._bytes[HEADER + length :]
            self.frames.append(frame)
            self._answer(frame)

    def _answer(self, frame: bytes) -> None:
        id, channel = int.from_bytes(frame[:2], "little"), channel_of(frame) or 0
        if id == 0x0005:
            information = bytearray(84)
            information[:4] = SERIAL_NUMBERS[self.unit.name].to_bytes(4, "little")
            information[4:12] = self.unit.name.encode().ljust(8, b"\0")
            self._send(0x0006, bytes(information))
        elif id == 0x08C0:
            self._stored[frame[6], channel] = frame[HEADER:]
        elif id == 0x08C1:
            self._send(
                0x08C2, self._stored.get((frame[2], channel), _parameters(frame[2], channel))
            )
        elif id == 0x0210:
            self.enabled = channel if frame[3] == 1 else self.enabled & ~channel
        elif id == 0x0211:
            self._send_header(0x0212, channel, 1 if self.enabled & channel else 2)
        elif id == 0x0411:
            self._send(0x0412, _word(channel) + bytes(4))
        elif id == 0x0490:
            self._send(0x0491, _word(channel) + bytes(12))
        elif id == 0x0531:
            self._send(0x0532, bytes(12))
        elif id == 0x08E0:
            self._send(0x08E1, b"".join(_word(1 << n) + bytes(12) for n in range(4)))
        elif moves(frame):
            self.moved.append(channel)
            if self.ends:
                self._end(id, channel, frame[8:12] if frame[4] & 0x80 else bytes(4))
        elif id in STOPS:
            self._send(STOPS[id], _word(channel) + bytes(12))

    def _end(self, id: int, channel: int, position: bytes) -> None:
        if id in INERTIAL_MOVES:
            self._send(0x08D6, _word(channel) + position + bytes(8))
        elif id == HOME:
            self._send_header(0x0444, channel, 0)
        else:
            self._send(0x0464, _word(channel) + position + bytes(8))

    def _send(self, id: int, packet: bytes) -> None:
        self.on_send(_word(id) + _word(len(packet)) + b"\x81\x50" + packet)

    def _send_header(self, id: int, first: int, second: int) -> None:
        self.on_send(_word(id) + bytes((first, second)) + b"\x01\x50")

    def power_cycle(self) -> None:
        self._stored.clear()

    def rows(self) -> Sequence[Row]:
        return []

    def stick(self, part: str, stuck: bool) -> None:
        raise NotImplementedError


def controller(name: str) -> tuple[VirtualController, InertialController]:
    """Return a controller in memory, and its instrument."""
    line = VirtualController(lambda clock: InertialController(name, clock), label=name)
    instrument = line.instrument
    assert isinstance(instrument, InertialController)
    return line, instrument


def _word(value: int) -> bytes:
    return value.to_bytes(2, "little")


def _parameters(sub_message: int, channel: int) -> bytes:
    start = _word(sub_message) + (b"" if sub_message in OF_ALL_CHANNELS else _word(channel))
    return start.ljust(PARAMETERS[sub_message], b"\0")
