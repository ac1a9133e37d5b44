"""What takes the messages that come to an address, and how it answers them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Protocol

from stagewire import Frame, FramedMessage

__all__ = ["Handler", "Panel", "Speaker"]

Handler = Callable[[Frame], None]
"""Takes one message of a controller's table."""


class Speaker(Protocol):
    """What a handler needs of the controller that it answers for."""

    def send(self, message: FramedMessage, cause: Frame) -> None:
        """Say something that a frame of the host caused."""

    def refuse(self, cause: Frame, why: str) -> None:
        """Do nothing of what a frame of the host wants."""


class Panel(Protocol):
    """A part of an instrument without channels, which answers at each address that it is built into."""

    def handlers(self, controller: Speaker) -> Mapping[str, Handler]:
        """Return what takes each of its messages, answering as ``controller``."""
