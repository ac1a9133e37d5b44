"""A host for one virtual motor in tests: it sends messages, and records answers and the motion."""

from __future__ import annotations

from typing import Any

from stagewire import Frame, FramedMessage, Stage
from stagewire_apt import PROTOCOL
from stagewire_apt import messages as m
from stagewire_virtual.clock import SteppedClock
from stagewire_virtual.factory import make_instrument
from stagewire_virtual.instrument import Row, find_unit
from stagewire_virtual.options import Options, Settings
from stagewire_virtual.thorlabs_apt.motor.motor import Motor

BITS = {
    "forward_hardware_limit": 0,
    "reverse_hardware_limit": 1,
    "forward_software_limit": 2,
    "reverse_software_limit": 3,
    "moving_forward": 4,
    "moving_reverse": 5,
    "jogging_forward": 6,
    "jogging_reverse": 7,
    "motor_connected": 8,
    "homing": 9,
    "homed": 10,
    "tracking": 12,
    "settled": 13,
    "motion_error": 14,
    "channel_enabled": 31,
}
"""Status bits from the tables of pages 77, 79 and 80; bit 12 of a stepper is its interlock."""


class MotorHost:
    """The host of the first channel of a new unit.

    :param name: the name of the unit.
    :param stage: the stage; ``travel`` and ``position`` are those of the stage.
    :param options: other options of the unit.
    """

    def __init__(
        self,
        name: str,
        *,
        stage: Stage | None = None,
        travel: int | None = None,
        position: int | None = None,
        **options: Any,
    ) -> None:
        unit = find_unit(name)
        self.clock = SteppedClock()
        settings = Settings(stage, travel, position)
        self.instrument = make_instrument(
            unit, self.clock, Options(channels=(settings,), **options)
        )
        self.address = 0x50 if unit.facts["address"] == "generic_usb" else 0x21
        self._context = {"status": unit.facts["status"]}
        self.said: list[tuple[int, FramedMessage]] = []
        self.instrument.on_send = self._hear
        self._channel = self.instrument.channel(1)

    def _hear(self, raw: bytes) -> None:
        frame = PROTOCOL.decode(raw, self._context)
        assert (frame.dest, frame.source) == (0x01, self.address)
        self.said.append((self.clock.now, frame.message))

    def say(self, message: FramedMessage) -> None:
        self.instrument.receive(Frame(message, self.address, 0x01).encode())

    def ask(self, message: FramedMessage) -> Any:
        """Return the only immediate answer to a message, and clear the record."""
        self.said.clear()
        self.say(message)
        [(when, answer)] = self.said
        assert when == self.now
        self.said.clear()
        return answer

    def wait(self, seconds: float) -> None:
        self.clock.advance(seconds)

    @property
    def now(self) -> int:
        return self.clock.now

    @property
    def kinds(self) -> list[str]:
        """The names of the received messages in order."""
        return [message.layout.message for _, message in self.said]

    @property
    def position(self) -> int:
        """The present position counter, read without a message."""
        return self._motor.position()["position"]

    @property
    def velocity(self) -> float:
        """The present velocity in counts/s."""
        return self._motor._axis.velocity

    @property
    def bits(self) -> set[str]:
        """The names of the status bits that are set; checks that no unnamed bit is set."""
        word = self._motor.status()["status_bits"]
        names = dict(BITS)
        if self._context["status"] == "stepper":
            names = {**dict(list(BITS.items())[:11]), "interlock_enabled": 12}
        named = {name for name, bit in names.items() if word >> bit & 1}
        assert sum(1 << names[name] for name in named) == word
        return named

    @property
    def _motor(self) -> Motor:
        assert isinstance(self._channel.behaviour, Motor)
        return self._channel.behaviour

    @property
    def row(self) -> Row:
        """The row of the channel in the live table."""
        rows = self.instrument.rows()
        return next(row for row in rows if row.part in ("channel 1", "bay 1, channel 1"))

    def stick(self, stuck: bool) -> None:
        self.instrument.stick(self.row.part, stuck)


def told(name: str, velocity: int = 10_000, acceleration: int = 20_000) -> MotorHost:
    """Return the host of a motor with 10,000 counts/s and 20,000 counts/s², in the middle of its travel."""
    host = MotorHost(name, travel=1_000_000, position=500_000)
    host.say(m.MotSetVelParams(1, 0, acceleration, velocity))
    return host


def under_way(name: str) -> MotorHost:
    """Return the same host 1 s into a 3 s move to 25,000 counts: at 7,500 counts and 10,000 counts/s."""
    host = told(name)
    host.say(m.MotMoveAbsolute(1, 25_000))
    host.wait(1)
    return host
