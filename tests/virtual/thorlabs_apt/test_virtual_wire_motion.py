"""Every motor at the level of bytes: its position every 10 ms, its status, and its completion.

The tests use no generated code. Ids and offsets of fields are those of pages 30 (velocity parameters), 42
(relative moves), 44 (completion), 77 (status of a stepper) and 79 (status of a DC servo).
"""

from __future__ import annotations

import math
import struct
from collections.abc import Iterator

import pytest

import stagewire_virtual as virtual
from issues import OF_ISSUE_3
from stagewire_virtual.instrument import all_units

MOTORS = sorted(
    name
    for name, unit in all_units().items()
    if "MOT_MOVE_HOME" in unit.messages and name in OF_ISSUE_3
)
VELOCITY = 12_345
ACCELERATION = 34_567
COMPLETED = 0x0464
MOVING_FORWARD, MOVING_REVERSE = 0x10, 0x20


class Motor:
    """The host of a new unit whose first channel has the velocity and acceleration above, in counts."""

    def __init__(self, name: str) -> None:
        facts = all_units()[name].facts
        self.address = 0x50 if facts["address"] == "generic_usb" else 0x21
        self.is_dc = facts["status"] == "dc"
        self.controller = getattr(virtual, name)(travel=400_000, position=200_000)
        self.say(0x0413, struct.pack("<Hiii", 1, 0, ACCELERATION, VELOCITY))

    def say(self, ident: int, data: bytes) -> None:
        header = struct.pack("<HHBB", ident, len(data), self.address | 0x80, 0x01)
        self.controller.write(header + data)

    def move(self, distance: int) -> None:
        self.say(0x0448, struct.pack("<Hi", 1, distance))

    def heard(self) -> Iterator[tuple[int, bytes]]:
        """Yield the ids and packets of the received messages."""
        raw = self.controller.read()
        while raw:
            ident, size, dest, source = struct.unpack_from("<HHBB", raw)
            assert (dest, source) == (0x01 | 0x80, self.address)
            yield ident, raw[6 : 6 + size]
            raw = raw[6 + size :]

    def status(self) -> tuple[int, int, int]:
        """Return position, velocity (0 for a stepper) and status bits; fail if anything else arrived."""
        ident = 0x0490 if self.is_dc else 0x0480
        self.controller.write(struct.pack("<HBBBB", ident, 1, 0, self.address, 0x01))
        ((answer, data),) = self.heard()
        assert answer == ident + 1
        if self.is_dc:
            position, velocity, bits = struct.unpack("<2xih2xI", data)
            return position, velocity, bits
        position, bits = struct.unpack("<2xi4xI", data)
        return position, 0, bits


def formula(seconds: float, distance: int) -> float:
    """Return the position of a trapezoid or triangle from rest to rest."""
    peak, ramp, duration = shape(distance)
    time = min(seconds, duration)
    if time < ramp:
        way = ACCELERATION * time**2 / 2
    elif time < duration - ramp:
        way = peak * (time - ramp / 2)
    else:
        way = abs(distance) - ACCELERATION * (duration - time) ** 2 / 2
    return math.copysign(way, distance)


def shape(distance: int) -> tuple[float, float, float]:
    """Return its peak velocity, the duration of the acceleration, and its whole duration."""
    peak = min(VELOCITY, math.sqrt(abs(distance) * ACCELERATION))
    return peak, peak / ACCELERATION, abs(distance) / peak + peak / ACCELERATION


def test_there_are_18_units_with_motors() -> None:
    assert len(MOTORS) == 18


@pytest.mark.parametrize("distance", [15_000, -15_000, 900, -1])
@pytest.mark.parametrize("name", MOTORS)
def test_positions_and_status_during_a_move_follow_the_formula(name: str, distance: int) -> None:
    motor = Motor(name)
    motor.move(distance)
    peak, _, duration = shape(distance)
    moving = MOVING_FORWARD if distance > 0 else MOVING_REVERSE
    fastest = 0
    for step in range(math.ceil(duration * 100)):
        position, velocity, bits = motor.status()
        assert abs(position - formula(step / 100, distance)) <= 1
        assert bits & (MOVING_FORWARD | MOVING_REVERSE) == moving
        fastest = max(fastest, abs(velocity))
        motor.controller.advance(0.01)
    ((ident, data),) = motor.heard()
    assert ident == COMPLETED
    assert struct.unpack_from("<Hi", data) == (1, distance)
    position, _, bits = motor.status()
    assert position == distance
    assert not bits & (MOVING_FORWARD | MOVING_REVERSE)
    if motor.is_dc:
        assert fastest == pytest.approx(peak, abs=ACCELERATION / 100)
        assert fastest <= math.ceil(peak)


@pytest.mark.parametrize("distance", [15_000, -15_000, 900])
@pytest.mark.parametrize("name", MOTORS)
def test_a_completion_is_sent_at_the_exact_instant(name: str, distance: int) -> None:
    motor = Motor(name)
    motor.move(distance)
    _, _, duration = shape(distance)
    motor.controller.advance(duration - 2e-9)
    assert list(motor.heard()) == []
    motor.controller.advance(4e-9)
    assert [ident for ident, _ in motor.heard()] == [COMPLETED]
