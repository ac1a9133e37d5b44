"""What generated commands, setup commands and replies stand on.

As every message they are content and nothing else: a command does not know its axis, which
:class:`~stagewire.commands.frame.CommandFrame` adds, and a reply knows neither axis nor command, since
neither is sent.
"""

from __future__ import annotations

from stagewire.errors import UnsupportedError
from stagewire.message import Message

TYPE_CHECKING = False  # typing would take half of the time of an import
if TYPE_CHECKING:
    from typing import ClassVar, Self

    from stagewire.commands.marks import Marks

__all__ = ["Command", "Reply", "SetupCommand"]


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
