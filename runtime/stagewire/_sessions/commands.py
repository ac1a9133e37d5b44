"""The session core of controllers whose replies have no frame; no input or output.

1. **Order.** What is sent goes out in the order of the calls; one read at a time waits for its reply, since
   nothing but the request says what a reply is. Writes wait for that, too.
2. **Stops** have no reply and go out at once, before everything else.
3. **Pacing.** After a command without a reply the next one waits, except stops.
4. **Poison.** After a read that was given up, or bytes that nobody asked for, everything that comes is thrown
   away until the line was silent for a while; nothing is read before. The silence counts at least from
   when the reply would have come in the usual time.
5. **Mode.** A controller takes commands, or lines of text. Which, nobody knows before a setup command has
   said it. What it would not understand is refused before a byte is written.
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

TYPE_CHECKING = False  # typing would take half of the time of an import
if TYPE_CHECKING:
    from typing import Final

    from stagewire._sessions.command_exchanges import Mode


_LINE_END: Final = b"\n"


class CommandCore(Core):
    """A conversation with the one controller of a line.

    :param protocol: what is spoken.
    :param options: times.
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
        """What the controller takes now, as far as this session has told it."""
        self._refuse_prefix_bytes = refuse_prefix_bytes
        self._replies = protocol.replies()
        self._text = b""  # of a line of text that has not ended
        self._stops: deque[CommandExchange] = deque()
        self._queue: deque[CommandExchange] = deque()
        self._outstanding: CommandExchange | None = None
        self._free_at = 0.0  # by pacing
        self._owed = 0  # bytes of the reply to a read that was given up
        self._owed_until = 0.0  # until when they come in the usual time
        self._drained_at = inf  # when it will have been silent for long enough; inf: it is clean

    # What users ask for

    def ask(self, message: Command, axis: int, timeout: float, now: float) -> Exchange:
        """Send a command that is answered; it ends with its reply, or a timeout.

        Raises :class:`~stagewire.errors.WrongModeError` unless the controller takes commands;
        :class:`~stagewire.errors.BadValueError` for a command that nothing answers; and
        :class:`~stagewire.errors.OutOfRangeError` for an axis or a timeout that is none, or a value that is
        refused for its bytes.
        """
        if message.reply is None:
            raise BadValueError(f"{message.layout.message} has no reply; it is sent, and not asked")
        return self._append(message, axis, timeout, now)

    def send(
        self, message: Command | SetupCommand, axis: int | None, timeout: float, now: float
    ) -> Exchange:
        """Send a command that nothing answers; it ends when it is handed out, within the time.

        :param axis: None for a setup command, which is for the whole controller and is taken in any mode.

        Raises as :meth:`ask` does, for a command that is answered.
        """
        if message.reply is not None:
            raise BadValueError(f"{message.layout.message} has a reply; it is asked, and not sent")
        return self._append(message, axis, timeout, now)

    def halt(self, message: Command, axis: int, timeout: float, now: float) -> Exchange:
        """Send a stop, before everything else, even while a reply is awaited, and in any mode.

        Where the controller may take text, it is brought to take commands, and back if it is known to
        take text. Raises as :meth:`send` does, but for the mode.
        """
        if message.reply is not None:
            raise BadValueError(
                f"{message.layout.message} has a reply, and cannot go before others"
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
        """Send a line of text, without its end; it ends with the line that answers it, without its end.

        Raises :class:`~stagewire.errors.WrongModeError` unless the controller takes text, and
        :class:`~stagewire.errors.BadValueError` for what is no line of printable ASCII.
        """
        if (
            not isinstance(line, str)
            or not line.isascii()
            or not line.isprintable()
            or not 0 < len(line) < LONGEST_LINE
        ):
            raise BadValueError(
                f"a line of text has 1 to {LONGEST_LINE - 1} printable ASCII characters: {line!r}"
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

    # The driver's side

    @property
    def has_understood(self) -> bool:
        """Whether a reply has come."""
        return self.statistics.matched > 0

    @property
    def silent_at(self) -> float:
        """When the line is clean, if it is silent until then; see :attr:`.Core.silent_at`."""
        return inf if self._failure is not None else self._drained_at

    def receive(self, data: bytes, now: float) -> None:
        """Take bytes that came, in chunks of any size; see :meth:`.Core.receive`."""
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
            log.debug("nobody asked for %s", data.hex(" "))
            self._dispatcher.tell(Garbage(data))

    def _take_reply(self, line: CommandExchange, data: bytes) -> bytes:
        """Take what belongs to the reply; return the rest."""
        rest = b""
        for event in self._replies.feed(data):
            if isinstance(event, ReplyReceived):
                self._answered(line, event.reply)
            else:
                rest = event.raw
        return rest

    def _take_text(self, line: CommandExchange, data: bytes) -> bytes:
        """Take what belongs to the line of text; return the rest, or what is too long for one."""
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
        """Return everything that is to be written now; see :meth:`.Core.output`."""
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
                check_mode(line, self.mode)  # the switch before it may not have been sent
            except WrongModeError as error:
                line.end(error=error)
            else:
                parts.append(self._hand_out(line, now))
        return b"".join(parts)

    def _hand_out(self, line: CommandExchange, now: float) -> bytes:
        """Return the bytes of what is written now, and wait for its reply if it has one."""
        self.mode = line.mode_after(self.mode)
        if line.is_answered:
            self._outstanding = line
            line.sent_at = now
            if line.frame is not None:
                self._replies.sent(line.frame)
            return line.hand_out()
        self._free_at = now + self.options.pacing
        raw = line.hand_out()
        line.end()
        return raw

    def tick(self, now: float) -> None:
        """See to what is due: deadlines."""
        if now < self._next or self._failure is not None:
            return
        for line in [line for line in self._waiting() if line.deadline <= now]:
            self.statistics.timed_out += 1
            self._give_up(line, ReplyTimeoutError(self._timed_out(line)), now)
        self._ready = True  # what may be written now is seen by output
        self._next = inf
        for line in self._waiting():
            self._at(line.deadline)

    def cancel(self, exchange: Exchange, now: float) -> None:
        """Give up an exchange, because nobody waits for it any more; see :meth:`.Core.cancel`."""
        if exchange.done:
            return
        assert isinstance(exchange, CommandExchange)
        self._give_up(exchange, self._cancelled(exchange), now)

    # The end of exchanges

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
        elif line in self._queue:  # and no stop, which is written all the same
            self._queue.remove(line)
        line.end(error=error)

    def _timed_out(self, line: CommandExchange) -> str:
        within = f"within {round(line.timeout, 3):g} s"
        if not line.written:
            poisoned = self._drained_at != inf
            why = "the line had not been silent since" if poisoned else "others came before it"
            return f"{line.name} was not sent {within}: {why}; give it more time, or ask for less at once"
        came = self._text or self._replies.pending
        shown = f"but {came.hex(' ')}" if came else "and nothing else"
        return (
            f"{line.name} ({line.raw.hex(' ')}) was sent, and no whole reply came {within}, {shown}; see "
            "that the controller is on, has this axis, and talks at this baud rate, then ask again"
        )
