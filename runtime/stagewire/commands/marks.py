"""The bytes that mean something by themselves wherever a command may begin or end."""

from __future__ import annotations

from collections.abc import Mapping

from stagewire.errors import BadValueError, OutOfRangeError

__all__ = ["Marks"]


class Marks:
    """The marks of one protocol. Not to be modified.

    :param prefix: the byte that begins a setup command.
    :param terminator: the byte that ends a command.
    :param setup: the byte that follows the prefix -> the name of the setup command.

    Raises :class:`ValueError` for marks that cannot be told apart.
    """

    __slots__ = ("axis_bytes", "prefix", "setup", "terminator")

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
        self.axis_bytes = frozenset(range(0x100)) - {prefix, terminator}
        """The bytes that can stand where an axis is due."""

    @property
    def pair(self) -> tuple[int, int]:
        """The prefix and the terminator."""
        return self.prefix, self.terminator

    def axis(self, axis: object) -> int:
        """Return ``axis`` as a plain integer; raise unless it can stand where a command begins.

        Any byte can but the two that mean something else there. Identifiers can be changed on a
        controller, so that no other is refused. Raises :class:`~stagewire.errors.OutOfRangeError`, or
        :class:`~stagewire.errors.BadValueError` for what is no integer (a bool is none).
        """
        if isinstance(axis, bool) or not isinstance(axis, int):
            raise BadValueError(f"axis takes the identifier of an axis, an integer, not {axis!r}")
        if not 0 <= axis <= 0xFF:
            raise OutOfRangeError(f"axis takes an identifier of one byte, not {int(axis)}")
        if axis == self.prefix:
            raise OutOfRangeError(f"axis cannot be {axis:#04x}, the prefix of setup commands")
        if axis == self.terminator:
            raise OutOfRangeError(f"axis cannot be {axis:#04x}, which ends a command")
        return int(axis)
