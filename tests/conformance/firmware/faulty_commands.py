"""Firmware of an MS-2000 that is wrong: in its replies, in how it cuts commands, in how it moves."""

from __future__ import annotations

from collections.abc import Callable
from random import Random

from firmware_commands import (
    CommandDefect,
    CommandFirmware,
    Reply,
    SaysReplies,
    TakesCommands,
)

from stagewire.commands import Command, CommandFrame
from stagewire_ms2000 import PROTOCOL
from stagewire_ms2000 import messages as c

__all__ = ["COMMANDS"]

_X, _Y = 0x18, 0x19
_ALL_READS = "reads identification status"
_STATUS = (c.ReadStatusByte, c.ReadMotorPositionAndStatus)
_MOVES = "move-target move-increment move-together move-vector stop-start limits"
_WIDE = (c.ReadMotorPosition, c.ReadIncrementValue, c.ReadTargetPosition)
_READS: tuple[type[Command], ...] = tuple(
    cls
    for cls in PROTOCOL.messages
    if issubclass(cls, Command)
    and cls.__name__.startswith("Read")
    and "StartSpeed" not in cls.__name__
)


def _name(cls: type[Command]) -> str:
    return cls.layout.message


def _read(
    name: str, change: Callable[[Random], Reply], *commands: type[Command], found_by: str = ""
) -> CommandDefect:
    """Return a defect in the replies to one command."""

    def make(random: Random) -> tuple[CommandFirmware, str]:
        command = random.choice(commands or _READS)
        return SaysReplies(change(random), command), _name(command)

    return CommandDefect(name, frozenset((found_by or _ALL_READS).split()), make)


def _write(
    name: str, found_by: str, change: Callable[[bytes], bytes], *commands: type[Command]
) -> CommandDefect:
    """Return a defect in what becomes of a command that writes, or moves."""

    def make(random: Random) -> tuple[CommandFirmware, str]:
        command = random.choice(commands)
        return TakesCommands(change, command), _name(command)

    return CommandDefect(name, frozenset(found_by.split()), make)


def _always(change: Reply) -> Callable[[Random], Reply]:
    return lambda random: change


def _nothing(raw: bytes) -> bytes:
    return b""


def _data(change: Callable[[bytes], bytes]) -> Callable[[bytes], bytes]:
    """Return a change of the data of a command that carries some."""
    return lambda raw: raw[:3] + change(raw[3:-1]) + raw[-1:]


def _plus_one(data: bytes) -> bytes:
    value = (int.from_bytes(data, "little") + 1) % (1 << 8 * len(data))
    return value.to_bytes(len(data), "little")


def _without_top(data: bytes) -> bytes:
    """Keep 16 of 24 bits, as a number with a sign."""
    return data[:2] + (b"\xff" if data[1] & 0x80 else b"\0")


class _Drops(CommandFirmware):
    """Loses one reply in so many."""

    def __init__(self, one_in: int) -> None:
        self._one_in = one_in
        self._said = 0

    def takes(self, frame: CommandFrame, raw: bytes) -> bytes:
        said = self.pass_on(raw)
        self._said += bool(said)
        return said if self._said % self._one_in else b""


class _Complains(CommandFirmware):
    """Answers what is wrong with an error, as the high-level format does."""

    def takes_odd(self, raw: bytes) -> bytes:
        said = self.pass_on(raw)
        return said if raw[:1] == b"\xff" else said + b":N-1\r\n"


class _Confirms(CommandFirmware):
    """Confirms what has no reply."""

    def __init__(self, *commands: type[Command]) -> None:
        self._commands = commands

    def takes(self, frame: CommandFrame, raw: bytes) -> bytes:
        said = self.pass_on(raw)
        return said + b":A" if isinstance(frame.message, self._commands) else said


class _CutsAtColons(CommandFirmware):
    """Takes every colon for the end of a command."""

    def takes(self, frame: CommandFrame, raw: bytes) -> bytes:
        if b":" in raw[2:-1] and len(raw) > 4:
            return b"".join(self.pass_on(piece + b":") for piece in raw[:-1].split(b":") if piece)
        return self.pass_on(raw)


class _OtherAxis(CommandFirmware):
    """Does for one axis what was meant for another."""

    def __init__(self, one: int, other: int, *commands: type[Command]) -> None:
        self._one, self._other = one, other
        self._commands = commands

    def takes(self, frame: CommandFrame, raw: bytes) -> bytes:
        if isinstance(frame.message, self._commands) and raw[0] == self._one:
            raw = bytes((self._other,)) + raw[1:]
        return self.pass_on(raw)


