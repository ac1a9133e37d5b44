"""The framing rule of commands once more, as simple and slow as it can be said.

One byte after the other is looked at, with all that came before it in hand; nothing is found by searching
and nothing is remembered. The framer of ``stagewire.commands`` is compared with it.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

__all__ = ["Piece", "Reference"]

LONGEST = 3 + 255 + 1


class Piece(NamedTuple):
    """What some bytes are: ``command``, ``unknown``, ``bad_length``, ``garbage`` or ``pending``."""

    kind: str
    raw: bytes


class Reference:
    """The rule for one protocol.

    :param commands: command byte -> bytes of data, and the number in the size slot.
    """

    def __init__(
        self, prefix: int, terminator: int, setup: set[int], commands: Mapping[int, tuple[int, int]]
    ) -> None:
        self.prefix = prefix
        self.terminator = terminator
        self.setup = setup
        self.commands = commands

    def read(self, stream: bytes) -> list[Piece]:
        """Return what a stream is made of, neighbouring garbage joined."""
        pieces: list[Piece] = []
        begun = b""
        for byte in stream:
            begun += bytes((byte,))
            kind = self._complete(begun)
            if kind is not None:
                pieces.append(Piece(kind, begun))
                begun = b""
        if begun:
            pieces.append(Piece("garbage" if self._is_garbage(begun) else "pending", begun))
        joined: list[Piece] = []
        for piece in pieces:
            if joined and joined[-1].kind == piece.kind == "garbage":
                joined[-1] = Piece("garbage", joined[-1].raw + piece.raw)
            else:
                joined.append(piece)
        return joined

    def _complete(self, begun: bytes) -> str | None:
        """Return what ``begun`` is when its last byte completes it."""
        if self._is_garbage(begun):
            return "garbage" if begun[-1] == self.terminator else None
        if begun[0] == self.prefix:
            return "command" if len(begun) == 2 else None
        if len(begun) < 3 or begun[-1] != self.terminator:
            return None
        if begun[1] not in self.commands:
            return "unknown"
        length, size = self.commands[begun[1]]
        if begun[2] == self.terminator:
            return "bad_length" if length else "command"
        if begun[2] != size:
            return "bad_length"
        return "command" if len(begun) > 3 + length else None

    def _is_garbage(self, begun: bytes) -> bool:
        if begun[0] == self.terminator:
            return True
        if len(begun) == 1:
            return False
        if begun[0] == self.prefix:
            return begun[1] not in self.setup
        if begun[1] == self.terminator or len(begun) > LONGEST:
            return True
        return len(begun) == LONGEST and not self._ends(begun)

    def _ends(self, begun: bytes) -> bool:
        """Whether the last byte ends a command of the greatest length."""
        length, size = self.commands.get(begun[1], (0, -1))
        data = length if begun[2] == size else 0
        return begun[-1] == self.terminator and len(begun) > 3 + data
