"""Commands with their axis, an optional size slot and ignored bytes; their events; and the prefix check.

A value may contain the bytes of a setup command. On request such a value is refused: a controller that looks
for the prefix anywhere, not only at the beginning of a command, would execute the setup command, for example
a reset in the middle of a move. Changing the value by one count does not always help, because the two bytes
may be the upper ones.
"""

from __future__ import annotations

from collections.abc import Callable

from stagewire._codec.events import Event, Frozen
from stagewire._framings.slots.command import MAXIMUM_COMMAND, SLOTS, Command, Marks, SetupCommand
from stagewire.errors import BadValueError, OutOfRangeError

TYPE_CHECKING = False  # importing typing would double the import time
if TYPE_CHECKING:
    from typing import Any, Final


Encode = Callable[[Command], bytes]

_BLOCKS: Final = tuple(1 << bits for bits in range(64, -1, -8))
"""Sizes of ranges of values that share their upper bytes, the largest first."""


def _find_prefix(raw: bytes, marks: Marks) -> int | None:
    """Return the position of the prefix and the byte of a setup command; None if there is none."""
    at = raw.find(marks.prefix)
    while 0 <= at < len(raw) - 1:
        if raw[at + 1] in marks.setup:
            return at
        at = raw.find(marks.prefix, at + 1)
    return None


def refuse_prefix(message: Command, raw: bytes, encode: Encode) -> None:
    """Raise :class:`~stagewire.errors.OutOfRangeError` if ``raw`` contains a setup command.

    The message names the nearest safe values of the field that causes it.

    :param message: the command with these bytes.
    :param encode: returns the bytes of another command of the same class.
    """
    marks = message.marks
    at = _find_prefix(raw, marks)
    if at is None:
        return
    layout = message.layout
    name = layout.message
    advice = "no value nearby avoids it"
    fields = (
        message.values() if at < SLOTS + layout.length else {}
    )  # otherwise it is in the extra bytes
    for field, value in fields.items():
        if isinstance(value, bool) or not isinstance(value, int):
            continue
        nearest = (_safe(message, field, step, encode) for step in (-1, 1))
        safe = [str(value) for value in nearest if value is not None]
        if safe:
            name = f"{name}.{field} {int(value)}"
            advice = (
                f"the nearest safe value{'s are' if len(safe) > 1 else ' is'} {' and '.join(safe)}"
            )
            break
    byte = raw[at + 1]
    raise OutOfRangeError(
        f"{name} is not sent: bytes {at} and {at + 1} of the command would be {marks.prefix:02x} "
        f"{byte:02x}, which a controller may take for {marks.setup[byte]}; {advice}"
    )


def _safe(message: Command, field: str, step: int, encode: Encode) -> int | None:
    """Return the nearest value of ``field`` in one direction that makes the whole command safe."""
    marks = message.marks

    def encoded(value: int) -> bytes | None:
        try:
            return encode(message.replace(**{field: value}))
        except OutOfRangeError:
            return None

    value: int = getattr(message, field) + step
    while (raw := encoded(value)) is not None:
        at = _find_prefix(raw, marks)
        if at is None:
            return value
        # Bytes in the upper part are the same for all values that differ only below them: 65536 of
        # them, or more. If lower bytes of all zeros and of all ones both result in the same pair,
        # all values between do.
        pair = raw[at : at + 2]
        for block in _BLOCKS:
            low, high = value & -block, value | block - 1
            ends = encoded(low), encoded(high)
            if all(end is not None and end[at : at + 2] == pair for end in ends):
                value = (high if step > 0 else low) + step
                break
    return None


FORMS: Final[dict[str, bool | None]] = {
    "request": None,
    "request:with_size": True,
    "request:without_size": False,
}
"""The forms of a command -> the ``sized`` argument of :class:`CommandFrame`."""


class CommandFrame(Frozen):
    """A command to an axis, or a setup command to the controller; immutable.

    :param message: the command.
    :param axis: identifier of the axis; None for a setup command.
    :param extra: bytes between the data and the terminator, which a controller ignores.
    :param sized: whether to send the size slot; None: as the document prints the command.
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
        """Make a frame.

        Raises :class:`~stagewire.errors.OutOfRangeError` for an invalid axis or too many extra bytes, and
        :class:`~stagewire.errors.BadValueError` for an argument of the wrong type or one that the command
        cannot have.
        """
        if extra.__class__ is not bytes:
            if not isinstance(extra, (bytes, bytearray, memoryview)):
                raise BadValueError(f"extra must be bytes, not {extra!r}")
            extra = bytes(extra)
        if sized is not None and not isinstance(sized, bool):
            raise BadValueError(f"sized must be True, False or None, not {sized!r}")
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
            raise BadValueError(f"{layout.message} has data, so its size cannot be omitted")
        if extra:
            if not sized:
                raise BadValueError(
                    f"{layout.message} without its size slot cannot have extra bytes"
                )
            if marks.terminator in extra:
                raise BadValueError(
                    f"extra holds {marks.terminator:#04x}, which would end the command"
                )
            room = MAXIMUM_COMMAND - SLOTS - layout.length - 1
            if len(extra) > room:
                raise OutOfRangeError(f"extra must have at most {room} bytes, not {len(extra)}")
        return make_command_frame(message, axis, extra, sized)

    @property
    def form(self) -> str:
        """``request`` as the document prints the command, or the form with or without its size."""
        if isinstance(self.message, SetupCommand) or self.sized is _is_sized(self.message):
            return "request"
        return "request:with_size" if self.sized else "request:without_size"

    def encode(self, *, allow_dummy: bool = False, refuse_prefix_bytes: bool = False) -> bytes:
        """Return the bytes of the command.

        ``refuse_prefix_bytes`` is for controllers that look for setup commands anywhere in the stream. With
        it, a value whose bytes contain the prefix and the byte of a setup command is refused.

        Raises :class:`~stagewire.errors.UnsupportedError` for a dummy unless ``allow_dummy`` is set, and
        :class:`~stagewire.errors.OutOfRangeError` for a value that is refused; the message names the nearest
        safe values.
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
    """A frame while it is being filled; :mod:`stagewire._codec.events` explains why."""

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
    """Return a frame of parts that are known to be valid."""
    draft: Any = _Draft()
    draft.message = message
    draft.axis = axis
    draft.extra = extra
    draft.sized = sized
    draft.__class__ = CommandFrame
    frame: CommandFrame = draft
    return frame


class CommandReceived(Event):
    """A command or a setup command, perhaps with bytes that a controller ignores."""

    __slots__ = ("decoder",)

    decoder: Callable[[bytes], CommandFrame]

    def __init__(self, raw: bytes, decoder: Callable[[bytes], CommandFrame]) -> None:
        self.raw = raw
        self.decoder = decoder

    @property
    def frame(self) -> CommandFrame:
        """The decoded command, decoded again on each access."""
        return self.decoder(self.raw)


class UnknownCommand(Event):
    """Bytes up to a terminator whose command byte is unknown."""

    __slots__ = ()


class TextReceived(Event):
    """A line of text with its end, in either direction; only for listeners that follow both formats.

    See :mod:`stagewire._framings.slots.streams`.
    """

    __slots__ = ()


class BadCommandLength(Event):
    """Bytes up to a terminator whose size slot is wrong for the command."""

    __slots__ = ()
