"""Building blocks for defective firmware of an MS-2000."""

from __future__ import annotations

from firmware_commands import CommandFirmware

from stagewire.protocols import Command, CommandFrame
from stagewire_ms2000 import messages as c

X, Y = 0x18, 0x19


class Drops(CommandFirmware):
    """Loses one reply in a given number."""

    def __init__(self, one_in: int) -> None:
        self._one_in = one_in
        self._said = 0

    def takes(self, frame: CommandFrame, raw: bytes) -> bytes:
        said = self.pass_on(raw)
        self._said += bool(said)
        return said if self._said % self._one_in else b""


class Complains(CommandFirmware):
    """Answers errors with an error message, like the high-level format."""

    def takes_odd(self, raw: bytes) -> bytes:
        said = self.pass_on(raw)
        return said if raw[:1] == b"\xff" else said + b":N-1\r\n"


class Confirms(CommandFirmware):
    """Answers commands that have no reply."""

    def __init__(self, *commands: type[Command]) -> None:
        self._commands = commands

    def takes(self, frame: CommandFrame, raw: bytes) -> bytes:
        said = self.pass_on(raw)
        return said + b":A" if isinstance(frame.message, self._commands) else said


class CutsAtColons(CommandFirmware):
    """Treats every colon as the end of a command."""

    def takes(self, frame: CommandFrame, raw: bytes) -> bytes:
        if b":" in raw[2:-1] and len(raw) > 4:
            return b"".join(self.pass_on(piece + b":") for piece in raw[:-1].split(b":") if piece)
        return self.pass_on(raw)


class OtherAxis(CommandFirmware):
    """Executes commands for one axis on another."""

    def __init__(self, one: int, other: int, *commands: type[Command]) -> None:
        self._one, self._other = one, other
        self._commands = commands

    def takes(self, frame: CommandFrame, raw: bytes) -> bytes:
        if isinstance(frame.message, self._commands) and raw[0] == self._one:
            raw = bytes((self._other,)) + raw[1:]
        return self.pass_on(raw)


class BothAxes(CommandFirmware):
    """Executes commands for one axis on both."""

    def __init__(self, *commands: type[Command]) -> None:
        self._commands = commands

    def takes(self, frame: CommandFrame, raw: bytes) -> bytes:
        said = self.pass_on(raw)
        if isinstance(frame.message, self._commands):
            other = X + Y - raw[0] if raw[0] in (X, Y) else raw[0]
            self.pass_on(bytes((other,)) + raw[1:])
        return said


class NoWayBack(CommandFirmware):
    """Does not support the setup command that leaves the low-level format."""

    def takes(self, frame: CommandFrame, raw: bytes) -> bytes:
        return b"" if raw == b"\xffA" else self.pass_on(raw)


class WantsASize(CommandFirmware):
    """Rejects commands without a size slot, although the document allows them."""

    def takes(self, frame: CommandFrame, raw: bytes) -> bytes:
        return b"" if raw[2:3] == b":" and len(raw) == 3 else self.pass_on(raw)


class WantsNoSize(CommandFirmware):
    """Rejects a size of 0."""

    def takes(self, frame: CommandFrame, raw: bytes) -> bytes:
        return b"" if raw[2:4] == b"\0:" else self.pass_on(raw)


class Upset(CommandFirmware):
    """Reads the next command as a part of an invalid one."""

    def __init__(self) -> None:
        self._upset = False

    def takes(self, frame: CommandFrame, raw: bytes) -> bytes:
        upset, self._upset = self._upset, False
        return b"" if upset else self.pass_on(raw)

    def takes_odd(self, raw: bytes) -> bytes:
        self._upset = raw[:1] != b"\xff"
        return self.pass_on(raw)


class HardOfHearing(CommandFirmware):
    """Loses every twentieth command."""

    def __init__(self) -> None:
        self._count = 0

    def takes(self, frame: CommandFrame, raw: bytes) -> bytes:
        self._count += 1
        return b"" if self._count % 20 == 0 else self.pass_on(raw)


class OnPaper(CommandFirmware):
    """Reports the written top speed, but continues with the old one."""

    def __init__(self) -> None:
        self._told: dict[int, bytes] = {}

    def takes(self, frame: CommandFrame, raw: bytes) -> bytes:
        if isinstance(frame.message, c.WriteTopSpeed):
            self._told[raw[0]] = raw[3:5]
            return b""
        said = self.pass_on(raw)
        is_asked = isinstance(frame.message, c.ReadMaximumSpeed)
        return self._told.get(raw[0], said) if is_asked else said


class Stale(CommandFirmware):
    """Repeats its first reply for ever, for each axis."""

    def __init__(self, *commands: type[Command]) -> None:
        self._commands = commands
        self._first: dict[int, bytes] = {}

    def takes(self, frame: CommandFrame, raw: bytes) -> bytes:
        said = self.pass_on(raw)
        if not isinstance(frame.message, self._commands):
            return said
        return self._first.setdefault(raw[0], said)