class _BothAxes(CommandFirmware):
    """Does for both axes what was meant for one."""

    def __init__(self, *commands: type[Command]) -> None:
        self._commands = commands

    def takes(self, frame: CommandFrame, raw: bytes) -> bytes:
        said = self.pass_on(raw)
        if isinstance(frame.message, self._commands):
            other = _X + _Y - raw[0] if raw[0] in (_X, _Y) else raw[0]
            self.pass_on(bytes((other,)) + raw[1:])
        return said


class _NoWayBack(CommandFirmware):
    """Does not know the setup command that leaves the low-level format."""

    def takes(self, frame: CommandFrame, raw: bytes) -> bytes:
        return b"" if raw == b"\xffA" else self.pass_on(raw)


class _WantsASize(CommandFirmware):
    """Does not understand a command whose size slot is left out, though the document has it so."""

    def takes(self, frame: CommandFrame, raw: bytes) -> bytes:
        return b"" if raw[2:3] == b":" and len(raw) == 3 else self.pass_on(raw)


class _WantsNoSize(CommandFirmware):
    """Does not understand a size of 0."""

    def takes(self, frame: CommandFrame, raw: bytes) -> bytes:
        return b"" if raw[2:4] == b"\0:" else self.pass_on(raw)


class _Upset(CommandFirmware):
    """Takes the next command for a part of what was wrong."""

    def __init__(self) -> None:
        self._upset = False

    def takes(self, frame: CommandFrame, raw: bytes) -> bytes:
        upset, self._upset = self._upset, False
        return b"" if upset else self.pass_on(raw)

    def takes_odd(self, raw: bytes) -> bytes:
        self._upset = raw[:1] != b"\xff"
        return self.pass_on(raw)


class _HardOfHearing(CommandFirmware):
    """Does not hear every twentieth command."""

    def __init__(self) -> None:
        self._count = 0

    def takes(self, frame: CommandFrame, raw: bytes) -> bytes:
        self._count += 1
        return b"" if self._count % 20 == 0 else self.pass_on(raw)


class _OnPaper(CommandFirmware):
    """Tells the top speed that was written, and goes on with the one that it had."""

    def __init__(self) -> None:
        self._told: dict[int, bytes] = {}

    def takes(self, frame: CommandFrame, raw: bytes) -> bytes:
        if isinstance(frame.message, c.WriteTopSpeed):
            self._told[raw[0]] = raw[3:5]
            return b""
        said = self.pass_on(raw)
        is_asked = isinstance(frame.message, c.ReadMaximumSpeed)
        return self._told.get(raw[0], said) if is_asked else said


class _Stale(CommandFirmware):
    """Tells for ever what it told first, axis by axis."""

    def __init__(self, *commands: type[Command]) -> None:
        self._commands = commands
        self._first: dict[int, bytes] = {}

    def takes(self, frame: CommandFrame, raw: bytes) -> bytes:
        said = self.pass_on(raw)
        if not isinstance(frame.message, self._commands):
            return said
        return self._first.setdefault(raw[0], said)


def _made(
    name: str, found_by: str, make: Callable[[Random], CommandFirmware], about: str = ""
) -> CommandDefect:
    """Return a defect in how the controller works."""
    return CommandDefect(name, frozenset(found_by.split()), lambda random: (make(random), about))


def _bit(mask: int, *, on: bool) -> Reply:
    return lambda said: said[:-1] + bytes((said[-1] | mask if on else said[-1] & ~mask,))


def _one_less(data: bytes) -> bytes:
    """Return a target that is a tenth nearer to zero."""
    target = int.from_bytes(data, "little", signed=True) * 9 // 10
    return target.to_bytes(3, "little", signed=True)


def _always_told(letter: bytes) -> Callable[[Random], CommandFirmware]:
    return lambda random: SaysReplies(lambda said: letter, c.ReadStatus)


