"""A command on its way: its axis, whether it says its size, and bytes that a controller ignores."""

from __future__ import annotations

from stagewire.commands.command import Command, SetupCommand
from stagewire.commands.prefix import refuse_prefix
from stagewire.commands.rule import MAXIMUM_COMMAND, SLOTS
from stagewire.errors import BadValueError, OutOfRangeError
from stagewire.frozen import Frozen

TYPE_CHECKING = False  # typing would take half of the time of an import
if TYPE_CHECKING:
    from typing import Any, Final

__all__ = ["FORMS", "CommandFrame", "make_command_frame"]

FORMS: Final[dict[str, bool | None]] = {
    "request": None,
    "request:with_size": True,
    "request:without_size": False,
}
"""The forms of a command -> what :class:`CommandFrame` takes as ``sized`` for it."""


class CommandFrame(Frozen):
    """A command to an axis, or a setup command to the controller; immutable.

    :param message: what is said.
    :param axis: identifier of the axis; None for a setup command.
    :param extra: bytes between the data and the terminator, which a controller ignores.
    :param sized: whether the size slot is there; None: as the document prints the command.
    """

    __slots__ = ("axis", "extra", "message", "sized")
    __match_args__ = ("message", "axis", "extra", "sized")
    message: Command | SetupCommand
    axis: int | None
    extra: bytes
    sized: bool

    def __new__(
        cls,
        message: Command | SetupCommand,
        axis: int | None = None,
        extra: bytes = b"",
        sized: bool | None = None,
    ) -> CommandFrame:
        """Put a command on its way.

        Raises :class:`~stagewire.errors.OutOfRangeError` for an axis that is none and for more extra
        bytes than a command has room for, and :class:`~stagewire.errors.BadValueError` for a part of
        the wrong kind or one that the command cannot have.
        """
        if extra.__class__ is not bytes:
            if not isinstance(extra, (bytes, bytearray, memoryview)):
                raise BadValueError(f"extra takes bytes, not {extra!r}")
            extra = bytes(extra)
        if sized is not None and not isinstance(sized, bool):
            raise BadValueError(f"sized takes True, False or None, not {sized!r}")
        if isinstance(message, SetupCommand):
            for name, value in (("axis", axis is not None), ("extra", extra), ("sized", sized)):
                if value:
                    raise BadValueError(f"{message.layout.message} is two bytes and has no {name}")
            return make_command_frame(message, None, b"", False)
        if not isinstance(message, Command):
            raise BadValueError(f"a frame carries a command, not {message!r}")
        layout, marks = message.layout, message.marks
        axis = marks.axis(axis)
        if sized is None:
            sized = layout.size is not None
        elif layout.length and not sized:
            raise BadValueError(f"{layout.message} has data, so that its size cannot be left out")
        if extra:
            if not sized:
                raise BadValueError(
                    f"{layout.message} without its size ends there: it has no extra bytes"
                )
            if marks.terminator in extra:
                raise BadValueError(
                    f"extra holds {marks.terminator:#04x}, which would end the command"
                )
            room = MAXIMUM_COMMAND - SLOTS - layout.length - 1
            if len(extra) > room:
                raise OutOfRangeError(f"extra takes at most {room} bytes here, not {len(extra)}")
        return make_command_frame(message, axis, extra, sized)

    @property
    def form(self) -> str:
        """``request`` as the document prints the command, or that with or without its size."""
        if isinstance(self.message, SetupCommand) or self.sized is _is_sized(self.message):
            return "request"
        return "request:with_size" if self.sized else "request:without_size"

    def encode(self, *, allow_dummy: bool = False, refuse_prefix_bytes: bool = False) -> bytes:
        """Return the bytes of the command.

        ``refuse_prefix_bytes`` is for controllers that look for setup commands anywhere in the stream:
        a value whose bytes would hold the prefix and then the byte of a setup command is not sent.

        Raises :class:`~stagewire.errors.UnsupportedError` for a dummy unless ``allow_dummy`` is set,
        and :class:`~stagewire.errors.OutOfRangeError` for a value that is refused so; the text names the
        nearest values that are safe.
        """
        message = self.message
        if isinstance(message, SetupCommand):
            return message.pack()
        raw = self._encode(message, allow_dummy)
        if refuse_prefix_bytes:
            refuse_prefix(message, raw, lambda other: self._encode(other, True))
        return raw

    def _encode(self, message: Command, allow_dummy: bool) -> bytes:
        assert self.axis is not None  # only setup commands have none
        raw = message.pack(self.axis, allow_dummy=allow_dummy)
        if self.sized is not _is_sized(message):
            slot = bytes((message.layout.size or 0,)) if self.sized else b""
            raw = raw[:2] + slot + raw[-1:]
        return raw[:-1] + self.extra + raw[-1:] if self.extra else raw

    def _key(self) -> tuple[Command | SetupCommand, int | None, bytes, bool]:
        return self.message, self.axis, self.extra, self.sized

    def __reduce__(self) -> tuple[Any, ...]:
        return make_command_frame, self._key()

    def __repr__(self) -> str:
        parts = [repr(self.message)]
        if self.axis is not None:
            parts.append(f"axis={self.axis:#04x}")
        if self.extra:
            parts.append(f"extra={self.extra!r}")
        if self.form != "request":
            parts.append(f"sized={self.sized}")
        return f"CommandFrame({', '.join(parts)})"


def _is_sized(message: Command) -> bool:
    """Whether the document prints the command with its size slot."""
    return message.layout.size is not None


class _Draft(Frozen):
    """A frame that is still being filled; see :mod:`stagewire.frozen` for why."""

    __slots__ = CommandFrame.__slots__
    __setattr__ = object.__setattr__
    __delattr__ = object.__delattr__
    message: Command | SetupCommand
    axis: int | None
    extra: bytes
    sized: bool


def make_command_frame(
    message: Command | SetupCommand, axis: int | None, extra: bytes, sized: bool
) -> CommandFrame:
    """Make a frame from parts that are known to be right."""
    draft: Any = _Draft()
    draft.message = message
    draft.axis = axis
    draft.extra = extra
    draft.sized = sized
    draft.__class__ = CommandFrame
    frame: CommandFrame = draft
    return frame
