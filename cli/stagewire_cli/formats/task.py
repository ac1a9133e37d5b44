"""What is to be decoded: whose bytes they are, and what has to be known beforehand to read them."""

from __future__ import annotations

import abc
from collections.abc import Mapping
from typing import ClassVar, TypeAlias

from stagewire.commands import CommandFrame, CommandProtocol, CommandReceived, Reply
from stagewire.frame import Frame
from stagewire.framed import FramedProtocol
from stagewire.framing import End, Event, Received, Undocumented
from stagewire.message import Message
from stagewire.protocol import Protocol
from stagewire_cli.errors import CalledWronglyError
from stagewire_conformance.codec.base import Reader

__all__ = ["CommandTask", "Decoded", "FramedTask", "Task", "message_of"]

Decoded: TypeAlias = Frame | CommandFrame | Reply


class Task(abc.ABC):
    """What is to be decoded, in one of the ways in which messages are framed.

    :param protocol: whose bytes they are.
    :param only: the one message class that is wanted; None for everything.
    """

    addresses: ClassVar[tuple[str, ...]]
    """What says whom a message is for: attributes of what is decoded, and columns of a table."""

    def __init__(self, protocol: Protocol, only: type[Message] | None = None) -> None:
        self.protocol = protocol
        self.only = only

    @abc.abstractmethod
    def decode(self, raw: bytes) -> Decoded:
        """Decode the bytes of exactly one message; raises as the protocol does."""

    @abc.abstractmethod
    def reader(self, end: End | None) -> Reader:
        """Return what cuts a stream into events.

        Raises :class:`CalledWronglyError` for an end whose stream cannot be cut.
        """

    @abc.abstractmethod
    def found(self, event: Event) -> Decoded | None:
        """Return the message in an event, None where it holds none."""

    def wants(self, decoded: Decoded) -> bool:
        """Whether a message is to be shown."""
        return self.only is None or type(message_of(decoded)) is self.only

    def addressed(self, decoded: Decoded) -> tuple[int | None, ...]:
        """Return the values of :attr:`addresses`; None for what it has not."""
        return tuple(getattr(decoded, name, None) for name in self.addresses)


def message_of(decoded: Decoded) -> Message:
    """Return what is said; a reply is its own content."""
    return decoded if isinstance(decoded, Reply) else decoded.message


class FramedTask(Task):
    """Frames with a header.

    :param context: what decides between layouts that bytes cannot tell apart.
    """

    protocol: FramedProtocol
    addresses = ("dest", "source")

    def __init__(
        self,
        protocol: FramedProtocol,
        context: Mapping[str, str] | None = None,
        only: type[Message] | None = None,
    ) -> None:
        super().__init__(protocol, only)
        self.context = context

    def decode(self, raw: bytes) -> Frame:
        """Decode one frame."""
        return self.protocol.decode(raw, self.context)

    def reader(self, end: End | None) -> Reader:
        """Return a framer for the end of the line."""
        return self.protocol.framer(end or End.NONE)

    def found(self, event: Event) -> Frame | None:
        """Return the frame in an event."""
        if isinstance(event, (Received, Undocumented)):
            return self.protocol.decode(event.raw, self.context)
        return None


class CommandTask(Task):
    """Commands, or the replies to one of them.

    :param command: name of the command whose replies are read; None for commands.
    """

    protocol: CommandProtocol
    addresses = ("axis",)

    def __init__(
        self,
        protocol: CommandProtocol,
        command: str | None = None,
        only: type[Message] | None = None,
    ) -> None:
        super().__init__(protocol, only)
        self.command = command

    def decode(self, raw: bytes) -> CommandFrame | Reply:
        """Decode one command, or one reply."""
        if self.command is None:
            return self.protocol.decode(raw)
        return self.protocol.decode_reply(raw, self.command)

    def reader(self, end: End | None) -> Reader:
        """Return a framer of commands; replies have no frame to cut a stream by."""
        if self.command is not None or end is End.HOST:
            raise CalledWronglyError(
                "replies have no frame, so that a stream of them cannot be cut; give them one by one, in "
                "hex or as JSON captures, with --direction reply and --command"
            )
        return self.protocol.framer()

    def found(self, event: Event) -> CommandFrame | None:
        """Return the command in an event."""
        return event.frame if isinstance(event, CommandReceived) else None
