"""A line to a virtual MS-2000 with defective firmware: whole commands pass it one by one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from random import Random

from stagewire.framing import CommandReceived
from stagewire.links import Link
from stagewire.protocols import Command, CommandFrame
from stagewire_conformance.device.results import Result
from stagewire_ms2000 import PROTOCOL
from wrapped_links import WrappedLink

_UNITS = ("MS2000", "MFC2000")
Reply = Callable[[bytes], bytes]
"""Changes a reply."""


class CommandFirmware:
    """The layer between a host and a correct controller. One is made for each run."""

    pass_on: Callable[[bytes], bytes]
    """Passes bytes to the controller, and returns its immediate output."""

    def takes(self, frame: CommandFrame, raw: bytes) -> bytes:
        """Return the output for a whole command."""
        return self.pass_on(raw)

    def takes_odd(self, raw: bytes) -> bytes:
        """Return the output for bytes that are not a command: unknown ones, setup commands, garbage."""
        return self.pass_on(raw)


class FaultyCommandLink(WrappedLink):
    """A line in stepped time to an MS-2000 with defective firmware.

    :param link: to a correct controller.
    """

    def __init__(self, link: Link, firmware: CommandFirmware) -> None:
        super().__init__(link)
        self._firmware = firmware
        self._framer = PROTOCOL.framer()
        self._said = b""
        firmware.pass_on = self._pass_on

    def _pass_on(self, raw: bytes) -> bytes:
        self._link.write(raw)
        return self._link.read(0)

    def read(self, timeout: float) -> bytes:
        """Return pending output, or wait for output."""
        said, self._said = self._said, b""
        return said or self._link.read(timeout)

    def write(self, data: bytes) -> None:
        """Pass the bytes of the host to the firmware, command by command."""
        for event in self._framer.feed(data):
            if isinstance(event, CommandReceived):
                self._said += self._firmware.takes(event.frame, event.raw)
            else:
                self._said += self._firmware.takes_odd(event.raw)


@dataclass(frozen=True)
class CommandDefect:
    """A defect in the firmware of an MS-2000; see :class:`.Defect`."""

    seed: int
    name: str
    found_by: frozenset[str]
    make: Callable[[Random], tuple[CommandFirmware, str]]
    result: Result = Result.FAIL
    ends: str = ""

    def draw(self, number: int) -> tuple[str, CommandFirmware, str]:
        """Return a unit, the firmware, and the command that the check must name; empty for any."""
        random = Random(f"{self.seed}/{number}")
        unit = random.choice(_UNITS)
        firmware, about = self.make(random)
        return unit, firmware, about


class SaysReplies(CommandFirmware):
    """Changes the replies to some commands."""

    def __init__(self, change: Reply, *commands: type[Command], axis: int | None = None) -> None:
        self._change = change
        self._commands = commands
        self._axis = axis

    def takes(self, frame: CommandFrame, raw: bytes) -> bytes:
        said = self.pass_on(raw)
        mine = isinstance(frame.message, self._commands or Command)
        return self._change(said) if mine and said and self._axis in (None, raw[0]) else said


class TakesCommands(CommandFirmware):
    """Replaces some commands by others."""

    def __init__(self, change: Callable[[bytes], bytes], *commands: type[Command]) -> None:
        self._change = change
        self._commands = commands

    def takes(self, frame: CommandFrame, raw: bytes) -> bytes:
        mine = isinstance(frame.message, self._commands)
        changed = self._change(raw) if mine else raw
        return self.pass_on(changed) if changed else b""
