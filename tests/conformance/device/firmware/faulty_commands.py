"""Defective firmware of an MS-2000: wrong replies, wrong command parsing, wrong motion."""

from __future__ import annotations

from collections.abc import Callable
from random import Random

from faulty_ms2000 import (
    BothAxes,
    Complains,
    Confirms,
    CutsAtColons,
    Drops,
    HardOfHearing,
    NoWayBack,
    OnPaper,
    OtherAxis,
    Stale,
    Upset,
    WantsASize,
    WantsNoSize,
    X,
    Y,
)
from firmware_commands import (
    CommandDefect,
    CommandFirmware,
    Reply,
    SaysReplies,
    TakesCommands,
)

from stagewire.protocols import Command
from stagewire_ms2000 import PROTOCOL
from stagewire_ms2000 import messages as c

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
    seed: int,
    name: str,
    change: Callable[[Random], Reply],
    *commands: type[Command],
    found_by: str = "",
) -> CommandDefect:
    """Return a defect in the replies to one command."""

    def make(random: Random) -> tuple[CommandFirmware, str]:
        command = random.choice(commands or _READS)
        return SaysReplies(change(random), command), _name(command)

    return CommandDefect(seed, name, frozenset((found_by or _ALL_READS).split()), make)


def _write(
    seed: int, name: str, found_by: str, change: Callable[[bytes], bytes], *commands: type[Command]
) -> CommandDefect:
    """Return a defect in the effect of a command that writes or moves."""

    def make(random: Random) -> tuple[CommandFirmware, str]:
        command = random.choice(commands)
        return TakesCommands(change, command), _name(command)

    return CommandDefect(seed, name, frozenset(found_by.split()), make)


def _always(change: Reply) -> Callable[[Random], Reply]:
    return lambda random: change


def _nothing(raw: bytes) -> bytes:
    return b""


def _data(change: Callable[[bytes], bytes]) -> Callable[[bytes], bytes]:
    """Return a change of the data of a command."""
    return lambda raw: raw[:3] + change(raw[3:-1]) + raw[-1:]


def _plus_one(data: bytes) -> bytes:
    value = (int.from_bytes(data, "little") + 1) % (1 << 8 * len(data))
    return value.to_bytes(len(data), "little")


def _without_top(data: bytes) -> bytes:
    """Keep 16 of 24 bits, as a signed number."""
    return data[:2] + (b"\xff" if data[1] & 0x80 else b"\0")


def _made(
    seed: int, name: str, found_by: str, make: Callable[[Random], CommandFirmware], about: str = ""
) -> CommandDefect:
    """Return a defect in the behaviour of the controller."""
    return CommandDefect(
        seed, name, frozenset(found_by.split()), lambda random: (make(random), about)
    )


def _bit(mask: int, *, on: bool) -> Reply:
    return lambda said: said[:-1] + bytes((said[-1] | mask if on else said[-1] & ~mask,))


def _one_less(data: bytes) -> bytes:
    """Return a target that is a tenth closer to zero."""
    target = int.from_bytes(data, "little", signed=True) * 9 // 10
    return target.to_bytes(3, "little", signed=True)


def _always_told(letter: bytes) -> Callable[[Random], CommandFirmware]:
    return lambda random: SaysReplies(lambda said: letter, c.ReadStatus)


