"""The high-level format: lines of text, of which two are understood here.

The document of the registry says no more of it than that it exists. WHERE, STATUS and the codes of errors are
those of the vendor's manual of serial commands (https://asiimaging.com/docs, pages ``commands/where`` and
``commands/status``); lines end with a carriage return, answers with a line feed as well (``commands/vb``).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

from stagewire_virtual.asi_ms2000.servo_axis import ServoAxis

__all__ = ["HighLevel"]

_LONGEST: Final = 255
"""How many characters of a line are kept; no command is longer, and what is longer is no command."""
_UNKNOWN_COMMAND: Final = ":N-1"
_UNKNOWN_AXIS: Final = ":N-2"
_MISSING_PARAMETER: Final = ":N-3"


class HighLevel:
    """Reads lines, byte by byte, and answers them.

    :param axes: the axes that are fitted, by their letters, in the order in which WHERE answers.
    """

    def __init__(self, axes: Mapping[str, ServoAxis]) -> None:
        self._axes = axes
        self._line = bytearray()
        self.hundredths = False
        """Whether WHERE answers in hundredths of a micrometre (section 1): as tenths with a decimal."""

    def clear(self) -> None:
        """Forget a line that has begun."""
        self._line.clear()

    def feed(self, byte: int) -> bytes:
        """Take a byte and return the answer to the line that it ends; empty when it ends none."""
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
        """Return positions in the order of the axes, whatever the order in which they were asked for."""
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
