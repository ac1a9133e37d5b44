"""Firmware of an MS-2000 with the axes X and Y, written from the document of its low-level commands alone.

It imports nothing of Stagewire. Its methods are small, so that a fault is a
subclass that replaces one of them (``corpus_faults_ms2000*.py``).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import ClassVar

from corpus_motion import Path, at_speed, resting, to_target

SETUP, COLON = 255, 58
HALF_TRAVEL = 200_000  # tenths of a micron; a limit switch at either end
UNITS_PER_UM = 10

SIZES = {
    "a": (3,), "d": (3,), "i": (None, 6), "l": (3, 4), "o": (2,), "q": (1,), "r": (2,), "s": (2,),
    "t": (3,), "~": (None, 1), "?": (None,), "G": (None,), "B": (None,), "A": (3,), "T": (3,),
    "+": (0,), "-": (0,), "D": (3,), "Q": (1,), "R": (2,), "S": (2,), "^": (2,), "J": (None, 0),
    "K": (None, 0),
}  # fmt: skip
"""The sizes that each command may have; None if the size may be left out."""
WRITES = "ATDQRS^"
"""The commands with data."""


def signed(data: bytes) -> int:
    return int.from_bytes(data, "little", signed=True)


@dataclass
class Axis:
    """An axis: a stage, its motor, and its settings. Positions are in tenths of a micron.

    :param shift: the difference between the position that the host sees and the place of the stage.
    :param runs: the vector speed in tenths of a micron per second, while a vector move is under way.
    """

    name: str
    path: Path = field(default_factory=lambda: resting(0.0))
    shift: float = 0.0
    target: int = 0
    increment: int = 1000
    ramp_ms: int = 100
    top_um_s: int = 6000
    runs: float | None = None
    enabled: bool = True
    joystick: bool = True


class Ms2000:
    """The controller.

    :param clock: returns the time in seconds.
    """

    AXES: ClassVar = {24: "X", 25: "Y"}

    def __init__(self, clock: Callable[[], float]) -> None:
        self.clock = clock
        self.now = clock()
        self.leaving = bytearray()
        self.buffer = bytearray()
        self.reset()

    def reset(self) -> None:
        """Set everything as after power-up: high-level format, axes at rest."""
        self.low_level = False
        self.axes = {id: self.new_axis(name) for id, name in self.AXES.items()}

    def new_axis(self, name: str) -> Axis:
        return Axis(name)

    # Bytes and time

    def write(self, data: bytes) -> None:
        """Receive bytes now."""
        self.now = self.clock()
        for value in data:
            self.receive(value)

    def read(self) -> bytes:
        """Return the bytes that were sent until now."""
        self.now = self.clock()
        data = bytes(self.leaving)
        self.leaving.clear()
        return data

    def due(self) -> float:
        """Return when something happens without a command: never."""
        return math.inf

    def receive(self, value: int) -> None:
        """Store a byte; carry out a setup command, or a command that its colon completes."""
        self.buffer.append(value)
        if self.buffer[0] == SETUP:
            if len(self.buffer) == 2:
                self.setup(self.buffer[1])
                self.buffer.clear()
        elif not self.low_level:
            self.buffer.clear()
        elif value == COLON and self.is_end():
            command = bytes(self.buffer)
            self.buffer.clear()
            self.dispatch(command)

    def setup(self, value: int) -> None:
        """Carry out a setup command. The precisions concern the high-level format only."""
        if value == ord("A"):
            self.low_level = False
        elif value == ord("B"):
            self.low_level = True
        elif value == ord("R"):
            self.reset()

    def is_end(self) -> bool:
        """Return whether the last byte, a colon, ends the command: it is not part of the data."""
        if len(self.buffer) < 3:
            return True
        name, size = chr(self.buffer[1]), self.buffer[2]
        if size == COLON and len(self.buffer) == 3:
            return True
        sized = name in WRITES and size <= 6
        return not sized or len(self.buffer) > 3 + size

    def dispatch(self, command: bytes) -> None:
        """Carry out a command, or ignore it if it has an error."""
        axis = self.axes.get(command[0])
        name = chr(command[1]) if len(command) > 2 else ""
        if axis is None or name not in SIZES:
            return
        size = command[2] if len(command) > 3 else None
        if None in SIZES[name] and size not in SIZES[name]:
            size = None if SIZES[name] == (None,) else size
        if not self.fits(name, size):
            return
        data = command[3 : 3 + (size or 0)] if name in WRITES else b""
        self.leaving += self.carry_out(axis, name, data)

    def fits(self, name: str, size: int | None) -> bool:
        return size in SIZES[name]

    # Commands

    def carry_out(self, axis: Axis, name: str, data: bytes) -> bytes:
        """Carry out a command and return its reply."""
        if name in "adlioqrst~?":
            return self.answer(axis, name)
        if name in WRITES:
            self.store(axis, name, data)
        elif name in "+-":
            self.increment_move(axis, 1 if name == "+" else -1)
        elif name == "G":
            self.start(axis)
        elif name == "B":
            self.stop(axis)
        else:
            self.set_joystick(axis, name == "J")
        return b""

    def answer(self, axis: Axis, name: str) -> bytes:
        """Return the reply to a command that reads."""
        if name == "a":
            return self.three(self.position(axis))
        if name == "l":
            return self.three(self.position(axis)) + bytes((self.status_byte(axis),))
        if name == "d":
            return self.three(axis.increment)
        if name == "t":
            return self.three(self.target(axis))
        if name == "o":
            return self.current_speed(axis).to_bytes(2, "little", signed=True)
        if name == "q":
            return bytes((axis.ramp_ms,))
        if name == "s":
            return axis.top_um_s.to_bytes(2, "little")
        if name == "r":
            return bytes(2)
        if name == "i":
            return b"EMOT :"
        if name == "~":
            return bytes((self.status_byte(axis),))
        return b"B" if self.busy(axis) else b"b"

    def three(self, value: int) -> bytes:
        return value.to_bytes(3, "little", signed=True)

    def store(self, axis: Axis, name: str, data: bytes) -> None:
        """Carry out a command that writes."""
        if name == "A":
            self.set_position(axis, signed(data))
        elif name == "T":
            self.set_target(axis, signed(data))
        elif name == "D":
            axis.increment = signed(data)
        elif name == "Q":
            axis.ramp_ms = max(1, data[0])
        elif name == "S":
            axis.top_um_s = int.from_bytes(data, "little")
        elif name == "^":
            self.set_vector(axis, signed(data))

    def set_joystick(self, axis: Axis, on: bool) -> None:
        axis.joystick = on

    # Motion

    def place(self, axis: Axis) -> float:
        return axis.path.position(self.now)

    def position(self, axis: Axis) -> int:
        return round(self.place(axis) + axis.shift)

    def target(self, axis: Axis) -> int:
        """Return the target; during and after a vector move, it follows the stage."""
        return axis.target if axis.runs is None else self.position(axis)

    def current_speed(self, axis: Axis) -> int:
        return round(axis.path.speed(self.now) / UNITS_PER_UM)

    def top_speed(self, axis: Axis) -> float:
        return max(1, axis.top_um_s) * UNITS_PER_UM

    def acceleration(self, axis: Axis) -> float:
        """Return the acceleration: top speed divided by ramp time."""
        return self.top_speed(axis) / (axis.ramp_ms / 1000)

    def follow(self, axis: Axis, path: Path) -> None:
        axis.path = path.within(-HALF_TRAVEL, HALF_TRAVEL)

    def approach(self, axis: Axis) -> None:
        """Move to the target, if the motor is enabled."""
        if not axis.enabled:
            return
        self.follow(axis, self.path_to(axis, axis.target - axis.shift))

    def path_to(self, axis: Axis, place: float) -> Path:
        x, v = self.place(axis), axis.path.speed(self.now)
        return to_target(self.now, x, v, place, self.top_speed(axis), self.acceleration(axis))

    def set_target(self, axis: Axis, target: int) -> None:
        axis.target, axis.runs = target, None
        self.approach(axis)

    def increment_move(self, axis: Axis, side: int) -> None:
        self.set_target(axis, self.position(axis) + side * axis.increment)

    def set_vector(self, axis: Axis, um_s: int) -> None:
        """Ramp to a speed and keep it. The largest speed is the top speed."""
        if not axis.enabled:
            return
        top = self.top_speed(axis)
        speed = max(-top, min(top, um_s * UNITS_PER_UM))
        axis.runs = speed
        x, v = self.place(axis), axis.path.speed(self.now)
        path = at_speed(self.now, x, v, speed, self.acceleration(axis))
        if speed == 0:
            ramps = tuple(piece for piece in path.pieces if math.isfinite(piece.lasts))
            path = Path(ramps, ramps[-1].position(ramps[-1].end) if ramps else x)
        self.follow(axis, path)

    def set_position(self, axis: Axis, position: int) -> None:
        """Count from another origin. The stage does not move, and neither does its target."""
        before = self.position(axis)
        axis.shift = position - self.place(axis)
        axis.target += position - before

    def start(self, axis: Axis) -> None:
        """Enable the motor, which then moves to its target."""
        if not axis.enabled:
            axis.enabled = True
            self.approach(axis)

    def stop(self, axis: Axis) -> None:
        """Disable the motor. The target stays."""
        if axis.runs is not None:
            axis.target, axis.runs = self.position(axis), None
        axis.path = resting(self.place(axis))
        axis.enabled = False

    # Status

    def moving(self, axis: Axis) -> bool:
        return axis.path.piece(self.now) is not None

    def busy(self, axis: Axis) -> bool:
        return self.moving(axis)

    def ramping(self, axis: Axis) -> int:
        """Return 1 while the motor ramps up, -1 while it ramps down, and 0 otherwise."""
        piece = axis.path.piece(self.now)
        if piece is None or piece.a == 0:
            return 0
        return 1 if axis.path.speed(self.now) * piece.a >= 0 else -1

    def limits(self, axis: Axis) -> tuple[bool, bool]:
        """Return whether the upper and the lower limit switch are closed."""
        place = self.place(axis)
        return place >= HALF_TRAVEL, place <= -HALF_TRAVEL

    def status_byte(self, axis: Axis) -> int:
        ramping = self.ramping(axis)
        upper, lower = self.limits(axis)
        return (
            self.moving(axis) | 0x02 | axis.joystick << 3 | bool(ramping) << 4 | (ramping < 0) << 5
            | upper << 6 | lower << 7
        )  # fmt: skip
