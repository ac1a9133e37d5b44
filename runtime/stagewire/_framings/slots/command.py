"""Commands, setup commands and replies, and the bytes with a fixed meaning.

Like all messages they hold only their content. A command does not contain its axis, which
:class:`~stagewire.protocols.CommandFrame` adds. A reply contains neither axis nor command, because neither is
sent.
"""

from __future__ import annotations

from collections.abc import Mapping

from stagewire._codec.message import Message
from stagewire.errors import BadValueError, OutOfRangeError, UnsupportedError

TYPE_CHECKING = False  # importing typing would double the import time
if TYPE_CHECKING:
    from typing import ClassVar, Final, Self


class Marks:
    """The bytes with a fixed meaning in one protocol. Do not modify them.

    :param prefix: the byte that begins a setup command.
    :param terminator: the byte that ends a command.
    :param setup: the byte after the prefix -> the name of the setup command.

    Raises :class:`ValueError` for marks that cannot be distinguished.
    """

    __slots__ = ("axis_bytes", "prefix", "setup", "terminator")

    def __init__(self, prefix: int, terminator: int, setup: Mapping[int, str]) -> None:
        for byte in (prefix, terminator, *setup):
            if not 0 <= byte <= 0xFF:
                raise ValueError(f"{byte:#x} is not a byte")
        if prefix == terminator:
            raise ValueError(f"{prefix:#04x} cannot be both the prefix and the terminator")
        if terminator in setup:
            raise ValueError(f"{setup[terminator]}: {terminator:#04x} is the terminator")
        self.prefix = prefix
        self.terminator = terminator
        self.setup = dict(setup)
        self.axis_bytes = frozenset(range(0x100)) - {prefix, terminator}
        """The bytes that are valid as an axis."""

    @property
    def pair(self) -> tuple[int, int]:
        """The prefix and the terminator."""
        return self.prefix, self.terminator

    def axis(self, axis: object) -> int:
        """Return ``axis`` as a plain integer if it is valid as an axis.

        Every byte is valid except the prefix and the terminator, because users can change the identifiers of
        a controller. Raises :class:`~stagewire.errors.OutOfRangeError`, or
        :class:`~stagewire.errors.BadValueError` if it is not an integer (a bool is not accepted).
        """
        if isinstance(axis, bool) or not isinstance(axis, int):
            raise BadValueError(f"axis must be the identifier of an axis, an integer, not {axis!r}")
        if not 0 <= axis <= 0xFF:
            raise OutOfRangeError(f"axis must be an identifier of one byte, not {int(axis)}")
        if axis == self.prefix:
            raise OutOfRangeError(f"axis cannot be {axis:#04x}, the prefix of setup commands")
        if axis == self.terminator:
            raise OutOfRangeError(f"axis cannot be {axis:#04x}, the terminator of commands")
        return int(axis)


SLOTS: Final = 3
"""Slots before the data: axis, command byte, size."""


MAXIMUM_COMMAND: Final = SLOTS + 0xFF + 1
"""Bytes of the longest command: the three slots, the most data that a size slot can count, the terminator."""


class Reply(Message, abstract=True):
    """Base of replies. They hold only fields; the request determines which reply it is."""

    __slots__ = ()

    @classmethod
    def unpack(cls, raw: bytes) -> Self:
        """Return the reply in these bytes, without any check."""
        raise NotImplementedError

    def pack(self) -> bytes:
        """Return the bytes of the reply."""
        raise NotImplementedError


class Command(Message, abstract=True):
    """Base of commands: an axis, the command byte, a size slot, data and the terminator.

    Commands without data need no methods; the others define ``unpack`` and ``_pack``.
    """

    __slots__ = ()
    reply: ClassVar[type[Reply] | None] = None
    """The class of the reply; None if the controller does not reply."""
    if TYPE_CHECKING:
        marks: ClassVar[Marks]  # set by the protocol that lists the class

    @classmethod
    def unpack(cls, raw: bytes) -> Self:
        """Return the command in the bytes of a whole one, including the size slot, without any check."""
        return cls()

    def pack(self, axis: int, *, allow_dummy: bool = False) -> bytes:
        """Return the bytes of the command for ``axis``, in the form that the document prints.

        Raises :class:`~stagewire.errors.OutOfRangeError` or
        :class:`~stagewire.errors.BadValueError` for an invalid axis, and
        :class:`~stagewire.errors.UnsupportedError` for a dummy unless ``allow_dummy`` is set.
        """
        marks = self.marks
        if axis.__class__ is not int or axis not in marks.axis_bytes:
            axis = marks.axis(axis)
        if self.layout.dummy and not allow_dummy:
            raise UnsupportedError(
                f"{self.layout.message} is a dummy that the document says not to use; "
                "pass allow_dummy to encode it anyway"
            )
        return self._pack(axis)

    def _pack(self, axis: int) -> bytes:
        """Return the bytes of the command for an axis that was already checked."""
        layout, end = self.layout, self.marks.terminator
        if layout.size is None:
            return bytes((axis, layout.id, end))
        return bytes((axis, layout.id, layout.size, end))


class SetupCommand(Message, abstract=True):
    """Base of setup commands: the prefix and the command byte, for the whole controller."""

    __slots__ = ()
    reply: ClassVar[type[Reply] | None] = None
    if TYPE_CHECKING:
        marks: ClassVar[Marks]  # set by the protocol that lists the class

    @classmethod
    def unpack(cls, raw: bytes) -> Self:
        """Return the command in its two bytes, without any check."""
        return cls()

    def pack(self) -> bytes:
        """Return the two bytes of the command."""
        return bytes((self.marks.prefix, self.layout.id))
