"""A controller with an output that is on, for tests: it records whether the output is on, and every frame.

It reads bytes only, so that it does not share the registry's view of what switches an output off.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Final

from proof_line import FarEnd

from stagewire_apt.devices.facts import UNITS

HEADER: Final = 6
LASERS: Final = ("KLD101", "TLD001", "KLS101", "KLS635", "KLS1550", "TLS001")
UNITS_THAT_HEAT: Final = (*LASERS, "TTC001")
"""Units whose outputs can burn or heat; a test compares them with the registry."""
KEY, INTERLOCK = 0x02, 0x08
"""Bits of the status of a laser: the key switch is on, and the interlock is closed."""


def id_of(frame: bytes) -> int:
    return int.from_bytes(frame[:2], "little")


KEEP_ALIVES = (0x0822, 0x0827, 0x0862)


class OutputController(FarEnd):
    """The controller of a unit; `limit` is the current limit of a heater in mA.

    :param on: whether a program or the panel has left the output on.
    """

    def __init__(self, unit: str, *, on: bool = True) -> None:
        self.unit = UNITS[unit]
        self.lit = on
        self.limit = 1500 if on else 0
        self.sensor = 1
        self.interlock = KEY | INTERLOCK
        self.silent: tuple[int, ...] = ()
        """Ids of requests that it does not answer."""
        self.frames: list[bytes] = []
        self._bytes = b""

    @property
    def on(self) -> bool:
        """Whether the output is on."""
        return self.limit > 0 if self.unit.name == "TTC001" else self.lit

    def switch_on(self) -> None:
        """Switch the output on, as another program or the panel does."""
        self.lit, self.limit = True, 900

    @property
    def ids(self) -> list[int]:
        """The ids of the frames from the host, without keep-alive messages."""
        ids = [id_of(frame) for frame in self.frames]
        return [id for id in ids if id not in KEEP_ALIVES]

    def plug_in(self) -> None:
        self._bytes = b""

    def take(self, data: bytes) -> Iterable[tuple[float, bytes | None]]:
        self._bytes += data
        answers: list[tuple[float, bytes | None]] = []
        while len(self._bytes) >= HEADER:
            length = int.from_bytes(self._bytes[2:4], "little") if self._bytes[4] & 0x80 else 0
            frame, self._bytes = self._bytes[: HEADER + length], self._bytes[HEADER + length :]
            self.frames.append(frame)
            answers += [(0.001, answer) for answer in self._answers(frame)]
        return answers

    def _answers(self, frame: bytes) -> Iterable[bytes]:
        id = id_of(frame)
        if id in self.silent:
            return
        if id == 0x0005:
            information = bytearray(84)
            information[:4] = (max((*self.unit.prefixes, 1)) * 1_000_000 + 1).to_bytes(4, "little")
            information[4:12] = self.unit.name.encode().ljust(8, b"\0")
            yield _packet(0x0006, bytes(information))
        elif id in (0x0811, 0x0812):
            self.lit = id == 0x0811
        elif id == 0x0801 and frame[2] == 7:
            yield _packet(0x0802, _word(7) + (self.interlock | self.lit).to_bytes(4, "little"))
        elif id == 0x0840 and frame[HEADER] == 5:
            self.sensor, self.limit = _words(frame[HEADER + 2 :])
        elif id == 0x0841 and frame[2] == 5:
            yield _packet(0x0842, _word(5) + _word(self.sensor) + _word(self.limit))


def _word(value: int) -> bytes:
    return value.to_bytes(2, "little")


def _words(data: bytes) -> Any:
    return (int.from_bytes(data[i : i + 2], "little") for i in range(0, len(data), 2))


def _packet(id: int, packet: bytes) -> bytes:
    return _word(id) + _word(len(packet)) + b"\x81\x50" + packet
