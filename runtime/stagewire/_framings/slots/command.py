"""Commands, setup commands and replies, and the bytes that mean something by themselves.

As every message they are content and nothing else: a command does not know its axis, which
:class:`~stagewire.protocols.CommandFrame` adds, and a reply knows neither axis nor command, since
neither is sent.
"""

from __future__ import annotations

from collections.abc import Mapping

from stagewire._codec.message import Message
from stagewire.errors import BadValueError, OutOfRangeError, UnsupportedError

TYPE_CHECKING = False  # typing would take half of the time of an import
if TYPE_CHECKING:
    from typing import ClassVar, Final, Self


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


SLOTS: Final = 3
"""Slots before the data: axis, command byte, size."""


MAXIMUM_COMMAND: Final = SLOTS + 0xFF + 1
"""Bytes of the longest command: a size slot cannot count further, and the terminator follows."""


class Reply(Message, abstract=True):
    """Base of replies: fields and nothing else, so that only the request says what they are."""

    __slots__ = ()

    @classmethod
    def unpack(cls, raw: bytes) -> Self:
        """Make the reply from all of its bytes, without any check."""
        raise NotImplementedError

    def pack(self) -> bytes:
        """Return the bytes of the reply."""
        raise NotImplementedError


class Command(Message, abstract=True):
    """Base of commands: an axis, the command's byte, a size slot, data and the terminator.

    Commands without data need nothing more; those with data bring ``unpack`` and ``_pack``.
    """

    __slots__ = ()
    reply: ClassVar[type[Reply] | None] = None
    """What the controller answers; None when it stays silent."""
    if TYPE_CHECKING:
        marks: ClassVar[Marks]  # set by the protocol that lists the class

    @classmethod
    def unpack(cls, raw: bytes) -> Self:
        """Make the command from the bytes of a whole one, size slot included, without any check."""
        return cls()

    def pack(self, axis: int, *, allow_dummy: bool = False) -> bytes:
        """Return the bytes of the command for ``axis``, in the form that the document prints.

        Raises :class:`~stagewire.errors.OutOfRangeError` or
        :class:`~stagewire.errors.BadValueError` for what is no axis identifier, and
        :class:`~stagewire.errors.UnsupportedError` for a dummy unless ``allow_dummy`` is set.
        """
        marks = self.marks
        if axis.__class__ is not int or axis not in marks.axis_bytes:
            axis = marks.axis(axis)
        if self.layout.dummy and not allow_dummy:
            raise UnsupportedError(
                f"{self.layout.message} is a dummy that the document says not to use; "
                "allow_dummy encodes it all the same"
            )
        return self._pack(axis)

    def _pack(self, axis: int) -> bytes:
        """Return the bytes of the command for an axis that was checked."""
        layout, end = self.layout, self.marks.terminator
        if layout.size is None:
            return bytes((axis, layout.id, end))
        return bytes((axis, layout.id, layout.size, end))


class SetupCommand(Message, abstract=True):
    """Base of setup commands: two bytes, the prefix and the command's own, for the whole controller."""

    __slots__ = ()
    reply: ClassVar[type[Reply] | None] = None
    if TYPE_CHECKING:
        marks: ClassVar[Marks]  # set by the protocol that lists the class

    @classmethod
    def unpack(cls, raw: bytes) -> Self:
        """Make the command from its two bytes, without any check."""
        return cls()

    def pack(self) -> bytes:
        """Return the two bytes of the command."""
        return bytes((self.marks.prefix, self.layout.id))
