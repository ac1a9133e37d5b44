"""Both directions of a line on which replies have no frame: what was asked tells what comes."""

from __future__ import annotations

from stagewire.commands import CommandReceived
from stagewire.commands.overheard import Replies
from stagewire.framing import Event
from stagewire_conformance.codec.base import Reader

__all__ = ["Asking", "Replies"]


class Asking:
    """Cuts what a host sends into commands, and tells which replies they have.

    :param commands: cuts it.
    :param replies: are told.
    """

    def __init__(self, commands: Reader, replies: Replies) -> None:
        self._commands = commands
        self._replies = replies

    @property
    def pending(self) -> bytes | bytearray | memoryview:
        """The bytes that wait for more."""
        return self._commands.pending

    def feed(self, data: bytes) -> list[Event]:
        """Take what a host sends at once and return the commands that it completes."""
        self._replies.turn()
        events = self._commands.feed(data)
        for event in events:
            if isinstance(event, CommandReceived):
                self._replies.asked(event.frame)
        return events
