"""The two formats of an MS-2000: the effects and the answers of their commands.

The high-level format has lines of text, of which this module supports two; the low-level format has binary
commands.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Final

from stagewire.protocols import Command, Reply
from stagewire_ms2000 import messages as m
from stagewire_ms2000.enumerations import Busy
from stagewire_virtual.asi_ms2000.servo_axis import ServoAxis
from stagewire_virtual.instrument import Unit

_LONGEST: Final = 255
"""How many characters of a line are kept; a longer line is an unknown command."""
_UNKNOWN_COMMAND: Final = ":N-1"
_UNKNOWN_AXIS: Final = ":N-2"
_MISSING_PARAMETER: Final = ":N-3"


class HighLevel:
    """Reads lines byte by byte and answers them.

    :param axes: the fitted axes by their letters, in the order of the answer to WHERE.
    """

    def __init__(self, axes: Mapping[str, ServoAxis]) -> None:
        self._axes = axes
        self._line = bytearray()
        self.hundredths = False
        """Whether WHERE answers in hundredths of a micrometre (section 1): tenths with one decimal place."""

    def clear(self) -> None:
        """Discard an incomplete line."""
        self._line.clear()

    def feed(self, byte: int) -> bytes:
        """Add a byte and return the answer to the line that it ends; empty if it ends none."""
        if byte != ord("\r"):
            if len(self._line) <= _LONGEST:
                self._line.append(byte)
            return b""
        line = bytes(self._line)
        self.clear()
        words = line.decode("latin-1").upper().split()
        if not words:
            return b""
        answer = _UNKNOWN_COMMAND if len(line) > _LONGEST else self._answer(words[0], words[1:])
        return answer.encode("ascii") + b"\r\n"

    def _answer(self, command: str, parameters: Sequence[str]) -> str:
        if command in ("/", "STATUS"):
            return "B" if any(axis.busy for axis in self._axes.values()) else "N"
        if command in ("W", "WHERE"):
            return self._where(parameters)
        return _UNKNOWN_COMMAND

    def _where(self, axes: Sequence[str]) -> str:
        """Return positions in the order of the axes, regardless of the order in the request."""
        if not axes:
            return _MISSING_PARAMETER
        if any(name not in self._axes for name in axes):
            return _UNKNOWN_AXIS
        found = [self._position(axis) for name, axis in self._axes.items() if name in axes]
        return " ".join([":A", *found])

    def _position(self, axis: ServoAxis) -> str:
        if not self.hundredths:
            return str(axis.position)
        return f"{round(axis.exact_position * 10) / 10:.1f}".removesuffix(".0")


_IDENTIFICATION: Final = "EMOT :"
"""The answer of X, Y and Z (section 7); the F axis, which the document does not mention, answers the same."""

_READ: Final[Mapping[type[Command], Callable[[ServoAxis], Reply]]] = {
    m.ReadStatus: lambda axis: m.ReadStatusReply(Busy.BUSY if axis.busy else Busy.NOT_BUSY),
    m.ReadMotorPosition: lambda axis: m.ReadMotorPositionReply(_low_bytes(axis.position, 3)),
    m.ReadIncrementValue: lambda axis: m.ReadIncrementValueReply(axis.increment),
    m.ReadIdentification: lambda axis: m.ReadIdentificationReply(_IDENTIFICATION),
    m.ReadMotorPositionAndStatus: lambda axis: m.ReadMotorPositionAndStatusReply(
        _low_bytes(axis.position, 3), axis.status
    ),
    m.ReadCurrentSpeed: lambda axis: m.ReadCurrentSpeedReply(_low_bytes(axis.speed, 2)),
    m.ReadRampTime: lambda axis: m.ReadRampTimeReply(axis.ramp_time),
    m.ReadStartSpeed: lambda axis: m.ReadStartSpeedReply(0),  # a dummy function, which answers 0
    m.ReadMaximumSpeed: lambda axis: m.ReadMaximumSpeedReply(axis.top_speed),
    m.ReadTargetPosition: lambda axis: m.ReadTargetPositionReply(_low_bytes(axis.target, 3)),
    m.ReadStatusByte: lambda axis: m.ReadStatusByteReply(axis.status),
}
"""The commands that are answered."""


class LowLevel:
    """Carries out commands of the low-level format; invalid commands are ignored (section 2).

    :param unit: the unit in the registry.
    :param axes: the fitted axes by their identifiers.
    :param readings: the reading of each strategy.
    :param refuse: called with the reason if a command is ignored.
    """

    def __init__(
        self,
        unit: Unit,
        axes: Mapping[int, ServoAxis],
        readings: Mapping[str, str],
        refuse: Callable[[str], None],
    ) -> None:
        self._refuse = refuse
        self._messages = unit.messages
        self._axes = axes
        self._needs_size = readings["missing_size"] == "ignored"
        self._signed = readings["vector_speed"] == "signed"

    def carry_out(self, axis: int, command: Command, sized: bool) -> bytes:
        """Carry out a command and return its reply; empty if it has none.

        :param axis: the identifier of the addressed axis.
        :param sized: whether the command has its size.
        """
        name = command.layout.message
        addressed = self._axes.get(axis)
        if name not in self._messages:
            self._refuse(f"{name} is not a command of this controller")
        elif addressed is None:
            self._refuse(f"{name}: no axis {axis:#04x} is fitted")
        elif self._needs_size and not sized and command.layout.size:
            self._refuse(f"{name} has no size")
        elif read := _READ.get(type(command)):
            return read(addressed).pack()
        else:
            self._write(addressed, command)
        return b""

    def _write(self, axis: ServoAxis, command: Command) -> None:
        """Carry out a command without a reply. WRITE_START_SPEED, a dummy function, does nothing."""
        match command:
            case m.StartMotor():
                axis.start()
            case m.StopMotor():
                axis.stop()
            case m.WriteMotorPosition(position=position):
                axis.set_position(position)
            case m.WriteTargetPosition(target_position=position):
                axis.move_to(position)
            case m.IncrementMoveUp():
                axis.move_by(axis.increment)
            case m.IncrementMoveDown():
                axis.move_by(-axis.increment)
            case m.WriteIncrementValue(increment=increment):
                axis.increment = increment
            case m.WriteRampingTime(ramp_time=0):
                self._refuse("WRITE_RAMPING_TIME: the ramp time must not be 0")
            case m.WriteRampingTime(ramp_time=time):
                axis.ramp_time = time
            case m.WriteTopSpeed(top_speed=speed):
                axis.top_speed = speed
            case m.WriteVectorSpeed(vector_speed=speed):
                axis.run(_low_bytes(speed, 2) if self._signed else speed)
            case m.JoystickEnable():
                axis.joystick_enabled = True
            case m.JoystickDisable():
                axis.joystick_enabled = False


def _low_bytes(value: int, size: int) -> int:
    """Return the signed number in the ``size`` lowest bytes of a number, as section 2 splits numbers."""
    half = 1 << (8 * size - 1)
    return (value + half) % (2 * half) - half
