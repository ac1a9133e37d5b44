"""Firmware of a motor controller with one channel, written from Issue 3 of the APT document alone.

It behaves like an ordinary motor controller in every respect that the document leaves open. Its methods
are small, so that a fault is a subclass that replaces one of them (``corpus_faults_*.py``).
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

from corpus_apt import AptUnit, Command
from corpus_motion import Path, at_speed, resting, then, to_rest, to_target

MOVE, JOG, RUN, HOME = "move", "jog", "run", "home"


@dataclass(frozen=True)
class Setting:
    """Parameters with a SET, a REQ (the next id) and a GET (the id after that).

    :param layout: the fields after the channel, for ``struct``.
    :param values: the values after power-up.
    """

    id: int
    layout: str
    values: tuple[int, ...]

    def with_values(self, *values: int) -> Setting:
        """Return the setting with other values after power-up."""
        return replace(self, values=values)


_OF_EVERY_MOTOR: Mapping[str, tuple[int, str]] = {
    "velocity": (0x0413, "iII"),
    "jog": (0x0416, "HiiiiH"),
    "general": (0x043A, "i"),
    "relative": (0x0445, "i"),
    "absolute": (0x0450, "i"),
    "home": (0x0440, "HHIi"),
    "limits": (0x0423, "HHIIH"),
}
"""The ids and layouts of the settings that every motor controller has."""


def settings_of_motor(**values: tuple[int, ...]) -> dict[str, Setting]:
    """Return the settings that every motor controller has, with their values after power-up."""
    return {name: Setting(*_OF_EVERY_MOTOR[name], values[name]) for name in _OF_EVERY_MOTOR}


@dataclass
class Axis:
    """The drive and the stage. Positions are in counts from the reverse limit switch.

    :param zero: where the position counter is 0.
    :param encoder_zero: where the encoder counter is 0.
    """

    path: Path
    zero: float
    encoder_zero: float
    homed: bool = False
    enabled: bool = True
    motion: str = ""
    stopping: bool = False
    kept: dict[str, tuple[int, ...]] = field(default_factory=dict)


class MotorController(AptUnit):
    """The common part of a DC servo cube and a stepper controller.

    :param clock: returns the time in seconds.
    """

    SETTINGS: Mapping[str, Setting] = {}
    STATUS_REQUEST, STATUS = 0, 0
    SERIAL, MODEL, NOTES, HARDWARE, VERSION = 0, b"", b"", 0, bytes(4)
    SPAN = 0.0  # counts between the two limit switches
    START = 0.0  # where the stage is at power-up

    def __init__(self, clock: Callable[[], float]) -> None:
        super().__init__(clock)
        self.axis = Axis(resting(self.START), self.START, self.START)
        self.axis.kept = {name: each.values for name, each in self.SETTINGS.items()}
        self.next_update = math.inf
        self.updates_every = 0.1
        self.suspended = False
        self.commands = self.command_table()

    # Time

    def due(self) -> float:
        """Return when something happens next; infinite if nothing does."""
        return min(self.next_update, self.axis.path.end if self.axis.motion else math.inf)

    def catch_up(self) -> None:
        """Do everything that is due, each at its own time."""
        until = self.clock()
        while (at := self.due()) <= until:
            self.now = max(at, self.now)
            if self.axis.motion and self.axis.path.end <= self.now:
                self.arrive()
            if self.next_update <= self.now:
                self.next_update += self.updates_every
                self.send_update()
        self.now = max(until, self.now)

    # Commands

    def command_table(self) -> dict[tuple[int, int], Command]:
        """Return the commands by id and size of the data packet."""
        table: dict[tuple[int, int], Command] = {
            (0x0223, 0): self.identify,
            (0x0005, 0): self.request_info,
            (0x0210, 0): self.set_enable_state,
            (0x0211, 0): self.request_enable_state,
            (0x0011, 0): self.start_updates,
            (0x0012, 0): self.stop_updates,
            (0x0492, 0): self.server_alive,
            (0x046B, 0): lambda frame: self.suspend(True),
            (0x046C, 0): lambda frame: self.suspend(False),
            (self.STATUS_REQUEST, 0): self.request_status,
            (0x0429, 0): self.request_status_bits,
            (0x0410, 6): self.set_position,
            (0x0411, 0): self.request_position,
            (0x0409, 6): self.set_encoder,
            (0x040A, 0): self.request_encoder,
            (0x0443, 0): self.move_home,
            (0x0448, 0): lambda frame: self.move_relative(self.stored_distance()),
            (0x0448, 6): lambda frame: self.move_relative(self.number(frame)),
            (0x0453, 0): lambda frame: self.move_absolute(self.stored_position()),
            (0x0453, 6): lambda frame: self.move_absolute(self.number(frame)),
            (0x046A, 0): lambda frame: self.move_jog(frame[3]),
            (0x0457, 0): lambda frame: self.move_velocity(frame[3]),
            (0x0465, 0): lambda frame: self.move_stop(frame[3]),
        }
        for name, setting in self.SETTINGS.items():
            size = struct.calcsize("<H" + setting.layout)
            table[setting.id, size] = lambda frame, name=name: self.set(name, frame)
            table[setting.id + 1, 0] = lambda frame, name=name: self.request(name, frame)
        return table

    def number(self, frame: bytes) -> int:
        """Return the long after the channel."""
        return int.from_bytes(frame[8:12], "little", signed=True)

    def identify(self, frame: bytes) -> None:
        """Flash the LED on the front panel."""

    def info_packet(self) -> bytes:
        return struct.pack(
            "<I8sH4s64sH", self.SERIAL, self.MODEL, self.HARDWARE, self.VERSION, self.NOTES, 1
        )  # fmt: skip

    def request_info(self, frame: bytes) -> None:
        packet = self.info_packet()
        self.send_packet(0x0006, packet.ljust(84, b"\0"), frame[5])

    def set_enable_state(self, frame: bytes) -> None:
        if frame[3] not in (1, 2):
            return
        self.axis.enabled = frame[3] == 1
        if not self.axis.enabled:
            self.halt()

    def request_enable_state(self, frame: bytes) -> None:
        self.send_header(0x0212, 1, 1 if self.axis.enabled else 2, frame[5])

    def start_updates(self, frame: bytes) -> None:
        self.next_update = self.now + self.updates_every

    def stop_updates(self, frame: bytes) -> None:
        self.next_update = math.inf

    def send_update(self) -> None:
        self.send_status(self.STATUS, self.status_packet())

    def server_alive(self, frame: bytes) -> None:
        self.since_alive = 0

    def suspend(self, on: bool) -> None:
        self.suspended = on

    def request_status(self, frame: bytes) -> None:
        self.send_status(self.STATUS, self.status_packet(), frame[5])

    def request_status_bits(self, frame: bytes) -> None:
        self.send_packet(0x042A, struct.pack("<HI", 1, self.status_bits()), frame[5])

    # Settings and counters

    def kept(self, name: str) -> tuple[int, ...]:
        return self.axis.kept[name]

    def set(self, name: str, frame: bytes) -> None:
        values = struct.unpack("<H" + self.SETTINGS[name].layout, frame[6:])[1:]
        if (accepted := self.accepted(name, values)) is not None:
            self.axis.kept[name] = accepted

    def accepted(self, name: str, values: tuple[int, ...]) -> tuple[int, ...] | None:
        """Return the values to keep; None if one of them is not allowed."""
        if name == "velocity":
            return (0, *values[1:]) if values[1] and values[2] else None
        if name == "jog":
            mode, step, _, acceleration, speed, stop = values
            fits = {mode, stop} <= {1, 2} and acceleration > 0 and speed > 0
            return (mode, step, 0, acceleration, speed, stop) if fits else None
        if name == "limits":
            fits = all(value & 0x7F in range(1, 7) for value in values[:2])
            return values if fits and values[4] & 0x7F in (1, 2, 3) else None
        if name == "home" and not values[2]:
            return None
        return values

    def setting_packet(self, name: str) -> bytes:
        return struct.pack("<H" + self.SETTINGS[name].layout, 1, *self.kept(name))

    def request(self, name: str, frame: bytes) -> None:
        self.send_packet(self.SETTINGS[name].id + 2, self.setting_packet(name), frame[5])

    def place(self) -> float:
        """Return where the stage is, from its reverse limit switch."""
        return self.axis.path.position(self.now)

    def position(self) -> int:
        return round(self.place() - self.axis.zero)

    def speed(self) -> float:
        return self.axis.path.speed(self.now)

    def encoder(self) -> int:
        return round(self.place() - self.axis.encoder_zero)

    def set_position(self, frame: bytes) -> None:
        self.axis.zero = self.place() - self.number(frame)

    def request_position(self, frame: bytes) -> None:
        self.send_packet(0x0412, struct.pack("<Hi", 1, self.position()), frame[5])

    def set_encoder(self, frame: bytes) -> None:
        self.axis.encoder_zero = self.place() - self.number(frame)

    def request_encoder(self, frame: bytes) -> None:
        self.send_packet(0x040B, struct.pack("<Hi", 1, self.encoder()), frame[5])

    # Motion

    def span(self) -> tuple[float, float]:
        """Return the bounds of motion: the limit switches, and the software limits if they are used."""
        low, high = 0.0, self.SPAN
        cw, ccw, mode = self.kept("limits")[2:]
        if mode & 0x7F > 1:
            low = max(low, min(high, self.axis.zero + ccw))
            high = max(low, min(high, self.axis.zero + cw))
        return low, high

    def velocity_parameters(self) -> tuple[float, float]:
        """Return acceleration and maximum velocity of moves."""
        _, acceleration, speed = self.kept("velocity")
        return acceleration, speed

    def jog_parameters(self) -> tuple[int, float, float, float]:
        """Return mode, step, acceleration and maximum velocity of jogs."""
        mode, step, _, acceleration, speed, _ = self.kept("jog")
        return mode, step, acceleration, speed

    def home_parameters(self) -> tuple[float, float]:
        """Return velocity and offset of homing."""
        _, _, speed, offset = self.kept("home")
        return speed, max(0, offset)

    def stored_distance(self) -> int:
        return self.kept("relative")[0]

    def stored_position(self) -> int:
        return self.kept("absolute")[0]

    def go(self, motion: str, path: Path) -> None:
        """Begin a motion, if the channel is enabled."""
        if not self.axis.enabled:
            return
        self.axis.path = path.within(*self.span()) if motion != HOME else path
        self.axis.motion, self.axis.stopping = motion, False
        self.catch_up()

    def move_to(self, target: float, motion: str, acceleration: float, speed: float) -> None:
        """Move to a place, with the backlash correction at the end of a move in reverse."""
        backlash = self.kept("general")[0]
        place, v = self.place(), self.speed()
        if backlash and (target - place) * backlash < 0:
            first = to_target(self.now, place, v, target - backlash, speed, acceleration)
            back = to_target(first.end, first.rest, 0, target, speed, acceleration)
            self.go(motion, then(first, back))
        else:
            self.go(motion, to_target(self.now, place, v, target, speed, acceleration))

    def move_absolute(self, position: int) -> None:
        self.move_to(self.axis.zero + position, MOVE, *self.velocity_parameters())

    def move_relative(self, distance: int) -> None:
        self.move_to(self.place() + distance, MOVE, *self.velocity_parameters())

    def move_jog(self, direction: int) -> None:
        if direction not in (1, 2):
            return
        side = 1 if direction == 1 else -1
        mode, step, acceleration, speed = self.jog_parameters()
        if mode == 2:
            self.move_to(self.place() + side * step, JOG, acceleration, speed)
        else:
            self.go(JOG, self.running(side * speed, acceleration))

    def move_velocity(self, direction: int) -> None:
        if direction in (1, 2):
            acceleration, speed = self.velocity_parameters()
            self.go(RUN, self.running(speed if direction == 1 else -speed, acceleration))

    def running(self, speed: float, acceleration: float) -> Path:
        return at_speed(self.now, self.place(), self.speed(), speed, acceleration)

    def move_home(self, frame: bytes) -> None:
        """Find the reverse limit switch, move away by the offset, and begin to count there."""
        self.axis.homed = False
        speed, offset = self.home_parameters()
        acceleration, _ = self.velocity_parameters()
        find = to_target(self.now, self.place(), self.speed(), 0, speed, acceleration)
        leave = to_target(find.end, 0, 0, offset, speed, acceleration)
        self.go(HOME, then(find, leave))

    def move_stop(self, mode: int) -> None:
        if mode not in (1, 2):
            return
        if self.axis.motion and mode == 2:
            acceleration = self.stop_deceleration()
            path = to_rest(self.now, self.place(), self.speed(), acceleration)
            self.axis.path = path.within(0, self.SPAN)
            self.axis.stopping = True
            self.catch_up()
        else:
            self.halt()
            self.report_stopped()

    def stop_deceleration(self) -> float:
        return self.kept("jog")[3] if self.axis.motion == JOG else self.kept("velocity")[1]

    def halt(self) -> None:
        """Stop at once."""
        self.axis.path = resting(self.place())
        self.axis.motion, self.axis.stopping = "", False

    def arrive(self) -> None:
        """End a motion and report it."""
        motion, stopping = self.axis.motion, self.axis.stopping
        self.halt()
        if stopping:
            self.report_stopped()
        elif motion == HOME:
            self.axis.homed = True
            self.axis.zero = self.axis.encoder_zero = self.place()
            self.send_end(0x0444)
        else:
            self.report_completed()

    def report_completed(self) -> None:
        self.send_end(0x0464, self.status_packet())

    def report_stopped(self) -> None:
        self.send_end(0x0466, self.status_packet())

    def send_end(self, id: int, packet: bytes = b"") -> None:
        """Report the end of a motion, unless these messages are suspended."""
        if self.suspended:
            return
        if packet:
            self.send_status(id, packet)
        else:
            self.send_header(id, 1)

    # Status

    def status_packet(self) -> bytes:
        raise NotImplementedError

    def status_bits(self) -> int:
        raise NotImplementedError

    def limit_bits(self) -> int:
        """Return the bits of the hardware limit switches, unless they are not fitted."""
        forward, reverse = (value & 0x7F != 1 for value in self.kept("limits")[:2])
        place = self.place()
        return (forward and place >= self.SPAN) | (reverse and place <= 0) << 1

    def motion_bits(self, moving: Sequence[int]) -> int:
        """Return one of two bits, by direction."""
        direction = self.axis.path.direction(self.now)
        return moving[0] if direction > 0 else moving[1] if direction < 0 else 0
