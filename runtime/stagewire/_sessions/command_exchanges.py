"""Exchanges with a controller that accepts commands or lines of text, and the mode that decides which."""

from __future__ import annotations

from stagewire._framings.slots.command import SetupCommand
from stagewire._framings.slots.frame import CommandFrame
from stagewire._framings.slots.protocol import CommandProtocol
from stagewire._sessions.exchange import Exchange
from stagewire.errors import WrongModeError

TYPE_CHECKING = False  # importing typing would double the import time
if TYPE_CHECKING:
    from typing import Final, Literal, TypeAlias

    Mode: TypeAlias = Literal["unknown", "low_level", "high_level"]


_MODES: Final[dict[str, Mode]] = {
    "low_level": "low_level",
    "high_level": "high_level",
    "power_on": "unknown",
}
"""Format that a setup command switches to -> the resulting mode of the controller."""


class CommandExchange(Exchange):
    """An exchange with a controller of commands.

    :param frame: the command; None for a line of text.
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
        """Whether the controller replies."""
        return self.frame is None or self.frame.message.reply is not None

    @property
    def needs(self) -> Mode | None:
        """The mode that the controller must be in; None: any."""
        if self.frame is None:
            return "high_level"
        return None if isinstance(self.frame.message, SetupCommand) else "low_level"

    def mode_after(self, mode: Mode) -> Mode:
        """Return the mode of the controller after this exchange."""
        switches_to = None if self.frame is None else self.frame.message.layout.switches_to
        return mode if switches_to is None else _MODES[switches_to]


def check_mode(line: CommandExchange, mode: Mode) -> None:
    """Raise :class:`~stagewire.errors.WrongModeError` for an exchange that requires another mode."""
    if line.needs in (None, mode):
        return
    takes = {
        "unknown": "it is unknown whether the controller accepts commands or lines of text now",
        "low_level": "the controller accepts only commands now, not lines of text",
        "high_level": "the controller accepts only lines of text now, not commands",
    }[mode]
    wanted = "low-level" if line.needs == "low_level" else "high-level"
    raise WrongModeError(
        f"{line.name} was not sent: {takes}; switch it to the {wanted} format first"
    )


def switching(protocol: CommandProtocol, format: str) -> type[SetupCommand] | None:
    """Return the setup command that switches to ``format``; None if the protocol has none."""
    for cls in protocol.messages:
        if issubclass(cls, SetupCommand) and cls.layout.switches_to == format:
            return cls
    return None


def in_low_level(protocol: CommandProtocol, raw: bytes, mode: Mode) -> bytes:
    """Return the bytes of a command, surrounded by commands that switch to low level and, if known, back.

    For a stop, which cannot wait for the caller to switch. If the protocol has no commands that switch, the
    bytes are returned unchanged.
    """
    there, back = switching(protocol, "low_level"), switching(protocol, "high_level")
    if mode == "low_level" or there is None or back is None:
        return raw
    return there().pack() + raw + (back().pack() if mode == "high_level" else b"")
