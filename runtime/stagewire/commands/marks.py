"""The bytes that mean something by themselves wherever a command may begin or end."""

from __future__ import annotations

from collections.abc import Mapping

__all__ = ["Marks"]


class Marks:
    """The marks of one protocol. Not to be modified.

    :param prefix: the byte that begins a setup command.
    :param terminator: the byte that ends a command.
    :param setup: the byte that follows the prefix -> the name of the setup command.

    Raises :class:`ValueError` for marks that cannot be told apart.
    """

    __slots__ = ("axes", "prefix", "setup", "terminator")

    def __init__(self, prefix: int, terminator: int, setup: Mapping[int, str]) -> None:
        for byte in (prefix, terminator, *setup):
            if not 0 <= byte <= 0xFF:
                raise ValueError(f"{byte:#x} is no byte")
        if prefix == terminator:
            raise ValueError(f"{prefix:#04x} cannot be both the prefix and the terminator")
        if terminator in setup:
            raise ValueError(f"{setup[terminator]}: {terminator:#04x} is the terminator")
        self.prefix = prefix
        self.terminator = terminator
        self.setup = dict(setup)
        self.axes = frozenset(range(0x100)) - {prefix, terminator}
        """The bytes that can stand where an axis is due."""
