"""A line to a virtual MS-2000 whose firmware has a defect: whole commands pass it one by one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from random import Random

from stagewire.framing import CommandReceived
from stagewire.links import Link
from stagewire.protocols import Command, CommandFrame
from stagewire_conformance.device.results import Result
from stagewire_ms2000 import PROTOCOL

_UNITS = ("MS2000", "MFC2000")
Reply = Callable[[bytes], bytes]
"""What becomes of a reply."""


class CommandFirmware:
    """What stands between a host and the controller as it should be. Made anew for each run."""

    pass_on: Callable[[bytes], bytes]
    """Gives bytes to the controller, and returns what it says at once."""

    def takes(self, frame: CommandFrame, raw: bytes) -> bytes:
        """Return what is said to a whole command."""
        return self.pass_on(raw)

    def takes_odd(self, raw: bytes) -> bytes:
        """Return what is said to bytes that are no command: unknown ones, setup commands, rubbish."""
        return self.pass_on(raw)


class FaultyCommandLink(Link):
    """A line in stepped time to an MS-2000 with broken firmware.

    :param link: to the controller as it should be.
    """

    def __init__(self, link: Link, firmware: CommandFirmware) -> None:
        self.url = link.url
        self.clock = link.clock
        self._link = link
        self._firmware = firmware
        self._framer = PROTOCOL.framer()
        self._said = b""
        firmware.pass_on = self._pass_on

    def _pass_on(self, raw: bytes) -> bytes:
        self._link.write(raw)
        return self._link.read(0)

    def read(self, timeout: float) -> bytes:
        """Return what was said, or what comes."""
        said, self._said = self._said, b""
        return said or self._link.read(timeout)

    def write(self, data: bytes) -> None:
        """Give the firmware what the host sends, command by command."""
        for event in self._framer.feed(data):
            if isinstance(event, CommandReceived):
                self._said += self._firmware.takes(event.frame, event.raw)
            else:
                self._said += self._firmware.takes_odd(event.raw)

    def write_now(self, data: bytes) -> None:
        """Do as :meth:`write` does."""
        self.write(data)

    def wake(self) -> None:
        """Let the next read return at once."""
        self._link.wake()

    def close(self) -> None:
        """Hang up."""
        self._link.close()


@dataclass(frozen=True)
class CommandDefect:
    """A way in which the firmware of an MS-2000 is wrong; see :class:`.Defect`."""

    name: str
    found_by: frozenset[str]
    make: Callable[[Random], tuple[CommandFirmware, str]]
    result: Result = Result.FAIL

    def draw(self, seed: int) -> tuple[str, CommandFirmware, str]:
        """Return a unit, the firmware, and the command that the check has to name; empty: any."""
        random = Random(f"{self.name}/{seed}")
        unit = random.choice(_UNITS)
        firmware, about = self.make(random)
        return unit, firmware, about


class SaysReplies(CommandFirmware):
    """Says the replies to some commands otherwise."""

    def __init__(self, change: Reply, *commands: type[Command], axis: int | None = None) -> None:
        self._change = change
        self._commands = commands
        self._axis = axis

    def takes(self, frame: CommandFrame, raw: bytes) -> bytes:
        said = self.pass_on(raw)
        mine = isinstance(frame.message, self._commands or Command)
        return self._change(said) if mine and said and self._axis in (None, raw[0]) else said


class TakesCommands(CommandFirmware):
    """Takes some commands for others."""

    def __init__(self, change: Callable[[bytes], bytes], *commands: type[Command]) -> None:
        self._change = change
        self._commands = commands

    def takes(self, frame: CommandFrame, raw: bytes) -> bytes:
        mine = isinstance(frame.message, self._commands)
        changed = self._change(raw) if mine else raw
        return self.pass_on(changed) if changed else b""
