"""Replies: bytes without a frame, so that the one request that is outstanding says what they are.

Neither axis nor command comes back, and many replies are equally long. Whoever asks twice before the
first answer came, or goes on after one that did not come in time, takes the answer to one question for
the answer to another. So one request is outstanding at most, and a line on which a reply is overdue is
*poisoned* until it was silent for long enough.
"""

from __future__ import annotations

from stagewire.commands.command import Command, Reply, SetupCommand
from stagewire.commands.frame import CommandFrame
from stagewire.errors import (
    BadLengthError,
    BadValueError,
    OutstandingReplyError,
    TrailingBytesError,
    TruncatedError,
)
from stagewire.framing.events import Event, Garbage

__all__ = ["ReplyDecoder", "ReplyReceived", "decode_reply", "reply_to"]


def reply_to(command: type[Command | SetupCommand]) -> type[Reply] | None:
    """Return the class of the reply to a command, None when the controller stays silent."""
    return command.reply if issubclass(command, Command) else None


def decode_reply(raw: bytes, command: type[Command | SetupCommand]) -> Reply:
    """Decode all the bytes of the reply to a command.

    Raises :class:`~stagewire.errors.TruncatedError` or
    :class:`~stagewire.errors.TrailingBytesError` for another number of bytes, and
    :class:`~stagewire.errors.BadLengthError` for a command that has no reply.
    """
    reply = reply_to(command)
    if reply is None:
        raise BadLengthError(f"{command.layout.message} has no reply")
    length = reply.layout.length
    if len(raw) != length:
        text = f"the reply to {command.layout.message} has {length} bytes, here are {len(raw)}"
        raise (TruncatedError if len(raw) < length else TrailingBytesError)(text)
    return reply.unpack(raw)


class ReplyReceived(Event):
    """The whole reply to ``request``."""

    __slots__ = ("request",)
    __match_args__ = ("raw", "request")

    request: CommandFrame

    def __init__(self, raw: bytes, request: CommandFrame) -> None:
        self.raw = raw
        self.request = request

    @property
    def reply(self) -> Reply:
        """The decoded reply, made anew each time that it is asked for."""
        return decode_reply(self.raw, type(self.request.message))

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, ReplyReceived):
            return NotImplemented
        return self.raw == other.raw and self.request == other.request

    def __hash__(self) -> int:
        return hash((self.__class__, self.raw, self.request))

    def __repr__(self) -> str:
        return f"ReplyReceived({self.raw.hex(' ')!r}, {self.request!r})"


class ReplyDecoder:
    """Reads what one controller sends to the host, without any input or output.

    The bytes of all events so far, followed by :attr:`pending`, are the bytes that were fed.
    Nothing that comes from outside makes :meth:`feed` raise.
    """

    __slots__ = ("_length", "_outstanding", "_pending", "_poisoned")

    def __init__(self) -> None:
        self._outstanding: CommandFrame | None = None
        self._length = 0
        self._pending = b""
        self._poisoned = False

    @property
    def outstanding(self) -> CommandFrame | None:
        """The request whose reply has not come, or not all of it."""
        return self._outstanding

    @property
    def poisoned(self) -> bool:
        """Whether a reply that was given up may still come."""
        return self._poisoned

    @property
    def pending(self) -> bytes:
        """The beginning of the outstanding reply."""
        return self._pending

    def sent(self, frame: CommandFrame) -> None:
        """Note a command; to be called just before its bytes are written.

        A command that has no reply, such as one that stops a motor, can be sent at any time and changes
        nothing here. Raises :class:`~stagewire.errors.OutstandingReplyError` for a request while
        another one is outstanding or the line is poisoned; its bytes are not to be written then.
        Raises :class:`~stagewire.errors.BadValueError` for what is no frame.
        """
        if not isinstance(frame, CommandFrame):
            raise BadValueError(f"a line carries frames of commands, not {frame!r}")
        reply = reply_to(type(frame.message))
        if reply is None:
            return
        name = frame.message.layout.message
        if self._outstanding is not None:
            raise OutstandingReplyError(
                f"{name} has to wait: the reply to {self._outstanding.message.layout.message} "
                "is outstanding, and nothing in a reply says what it answers"
            )
        if self._poisoned:
            raise OutstandingReplyError(
                f"{name} has to wait: a reply that was given up may still come; read until the line "
                "is silent and call drained()"
            )
        self._outstanding = frame
        self._length = reply.layout.length

    def feed(self, data: bytes | bytearray | memoryview) -> list[Event]:
        """Take the next bytes of the stream and return what they complete.

        What nobody asked for, or was given up, is garbage. Raises
        :class:`~stagewire.errors.BadValueError` (a ``TypeError``) for what is not bytes.
        """
        if not isinstance(data, bytes):
            if not isinstance(data, (bytearray, memoryview)):
                raise BadValueError(f"a reply decoder is fed bytes, not {type(data).__name__}")
            data = bytes(data)
        request = self._outstanding
        if request is None:
            return [Garbage(data)] if data else []
        data = self._pending + data
        if len(data) < self._length:
            self._pending = data
            return []
        self._outstanding = None
        self._pending = b""
        events: list[Event] = [ReplyReceived(data[: self._length], request)]
        if rest := data[self._length :]:
            events.append(Garbage(rest))
        return events

    def abandon(self) -> list[Event]:
        """Give up waiting for the outstanding reply: what came of it is garbage, the line poisoned.

        With nothing outstanding nothing changes.
        """
        if self._outstanding is None:
            return []
        pending = self._pending
        self._outstanding = None
        self._pending = b""
        self._poisoned = True
        return [Garbage(pending)] if pending else []

    def drained(self) -> None:
        """Say that the line was silent for so long that no reply can be on its way any more."""
        self._poisoned = False
