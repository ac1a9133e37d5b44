"""The session core for controllers whose replies have no frame; sans-I/O.

1. **Order.** Exchanges are sent in the order of the calls. One read at a time waits for its reply, because
   only the request identifies a reply. Writes also wait for that reply.
2. **Stops** have no reply. They are sent immediately, before everything else.
3. **Pacing.** After a command without a reply, the next one waits, except stops.
4. **Poison.** After a read that was given up, or unexpected bytes, all input is discarded until the line has
   been silent for a while. No read is sent before. The silence is counted from the time by which the reply
   would usually have arrived, or later.
5. **Mode.** A controller accepts either commands or lines of text. The mode is unknown until a setup command
   has set it. An exchange that requires another mode is refused before a byte is written.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from math import inf

from stagewire._codec.events import Garbage
from stagewire._framings.slots.command import Command, SetupCommand
from stagewire._framings.slots.frame import CommandFrame
from stagewire._framings.slots.protocol import CommandProtocol
from stagewire._framings.slots.replies import ReplyReceived
from stagewire._framings.slots.streams import LONGEST_LINE
from stagewire._sessions.command_exchanges import CommandExchange, check_mode, in_low_level
from stagewire._sessions.core import Core, all_is_read, log
from stagewire._sessions.exchange import Exchange, deadline_of
from stagewire._sessions.options import SessionOptions
from stagewire.errors import BadValueError, ReplyTimeoutError, StagewireError, WrongModeError

TYPE_CHECKING = False  # importing typing would double the import time
if TYPE_CHECKING:
    from typing import Final

    from stagewire._sessions.command_exchanges import Mode


_LINE_END: Final = b"\n"


class CommandCore(Core):
    """A conversation with the single controller of a line.

    :param protocol: the protocol of the line.
    :param options: timeouts and pauses.
    :param refuse_prefix_bytes: refuse values whose bytes a controller might take for a setup command; see
        :meth:`.CommandFrame.encode`.
    """

    def __init__(
        self,
        protocol: CommandProtocol,
        *,
        options: SessionOptions | None = None,
        refuse_prefix_bytes: bool = False,
    ) -> None:
        super().__init__(options)
        self.protocol = protocol
        self.mode: Mode = "unknown"
        """The mode of the controller, as far as this session has set it."""
        self._refuse_prefix_bytes = refuse_prefix_bytes
        self._replies = protocol.replies()
        self._text = b""  # of a line of text that has not ended
        self._stops: deque[CommandExchange] = deque()
        self._queue: deque[CommandExchange] = deque()
        self._outstanding: CommandExchange | None = None
        self._free_at = 0.0  # end of the pacing
        self._paces = False  # the last output begins a pause
        self._owed = 0  # missing bytes of the reply to an abandoned read
        self._owed_until = 0.0  # end of the usual time for them
        self._drained_at = inf  # when the silence is long enough; inf: the line is clean

    # Calls of users

    def ask(self, message: Command, axis: int, timeout: float, now: float) -> Exchange:
        """Send a command that has a reply. The exchange ends with the reply or a timeout.

        Raises :class:`~stagewire.errors.WrongModeError` unless the controller accepts commands;
        :class:`~stagewire.errors.BadValueError` for a command without a reply; and
        :class:`~stagewire.errors.OutOfRangeError` for an invalid axis or timeout, or a value refused for its
        bytes.
        """
        if message.reply is None:
            raise BadValueError(f"{message.layout.message} has no reply: use send instead of ask")
        return self._append(message, axis, timeout, now)

    def send(
        self, message: Command | SetupCommand, axis: int | None, timeout: float, now: float
    ) -> Exchange:
        """Send a command that has no reply. The exchange ends when its bytes are handed out.

        :param axis: None for a setup command, which is for the whole controller and valid in any mode.

        Raises the errors of :meth:`ask`, but :class:`~stagewire.errors.BadValueError` for a command with a
        reply.
        """
        if message.reply is not None:
            raise BadValueError(f"{message.layout.message} has a reply: use ask instead of send")
        return self._append(message, axis, timeout, now)

    def halt(self, message: Command, axis: int, timeout: float, now: float) -> Exchange:
        """Send a stop before everything else, even while a reply is awaited, and in any mode.

        If the controller may be accepting text, it is switched to commands first, and back afterwards if it
        is known to accept text. Raises the errors of :meth:`send`, except for the mode.
        """
        if message.reply is not None:
            raise BadValueError(
                f"{message.layout.message} has a reply, so it cannot be sent ahead of others"
            )
        frame = CommandFrame(message, axis)
        raw = in_low_level(self.protocol, frame.encode(), self.mode)
        line = self._line(frame, "", raw, timeout, now)
        if not self._refuse(line):
            self._stops.append(line)
            self._ready = True
            if self.mode == "unknown":
                self.mode = "low_level"
        return line

    def text(self, line: str, timeout: float, now: float) -> Exchange:
        """Send a line of text. The exchange ends with the line of the reply. Both are without line ends.

        Raises :class:`~stagewire.errors.WrongModeError` unless the controller accepts text, and
        :class:`~stagewire.errors.BadValueError` if ``line`` is not a line of printable ASCII.
        """
        if (
            not isinstance(line, str)
            or not line.isascii()
            or not line.isprintable()
            or not 0 < len(line) < LONGEST_LINE
        ):
            raise BadValueError(
                f"a line of text has 1 to {LONGEST_LINE - 1} printable ASCII characters, not {line!r}"
            )
        return self._wait_in_line(
            self._line(None, line, line.encode("ascii") + b"\r", timeout, now)
        )

    def _append(
        self, message: Command | SetupCommand, axis: int | None, timeout: float, now: float
    ) -> Exchange:
        frame = CommandFrame(message, axis)
        raw = frame.encode(refuse_prefix_bytes=self._refuse_prefix_bytes)
        return self._wait_in_line(self._line(frame, "", raw, timeout, now))

    def _line(
        self, frame: CommandFrame | None, text: str, raw: bytes, timeout: float, now: float
    ) -> CommandExchange:
        return CommandExchange(frame, text, raw, timeout, deadline_of(timeout, now))

    def _wait_in_line(self, line: CommandExchange) -> Exchange:
        mode = self.mode
        for earlier in self._queue:
            mode = earlier.mode_after(mode)
        if not self._refuse(line):
            check_mode(line, mode)
            self._queue.append(line)
            self._ready = True
            self._at(line.deadline)
        return line

    # Calls of the driver

    @property
    def has_understood(self) -> bool:
        """Whether a reply has been received."""
        return self.statistics.matched > 0

    @property
    def silent_at(self) -> float:
        """When the line is clean, provided that it stays silent; see :attr:`.Core.silent_at`."""
        return inf if self._failure is not None else self._drained_at

    def receive(self, data: bytes, now: float) -> None:
        """Process received bytes, in chunks of any size; see :meth:`.Core.receive`."""
        if self._failure is not None:
            return
        self._was_read()
        if not data:
            if now >= self._drained_at:
                self._drained_at = inf
                self._replies.drained()
                self._ready = True
            return
        line = self._outstanding
        if line is not None and line.frame is None:
            data = self._take_text(line, data)
        elif line is not None:
            data = self._take_reply(line, data)
        if data:
            self.statistics.garbage += len(data)
            self._owed -= len(data)
            since = now if self._owed <= 0 else max(now, self._owed_until)  # it may be noise
            self._drained_at = since + self.options.drain
            log.debug("unexpected bytes: %s", data.hex(" "))
            garbage = Garbage(data)
            garbage.received = now
            self._dispatcher.tell(garbage)

    def _take_reply(self, line: CommandExchange, data: bytes) -> bytes:
        """Take the bytes of the reply, and return the rest."""
        rest = b""
        for event in self._replies.feed(data):
            if isinstance(event, ReplyReceived):
                self._answered(line, event.reply)
            else:
                rest = event.raw
        return rest

    def _take_text(self, line: CommandExchange, data: bytes) -> bytes:
        """Take the bytes of the line of text, and return the rest, or the excess of a long line."""
        found, end, rest = (self._text + data).partition(_LINE_END)
        if end:
            self._text = b""
            self._answered(line, found.rstrip(b"\r").decode("latin-1"))
            return rest
        self._text = found[-LONGEST_LINE:]
        return found[:-LONGEST_LINE]

    def _answered(self, line: CommandExchange, result: object) -> None:
        self._outstanding = None
        self._ready = True
        self.statistics.matched += 1
        line.end(result)

    def output(self, now: float, has_unread: Callable[[], bool] = all_is_read) -> bytes:
        """Return the bytes to write now; see :meth:`.Core.output`."""
        if now >= self._next:
            self.tick(now)
        if not self._ready:
            return b""
        self._ready = False
        parts: list[bytes] = []
        while self._stops:
            parts.append(self._hand_out(self._stops.popleft(), now))
        while self._queue and self._outstanding is None:
            line = self._queue[0]
            if now < self._free_at:
                self._at(self._free_at)
                break
            if line.is_answered:
                if self._drained_at != inf:
                    break
                if has_unread():
                    self.waits_for_reader = True
                    break
            self._queue.popleft()
            try:
                check_mode(line, self.mode)  # the switch may not have been sent
            except WrongModeError as error:
                line.end(error=error)
            else:
                parts.append(self._hand_out(line, now))
        return b"".join(parts)

    def _hand_out(self, line: CommandExchange, now: float) -> bytes:
        """Return the bytes of an exchange that is written now, and wait for its reply if it has one."""
        self.mode = line.mode_after(self.mode)
        if line.is_answered:
            self._outstanding = line
            line.sent_at = now
            if line.frame is not None:
                self._replies.sent(line.frame)
            return line.hand_out()
        self._free_at = now + self.options.pacing
        self._paces = True
        raw = line.hand_out()
        line.end()
        return raw

    def wrote(self, now: float) -> None:
        """Begin the pause after the bytes of the last output now; see :meth:`.Core.wrote`."""
        if self._paces:
            self._paces = False
            self._free_at = now + self.options.pacing

    def tick(self, now: float) -> None:
        """Process deadlines that have passed."""
        if now < self._next or self._failure is not None:
            return
        for line in [line for line in self._waiting() if line.deadline <= now]:
            self.statistics.timed_out += 1
            self._give_up(line, ReplyTimeoutError(self._timed_out(line)), now)
        self._ready = True  # output finds out what may be written now
        self._next = inf
        for line in self._waiting():
            self._at(line.deadline)

    def cancel(self, exchange: Exchange, now: float) -> None:
        """Give up an exchange whose caller no longer waits; see :meth:`.Core.cancel`."""
        if exchange.done:
            return
        assert isinstance(exchange, CommandExchange)
        self._give_up(exchange, self._cancelled(exchange), now)

    # Ends of exchanges

    def _waiting(self) -> Iterator[CommandExchange]:
        yield from (stop for stop in self._stops if not stop.done)
        yield from self._queue
        if self._outstanding is not None:
            yield self._outstanding

    def _give_up(self, line: CommandExchange, error: StagewireError, now: float) -> None:
        if line is self._outstanding:
            pending = len(self._text) + sum(len(event.raw) for event in self._replies.abandon())
            self.statistics.garbage += pending
            self._text = b""
            self._outstanding = None
            reply = None if line.frame is None else line.frame.message.reply
            self._owed = 1 if reply is None else reply.layout.length - pending
            self._owed_until = line.sent_at + self.options.reply_timeout
            self._drained_at = max(now, self._owed_until) + self.options.drain
        elif line in self._queue:  # a stop is still written
            self._queue.remove(line)
        line.end(error=error)

    def _timed_out(self, line: CommandExchange) -> str:
        within = f"within {round(line.timeout, 3):g} s"
        if not line.written:
            poisoned = self._drained_at != inf
            why = (
                "the line was not silent for long enough"
                if poisoned
                else "other exchanges came first"
            )
            return f"{line.name} was not sent {within}: {why}; allow more time, or send fewer at a time"
        came = self._text or self._replies.pending
        shown = f"received only {came.hex(' ')}" if came else "received nothing"
        return (
            f"{line.name} ({line.raw.hex(' ')}) was sent, but no complete reply arrived {within} ({shown}); "
            "check that the controller is on, has this axis and uses this baud rate, then send the request "
            "again"
        )