COMMANDS = (
    _read(1, "A command is never answered", _always(_nothing)),
    _read(6, "A reply is too short", _always(lambda said: said[:-1])),
    _read(1, "A reply is too long", lambda random: lambda said: said + bytes((random.randrange(256),))),
    _read(6, "A reply ends with a line end", _always(lambda said: said + b"\r\n")),
    _read(6, "A reply ends with a colon", _always(lambda said: said + b":")),
    _read(8, "A reply is sent twice", _always(lambda said: said + said)),
    _read(
        6, "A reply has its bytes in the wrong order", _always(lambda said: said[::-1]),
        c.ReadMaximumSpeed, c.ReadIncrementValue, found_by="readback",
    ),
    _read(6, "The identification is another text", _always(lambda said: b"EFIL :"), c.ReadIdentification),
    _read(1, "The identification lacks its blank", _always(lambda said: b"EMOT:"), c.ReadIdentification),
    _read(6, "The busy letter is another one", _always(lambda said: b"N"), c.ReadStatus),
    _read(11, "The servo bit is not set", _always(_bit(0x02, on=False)), *_STATUS),
    _read(3, "The moving bit is stuck on", _always(_bit(0x01, on=True)), *_STATUS),
    _read(6, "The moving bit is stuck off", _always(_bit(0x01, on=False)), c.ReadStatusByte, found_by=_MOVES),
    _read(1, "Both limit bits are set", _always(_bit(0xC0, on=True)), *_STATUS),
    _read(6, "The joystick bit is stuck", _always(_bit(0x08, on=True)), c.ReadStatusByte,
          found_by="joystick"),
    _made(1, "One reply in fifty is lost", "back-to-back", lambda r: Drops(r.choice((40, 50)))),
    _made(6, "One command in twenty is lost", "back-to-back", lambda r: HardOfHearing()),
    _made(6, "Y is answered as X", "readback", lambda r: OtherAxis(Y, X, *_WIDE)),
    _made(6, "Errors are answered with an error message", "silence", lambda r: Complains()),
    _made(6, "A write is answered", "readback", lambda r: Confirms(c.WriteTopSpeed), "WRITE_TOP_SPEED"),
    _made(1, "A move is answered", _MOVES, lambda r: Confirms(c.WriteTargetPosition),
          "WRITE_TARGET_POSITION"),
    _made(6, "Every colon ends a command", "marks-in-data", lambda r: CutsAtColons()),
    _made(1, "The low-level format cannot be left", "formats", lambda r: NoWayBack()),
    _made(1, "A size slot is always required", "reads", lambda r: WantsASize()),
    _made(6, "A size of 0 is not accepted", "joystick move-increment", lambda r: WantsNoSize()),
    _made(1, "An unknown command upsets it", "silence", lambda r: Upset()),
    _made(6, "It is never busy", _MOVES, _always_told(b"b")),
    _made(1, "It is always busy", f"status {_MOVES}", _always_told(b"B")),
    _made(1, "The position is stale", _MOVES, lambda r: Stale(c.ReadMotorPosition)),
    _made(6, "The status byte is stale", _MOVES, lambda r: Stale(c.ReadStatusByte)),
    _made(1, "A move goes to both axes", _MOVES,
          lambda r: BothAxes(c.WriteTargetPosition, c.IncrementMoveUp)),
    _made(1, "Settings go to both axes", "readback", lambda r: BothAxes(c.WriteTopSpeed)),
    _made(6, "X and Y are mixed up in moves", _MOVES, lambda r: OtherAxis(X, Y, c.WriteTargetPosition)),
    _write(11, "A write is ignored", "readback", _nothing, c.WriteIncrementValue, c.WriteTopSpeed),
    _write(
        6, "A value is off by one", "readback", _data(_plus_one),
        c.WriteIncrementValue, c.WriteRampingTime, c.WriteTopSpeed,
    ),
    _write(
        3, "A value is stored with the wrong byte order", "readback", _data(lambda data: data[::-1]),
        c.WriteIncrementValue, c.WriteTopSpeed,
    ),
    _write(6, "Only 16 bits of an increment are stored", "readback", _data(_without_top),
           c.WriteIncrementValue),
    _write(1, "A target is ignored", _MOVES, _nothing, c.WriteTargetPosition),
    _write(1, "A target is off by a tenth", _MOVES, _data(_one_less), c.WriteTargetPosition),
    _write(
        6, "Moves by the increment are ignored", "move-increment", _nothing,
        c.IncrementMoveUp, c.IncrementMoveDown,
    ),
    _write(6, "A step down goes up", "move-increment", lambda raw: raw.replace(b"-", b"+"),
           c.IncrementMoveDown),
    _write(6, "A stop is ignored", "stop-start", _nothing, c.StopMotor),
    _write(1, "A vector speed is ignored", "move-vector", _nothing, c.WriteVectorSpeed),
    _write(1, "The counter cannot be set", "counter", _nothing, c.WriteMotorPosition),
    _made(6, "The top speed has no effect", "top-speed ramps", lambda r: OnPaper()),
    _write(6, "The joystick cannot be disabled", "joystick", _nothing, c.JoystickDisable),
    _write(1, "The joystick cannot be enabled", "joystick", _nothing, c.JoystickEnable),
)  # fmt: skip
