"""Replies: bytes without a frame, so that the one request that is outstanding says what they are.

Neither axis nor command comes back, and many replies are equally long. Whoever asks twice before the
first answer came, or goes on after one that did not come in time, takes the answer to one question for
the answer to another. So one request is outstanding at most, and a line on which a reply is overdue, or
on which bytes came that nobody asked for, is *poisoned* until it was silent for long enough. What
has no reply, such as a command that stops, can be sent at any time.
"""

from __future__ import annotations

from stagewire._codec.events import Event, Garbage, fed
from stagewire._framings.slots.command import Command, Reply, SetupCommand
from stagewire._framings.slots.frame import CommandFrame
from stagewire.errors import (
    BadLengthError,
    BadValueError,
    OutstandingReplyError,
    TrailingBytesError,
    TruncatedError,
)


def decode_reply(raw: bytes, command: type[Command | SetupCommand]) -> Reply:
    """Decode all the bytes of the reply to a command.

    Raises :class:`~stagewire.errors.TruncatedError` or
    :class:`~stagewire.errors.TrailingBytesError` for another number of bytes, and
    :class:`~stagewire.errors.BadLengthError` for a command that has no reply.
    """
    reply = command.reply
    if reply is None:
        raise BadLengthError(f"{command.layout.message} has no reply")
    length = reply.layout.length
    if len(raw) != length:
        size = len(raw)
        text = (
            f"the reply to {command.layout.message} has {length} byte{'s' if length > 1 else ''}, "
            f"here {'are' if size != 1 else 'is'} {size}"
        )
        if size < length:
            raise TruncatedError(text, range(size, size + 1))
        raise TrailingBytesError(text, range(length, size))
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
        """Whether bytes may come that belong to no outstanding request."""
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
        reply = frame.message.reply
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
                f"{name} has to wait: a reply was given up, or bytes came that nobody asked for; read "
                "until the line is silent and call drained()"
            )
        self._outstanding = frame
        self._length = reply.layout.length

    def feed(self, data: bytes | bytearray | memoryview) -> list[Event]:
        """Take the next bytes of the stream and return what they complete.

        What nobody asked for, or was given up, is garbage, and poisons the line: more of it may be on its
        way. Raises :class:`~stagewire.errors.BadValueError` (a ``TypeError``) for what is not bytes.
        """
        data = fed(data)
        request = self._outstanding
        if request is None:
            self._poisoned = self._poisoned or bool(data)
            return [Garbage(data)] if data else []
        data = self._pending + data
        if len(data) < self._length:
            self._pending = data
            return []
        self._outstanding = None
        self._pending = b""
        events: list[Event] = [ReplyReceived(data[: self._length], request)]
        if rest := data[self._length :]:
            self._poisoned = True
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
