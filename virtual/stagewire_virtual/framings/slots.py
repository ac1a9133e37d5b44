"""Commands of slots without a header, and lines of text; replies without a frame."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Any

from stagewire.framing import Event, HostListener, ReplyListener, host_framer
from stagewire.protocols import CommandProtocol, Direction
from stagewire_virtual.framings.framing import (
    Abandon,
    Framing,
    ReplyReader,
    Share,
    StreamFramer,
    decoded,
)
from stagewire_virtual.instrument import Unit


class SlotsFraming(Framing):
    """The framing of a protocol of commands without a header."""

    protocol: CommandProtocol
    replies_are_named_by_requests = True

    def request_framer(self) -> tuple[StreamFramer, Abandon | None]:
        """Return a framer of commands and text; both are waited for until their end."""
        return host_framer(self.protocol), None

    def reply_reader(self, statuses: Collection[str | None]) -> ReplyReader:
        """Return a reader that knows the replies by the commands that were written."""
        return _CommandReplyReader(self.protocol)

    def is_text(self, request: bytes) -> bool:
        """Say whether a request is a line of text, which ends as no command does."""
        return request[-1:] in (b"\r", b"\n") and request[-1] != self.protocol.marks.terminator

    def message_name(self, raw: bytes) -> str | None:
        """Return the name of a command; a reply does not say what it is."""
        command = decoded(self.protocol.decode, raw)
        return None if command is None else command.message.layout.message

    def shares(self, requests: Sequence[bytes], data: bytes, unit: Unit) -> list[Share]:
        """Share bytes without a frame out, the last first, as far as they suffice for whole replies.

        A line of text is answered by a line.
        """
        found: list[Share] = []
        size = len(data)
        for index in reversed(range(len(requests))):
            request = requests[index]
            if self.is_text(request):
                length = _last_line(data[:size]) if request.strip() else 0
            else:
                length = self._reply_length(request)
            if length > size:
                break
            found.append((length, index))
            size -= length
        return [*found, (size, len(requests) - 1)]

    def never_passes(self, unit: Unit, message: str, direction: Direction | None) -> str | None:
        """Return why a message never passes; a reply is named by its command."""
        command: Any = self.protocol.message_class(message)
        if direction is Direction.TO_HOST and command.reply is None:
            return f"{message} has no reply"
        return None

    def _reply_length(self, raw: bytes) -> int:
        command = decoded(self.protocol.decode, raw)
        reply = None if command is None else command.message.reply
        return 0 if reply is None else reply.layout.length


class _CommandReplyReader(ReplyReader):
    """Replies without a frame, which are cut by the requests before them.

    All that is written before the next reading is asked at once; who asks after a reading has given up what
    has not been answered by then.
    """

    def __init__(self, protocol: CommandProtocol) -> None:
        self._replies = ReplyListener()
        self._asking = HostListener(protocol, self._replies)
        self._has_asked = False

    def wrote(self, data: bytes) -> None:
        self._asking.feed(data, goes_on=self._has_asked)
        self._has_asked = True

    def read(self, data: bytes) -> list[Event]:
        self._has_asked = False
        return self._replies.feed(data)


def _last_line(data: bytes) -> int:
    """Return the length of the line that bytes end with, 0 for none."""
    return len(data) - data.rfind(b"\n", 0, -1) - 1 if data.endswith(b"\n") else 0
