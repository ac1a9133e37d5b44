"""The events of commands, and of text instead, beside :class:`~stagewire.framing.events.Garbage`.

The other events of :mod:`stagewire.framing` do not fit: their bytes begin with a header.
"""

from __future__ import annotations

from collections.abc import Callable

from stagewire.framing.events import Event

TYPE_CHECKING = False  # typing would take half of the time of an import
if TYPE_CHECKING:
    from stagewire.commands.frame import CommandFrame

__all__ = ["BadCommandLength", "CommandReceived", "TextReceived", "UnknownCommand"]


class CommandReceived(Event):
    """A command or a setup command, perhaps with bytes that a controller ignores."""

    __slots__ = ("decoder",)

    decoder: Callable[[bytes], CommandFrame]

    def __init__(self, raw: bytes, decoder: Callable[[bytes], CommandFrame]) -> None:
        self.raw = raw
        self.decoder = decoder

    @property
    def frame(self) -> CommandFrame:
        """The decoded command, made anew each time that it is asked for."""
        return self.decoder(self.raw)


class UnknownCommand(Event):
    """Up to a terminator, but byte 1 is the byte of no command."""

    __slots__ = ()


class TextReceived(Event):
    """A line of text with its end, of either side; only who follows both formats gives it out.

    See :mod:`stagewire.commands.formats`.
    """

    __slots__ = ()


class BadCommandLength(Event):
    """Up to a terminator, but the size slot does not say what the command has to say there."""

    __slots__ = ()
