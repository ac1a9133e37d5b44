"""Replies: bytes without a frame, which only the outstanding request identifies.

A reply contains neither its axis nor its command, and many replies have the same length. A host that sends a
second request before the first reply, or after a reply that timed out, may match a reply to the wrong
request. Therefore at most one request is outstanding. A line on which a reply is overdue, or unexpected bytes
arrived, is *poisoned* until it was silent for long enough. Commands without a reply, such as a stop, can be
sent at any time.
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
            f"not {size}"
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
        """The decoded reply, decoded again on each access."""
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
    """A decoder of the bytes that one controller sends to the host; sans-I/O.

    The bytes of all events so far, followed by :attr:`pending`, are the bytes that were fed. No input makes
    :meth:`feed` raise.
    """

    __slots__ = ("_length", "_outstanding", "_pending", "_poisoned")

    def __init__(self) -> None:
        self._outstanding: CommandFrame | None = None
        self._length = 0
        self._pending = b""
        self._poisoned = False

    @property
    def outstanding(self) -> CommandFrame | None:
        """The request whose reply has not arrived completely."""
        return self._outstanding

    @property
    def poisoned(self) -> bool:
        """Whether bytes may arrive that do not belong to an outstanding request."""
        return self._poisoned

    @property
    def pending(self) -> bytes:
        """The beginning of the outstanding reply."""
        return self._pending

    def sent(self, frame: CommandFrame) -> None:
        """Note that a command is about to be written.

        Commands without a reply, such as a stop, change nothing and are always allowed. Raises
        :class:`~stagewire.errors.OutstandingReplyError` for a request while another one is outstanding or the
        line is poisoned; do not write it then. Raises :class:`~stagewire.errors.BadValueError` if ``frame``
        is not a :class:`.CommandFrame`.
        """
        if not isinstance(frame, CommandFrame):
            raise BadValueError(f"sent takes a CommandFrame, not {frame!r}")
        reply = frame.message.reply
        if reply is None:
            return
        name = frame.message.layout.message
        if self._outstanding is not None:
            raise OutstandingReplyError(
                f"{name} has to wait: the reply to {self._outstanding.message.layout.message} "
                "is outstanding, and a reply does not say which request it answers"
            )
        if self._poisoned:
            raise OutstandingReplyError(
                f"{name} has to wait: a reply was given up, or unexpected bytes arrived; read until "
                "the line is silent, then call drained()"
            )
        self._outstanding = frame
        self._length = reply.layout.length

    def feed(self, data: bytes | bytearray | memoryview) -> list[Event]:
        """Take the next bytes of the stream and return the events that they complete.

        Unexpected bytes, and the rest of a reply that was given up, are garbage and poison the line, because
        more of them may follow. Raises :class:`~stagewire.errors.BadValueError` (a ``TypeError``) if ``data``
        is not bytes.
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
        """Give up waiting for the outstanding reply. Return its bytes so far as garbage; poison the line.

        Without an outstanding request, do nothing.
        """
        if self._outstanding is None:
            return []
        pending = self._pending
        self._outstanding = None
        self._pending = b""
        self._poisoned = True
        return [Garbage(pending)] if pending else []

    def drained(self) -> None:
        """Note that the line was silent for so long that no late reply can arrive."""
        self._poisoned = False
