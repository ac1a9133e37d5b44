"""Commands without a header, lines of text, and replies without frames."""

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
        """Return a framer for commands and text, which have no timeout."""
        return host_framer(self.protocol), None

    def reply_reader(self, statuses: Collection[str | None]) -> ReplyReader:
        """Return a reader that decodes replies by the commands that were written."""
        return _CommandReplyReader(self.protocol)

    def is_text(self, request: bytes) -> bool:
        """Return whether a request is a line of text; its last byte ends no command."""
        return request[-1:] in (b"\r", b"\n") and request[-1] != self.protocol.marks.terminator

    def message_name(self, raw: bytes) -> str | None:
        """Return the name of a command; replies do not contain a name."""
        command = decoded(self.protocol.decode, raw)
        return None if command is None else command.message.layout.message

    def shares(self, requests: Sequence[bytes], data: bytes, unit: Unit) -> list[Share]:
        """Assign bytes to requests, the last bytes first, as long as they suffice for whole replies.

        The reply to a line of text is a line.
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
        """Return why a message is never sent in a direction; a reply has the name of its command."""
        command: Any = self.protocol.message_class(message)
        if direction is Direction.TO_HOST and command.reply is None:
            return f"{message} has no reply"
        return None

    def _reply_length(self, raw: bytes) -> int:
        command = decoded(self.protocol.decode, raw)
        reply = None if command is None else command.message.reply
        return 0 if reply is None else reply.layout.length


class _CommandReplyReader(ReplyReader):
    """Decodes replies without frames by the commands before them.

    The commands that are written between two calls of :meth:`read` form one batch. The next batch gives up
    the commands that have not been answered by then.
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
    """Return the length of the line at the end of ``data``; 0 if there is none."""
    return len(data) - data.rfind(b"\n", 0, -1) - 1 if data.endswith(b"\n") else 0