COMMANDS = (
    _read("A command is never answered", _always(_nothing)),
    _read("A reply is too short", _always(lambda said: said[:-1])),
    _read("A reply is too long", lambda random: lambda said: said + bytes((random.randrange(256),))),
    _read("A reply ends with a line end", _always(lambda said: said + b"\r\n")),
    _read("A reply ends with a colon", _always(lambda said: said + b":")),
    _read("A reply is said twice", _always(lambda said: said + said)),
    _read(
        "A reply has its bytes in the wrong order", _always(lambda said: said[::-1]),
        c.ReadMaximumSpeed, c.ReadIncrementValue, found_by="readback",
    ),
    _read("The identification is another text", _always(lambda said: b"EFIL :"), c.ReadIdentification),
    _read("The identification lacks its blank", _always(lambda said: b"EMOT:"), c.ReadIdentification),
    _read("The busy letter is another one", _always(lambda said: b"N"), c.ReadStatus),
    _read("The servo bit is not set", _always(_bit(0x02, on=False)), *_STATUS),
    _read("The moving bit is stuck on", _always(_bit(0x01, on=True)), *_STATUS),
    _read("The moving bit is stuck off", _always(_bit(0x01, on=False)), c.ReadStatusByte, found_by=_MOVES),
    _read("Both limit bits are set", _always(_bit(0xC0, on=True)), *_STATUS),
    _read("The joystick bit is stuck", _always(_bit(0x08, on=True)), c.ReadStatusByte, found_by="joystick"),
    _made("One reply in fifty is lost", "back-to-back", lambda r: _Drops(r.choice((40, 50)))),
    _made("One command in twenty is lost", "back-to-back", lambda r: _HardOfHearing()),
    _made("Y is answered as X", "readback", lambda r: _OtherAxis(_Y, _X, *_WIDE)),
    _made("What is wrong is answered with an error", "silence", lambda r: _Complains()),
    _made("A write is confirmed", "readback", lambda r: _Confirms(c.WriteTopSpeed), "WRITE_TOP_SPEED"),
    _made("A move is confirmed", _MOVES, lambda r: _Confirms(c.WriteTargetPosition), "WRITE_TARGET_POSITION"),
    _made("Every colon ends a command", "marks-in-data", lambda r: _CutsAtColons()),
    _made("The low-level format cannot be left", "formats", lambda r: _NoWayBack()),
    _made("A size slot is wanted everywhere", "reads", lambda r: _WantsASize()),
    _made("A size of 0 is not understood", "joystick move-increment", lambda r: _WantsNoSize()),
    _made("An unknown command upsets it", "silence", lambda r: _Upset()),
    _made("It is never busy", _MOVES, _always_told(b"b")),
    _made("It is always busy", f"status {_MOVES}", _always_told(b"B")),
    _made("The position is stale", _MOVES, lambda r: _Stale(c.ReadMotorPosition)),
    _made("The status byte is stale", _MOVES, lambda r: _Stale(c.ReadStatusByte)),
    _made("A move goes to both axes", _MOVES, lambda r: _BothAxes(c.WriteTargetPosition, c.IncrementMoveUp)),
    _made("Settings go to both axes", "readback", lambda r: _BothAxes(c.WriteTopSpeed)),
    _made("X and Y are mixed up in moves", _MOVES, lambda r: _OtherAxis(_X, _Y, c.WriteTargetPosition)),
    _write("A write is ignored", "readback", _nothing, c.WriteIncrementValue, c.WriteTopSpeed),
    _write(
        "A value is off by one", "readback", _data(_plus_one),
        c.WriteIncrementValue, c.WriteRampingTime, c.WriteTopSpeed,
    ),
    _write(
        "A value is kept in the wrong order of bytes", "readback", _data(lambda data: data[::-1]),
        c.WriteIncrementValue, c.WriteTopSpeed,
    ),
    _write("Only 16 bits of an increment are kept", "readback", _data(_without_top), c.WriteIncrementValue),
    _write("A target is ignored", _MOVES, _nothing, c.WriteTargetPosition),
    _write("A target is off by a tenth", _MOVES, _data(_one_less), c.WriteTargetPosition),
    _write(
        "Moves by the increment are ignored", "move-increment", _nothing,
        c.IncrementMoveUp, c.IncrementMoveDown,
    ),
    _write("A step down goes up", "move-increment", lambda raw: raw.replace(b"-", b"+"), c.IncrementMoveDown),
    _write("A stop is ignored", "stop-start", _nothing, c.StopMotor),
    _write("A vector speed is ignored", "move-vector", _nothing, c.WriteVectorSpeed),
    _write("The counter cannot be set", "counter", _nothing, c.WriteMotorPosition),
    _made("The top speed has no effect", "top-speed ramps", lambda r: _OnPaper()),
    _write("The joystick cannot be disabled", "joystick", _nothing, c.JoystickDisable),
    _write("The joystick cannot be enabled", "joystick", _nothing, c.JoystickEnable),
)  # fmt: skip
