"""Exchanges with a controller of commands or lines of text, and which of the two it takes when."""

from __future__ import annotations

from stagewire._framings.slots.command import SetupCommand
from stagewire._framings.slots.frame import CommandFrame
from stagewire._framings.slots.protocol import CommandProtocol
from stagewire._sessions.exchange import Exchange
from stagewire.errors import WrongModeError

TYPE_CHECKING = False  # typing would take half of the time of an import
if TYPE_CHECKING:
    from typing import Final, Literal, TypeAlias

    Mode: TypeAlias = Literal["unknown", "low_level", "high_level"]


_MODES: Final[dict[str, Mode]] = {
    "low_level": "low_level",
    "high_level": "high_level",
    "power_on": "unknown",
}
"""What a setup command switches to -> the mode that the controller is in then."""


class CommandExchange(Exchange):
    """What is sent on the line.

    :param frame: the command; None: it is a line of text.
    """

    __slots__ = ("frame", "sent_at")

    def __init__(
        self, frame: CommandFrame | None, text: str, raw: bytes, timeout: float, deadline: float
    ) -> None:
        super().__init__(text if frame is None else frame.message, raw, timeout, deadline)
        self.frame = frame
        self.sent_at = 0.0

    @property
    def is_answered(self) -> bool:
        """Whether something comes back."""
        return self.frame is None or self.frame.message.reply is not None

    @property
    def needs(self) -> Mode | None:
        """The mode in which the controller understands it; None: any."""
        if self.frame is None:
            return "high_level"
        return None if isinstance(self.frame.message, SetupCommand) else "low_level"

    def mode_after(self, mode: Mode) -> Mode:
        """Return the mode in which it leaves the controller."""
        switches_to = None if self.frame is None else self.frame.message.layout.switches_to
        return mode if switches_to is None else _MODES[switches_to]


def check_mode(line: CommandExchange, mode: Mode) -> None:
    """Raise :class:`~stagewire.errors.WrongModeError` for what would not be understood in a mode."""
    if line.needs in (None, mode):
        return
    takes = {
        "unknown": "nobody knows whether the controller takes commands or lines of text now",
        "low_level": "the controller takes commands now, and no lines of text",
        "high_level": "the controller takes lines of text now, and no commands",
    }[mode]
    wanted = "low-level" if line.needs == "low_level" else "high-level"
    raise WrongModeError(
        f"{line.name} was not sent: {takes}; switch it to the {wanted} format first"
    )


def switching(protocol: CommandProtocol, format: str) -> type[SetupCommand] | None:
    """Return the setup command after which a controller takes ``format``; None: the protocol has none."""
    for cls in protocol.messages:
        if issubclass(cls, SetupCommand) and cls.layout.switches_to == format:
            return cls
    return None


def in_low_level(protocol: CommandProtocol, raw: bytes, mode: Mode) -> bytes:
    """Return a command with what makes it understood in ``mode``, and what leads back, if that is known.

    For a stop, which cannot wait until somebody has switched. Where the protocol has no command that
    switches, it is returned as it is.
    """
    there, back = switching(protocol, "low_level"), switching(protocol, "high_level")
    if mode == "low_level" or there is None or back is None:
        return raw
    return there().pack() + raw + (back().pack() if mode == "high_level" else b"")
