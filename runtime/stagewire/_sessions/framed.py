"""The session core for controllers whose messages have frames; sans-I/O.

1. **Order.** Messages to one address are sent in the order of the calls. One request at a time waits for its
   reply there. Addresses do not wait for each other.
2. **Stops** are sent immediately, before everything else. Keep-alive messages that are due come next.
3. **Pacing.** After a frame without a reply, the next one to that address waits, except stops and keep-alive
   messages.
4. **Replies** are matched by :mod:`~stagewire._sessions.matching`; late ones by
   :mod:`~stagewire._sessions.requests`; the ends of motions by :mod:`~stagewire._sessions.motions`.
5. **Dispatch.** A message that answers no request goes to the subscriptions. So does a reply that is also
   sent unsolicited, such as a status.
6. **Deadlines** count from the call, so they include all waiting before a request is sent.
7. **Half frames.** If the rest of a frame does not arrive, it is given up after a silence
   (:meth:`.Framer.abandon`). Until then, nothing that has a reply or an end is written, because its answer
   would be taken for the rest of the frame. Stops are written.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from math import inf

from stagewire._codec.events import Event
from stagewire._framings.header.frame import Received, Undocumented
from stagewire._framings.header.message import FramedMessage
from stagewire._framings.header.protocol import FramedProtocol
from stagewire._sessions.core import Core, all_is_read, log
from stagewire._sessions.dispatch import Dispatcher
from stagewire._sessions.error_texts import ErrorTexts
from stagewire._sessions.exchange import Exchange, deadline_of
from stagewire._sessions.framed_exchanges import Ask, FramedExchange, Halt, Motion, Send
from stagewire._sessions.matching import Matching
from stagewire._sessions.motions import Motions
from stagewire._sessions.options import Ends, SessionOptions
from stagewire._sessions.receiver import Receiver
from stagewire._sessions.requests import Requests
from stagewire._sessions.send_queue import KeepAlive, SendQueue
from stagewire.errors import MotionStoppedError, StagewireError, UnsupportedError


class FramedCore(Core):
    """A conversation with the controllers of one line.

    :param protocol: the protocol of the line.
    :param options: timeouts and pauses.
    """

    def __init__(self, protocol: FramedProtocol, *, options: SessionOptions | None = None) -> None:
        super().__init__(options)
        self.protocol = protocol
        self._host = protocol.host
        self._faults = protocol.faults
        self._table = protocol.framing
        self._receiver = Receiver(protocol, self.statistics, self.options.silence)
        self.counts = self._receiver.counts
        """Message -> how many of it were received."""
        self._taken = 0  # bytes of all events so far
        self._matching = Matching(protocol)
        quiet = self.options.quiet
        self._requests = Requests(self._matching, self.statistics, quiet)
        self._send_queue = SendQueue(self._requests, self.options.pacing)
        self._motions = Motions(self._matching, self.statistics, quiet)
        self._error_texts = ErrorTexts(protocol, self._receiver)
        self._alive = KeepAlive()
        self._halts: list[Halt] = []  # written before everything else
        self._dispatcher = Dispatcher(self.statistics, self._matching.source_of)

    def _packed(self, message: FramedMessage, dest: int) -> bytes:
        """Return the frame of a message to send."""
        layout = message.layout
        if layout.not_sent:
            raise UnsupportedError(f"{layout.message} is not sent: {layout.not_sent}")
        return message.pack(dest, self._host)

    # Calls of users

    def ask(
        self,
        message: FramedMessage,
        replies: tuple[type[FramedMessage], ...],
        dest: int,
        timeout: float,
        now: float,
    ) -> Exchange:
        """Send a request that one of ``replies`` answers. It ends with the frame of the reply, or a timeout.

        Raises :class:`~stagewire.errors.OutOfRangeError` for an invalid address or timeout, and
        :class:`~stagewire.errors.UnsupportedError` for a message that must not be sent.
        """
        raw = self._packed(message, dest)
        matching = self._matching
        ids, selected = matching.ids_of(replies), matching.selected(message, replies)
        ask = Ask(message, raw, timeout, deadline_of(timeout, now), dest, ids, selected)
        self._queue(ask)
        return ask

    def send(self, message: FramedMessage, dest: int, timeout: float, now: float) -> Exchange:
        """Send a message that has no reply. The exchange ends when its bytes are handed out.

        Raises the errors of :meth:`ask`.
        """
        raw = self._packed(message, dest)
        send = Send(message, raw, timeout, deadline_of(timeout, now), dest, frozenset())
        self._queue(send)
        return send

    def begin(
        self, message: FramedMessage, ends: Ends, dest: int, timeout: float, now: float
    ) -> Exchange:
        """Begin a motion. It ends with the frame that reports its end, or when handed out if none does.

        Raises :class:`~stagewire.errors.MotionUnderWayError` if a motion on that channel is or may be in
        progress, and the errors of :meth:`ask`.
        """
        raw = self._packed(message, dest)
        channel = self._matching.channel_of(message)
        completed, stopped = map(self._matching.ids_of, (ends.completed, ends.stopped))
        deadline = deadline_of(timeout, now)
        motion = Motion(message, raw, timeout, deadline, dest, completed, stopped, channel)
        if self._failure is None:
            self._motions.check(dest, channel, motion.name)
            self._motions.plan(motion)
        self._queue(motion)
        return motion

    def halt(
        self, message: FramedMessage, ends: Ends | None, dest: int, timeout: float, now: float
    ) -> Exchange:
        """Stop a motion, before everything else. The exchange ends with the frame that reports the stop.

        Without ``ends`` it ends when its bytes are handed out. A motion of that channel that was not written
        yet will not be. One that was ends with a :class:`~stagewire.errors.MotionStoppedError` when the stop
        is reported.

        Raises the errors of :meth:`ask`.
        """
        raw = self._packed(message, dest)
        ends = ends or Ends()
        channel, ids = self._matching.channel_of(message), self._matching.ids_of(ends.completed)
        halt = Halt(message, raw, timeout, deadline_of(timeout, now), dest, ids, channel)
        if self._refuse(halt):
            return halt
        self._halts.append(halt)
        self._ready = True
        motion = self._motions.planned(halt)
        if motion is not None:
            self._unqueue(motion)
            text = f"{motion.name} was stopped before it was sent; nothing was sent"
            motion.end(error=MotionStoppedError(text))
        self._at(halt.deadline)
        return halt

    def settled(self, dest: int, channel: int | None) -> None:
        """Note that a status shows no motion after one was given up, so that another may begin."""
        self._motions.settled(dest, channel)

    def keep_alive(
        self, message: FramedMessage | None, addresses: tuple[int, ...], period: float = 0.5
    ) -> None:
        """Send a keep-alive message to each address, now and every ``period`` seconds; keep other addresses.

        :param message: the keep-alive message; None: stop sending to these addresses, or to all if
            ``addresses`` is empty.

        Raises :class:`~stagewire.errors.OutOfRangeError` for an invalid address or period.
        """
        self._alive.set(
            {dest: self._packed(message, dest) if message else b"" for dest in addresses}, period
        )
        if self._failure is None:
            self._at(self._alive.next)

    def tell(self, source: int, **context: str) -> None:
        """Set the context that selects layouts of messages from ``source``; see :meth:`.Framer.tell`."""
        self._receiver.tell(source, **context)

    # Calls of the driver

    @property
    def has_understood(self) -> bool:
        """Whether a message has been received."""
        return bool(self.counts)

    @property
    def silent_at(self) -> float:
        """When an incomplete frame is given up; see :attr:`.Core.silent_at`."""
        return inf if self._failure is not None else self._receiver.silent_at

    def receive(self, data: bytes, now: float) -> None:
        """Process received bytes, in chunks of any size; see :meth:`.Core.receive`."""
        if self._failure is not None:
            return
        self._was_read()
        hearing = self._receiver
        was_within_a_frame = hearing.is_within_a_frame
        self._take(hearing.feed(data, now), now)
        if was_within_a_frame and not hearing.is_within_a_frame:
            self._ready = True  # exchanges that waited for the end of the frame may be sent

    def output(self, now: float, has_unread: Callable[[], bool] = all_is_read) -> bytes:
        """Return the bytes to write now; see :meth:`.Core.output`."""
        if now >= self._next:
            self.tick(now)
        if not self._ready:
            return b""
        self._ready = False
        parts: list[bytes] = []
        if self._halts:
            halts, self._halts = self._halts, []
            for halt in halts:
                parts.append(self._hand_out(halt, now))
        if now >= self._alive.next:
            parts.append(self._alive.take(now))
            self._at(self._alive.next)

        def write(frame: FramedExchange) -> None:
            parts.append(self._hand_out(frame, now))

        def may_ask() -> bool:
            if has_unread():
                self.waits_for_reader = True
                return False
            return not self._receiver.is_within_a_frame

        self._at(self._send_queue.take(now, write, may_ask))
        return b"".join(parts)

    def wrote(self, now: float) -> None:
        """Begin the pauses after the bytes of the last output now; see :meth:`.Core.wrote`."""
        self._send_queue.wrote(now)

    def tick(self, now: float) -> None:
        """Process deadlines and quiet periods that have passed."""
        if now < self._next or self._failure is not None:
            return
        for exchange in [exchange for exchange in self._waiting() if exchange.deadline <= now]:
            self.statistics.timed_out += 1
            why = self._error_texts.timeout(exchange, self._kept_by(exchange))
            self._give_up(exchange, why, now)
        self._requests.forgive(now)
        self._motions.forgive(now)
        self._ready = True  # output finds out what may be written now
        self._next = min(self._requests.next, self._motions.next)
        if self._alive.next > now:
            self._at(self._alive.next)
        for exchange in self._waiting():
            self._at(exchange.deadline)

    def cancel(self, exchange: Exchange, now: float) -> None:
        """Give up an exchange whose caller no longer waits; see :meth:`.Core.cancel`."""
        if exchange.done:
            return
        assert isinstance(exchange, FramedExchange)
        self._give_up(exchange, self._cancelled(exchange), now)

    # Writing

    def _queue(self, exchange: FramedExchange) -> None:
        """Queue an exchange to be written as soon as it may be."""
        if self._refuse(exchange):
            return
        self._send_queue.add(exchange)
        self._ready = True
        self._at(exchange.deadline)

    def _unqueue(self, exchange: FramedExchange) -> None:
        """Remove an exchange that was not written."""
        if isinstance(exchange, Motion):
            self._motions.unplan(exchange)
        if not isinstance(exchange, Halt):  # a stop is still written
            self._send_queue.remove(exchange)

    def _hand_out(self, exchange: FramedExchange, now: float) -> bytes:
        """Return the bytes of an exchange that is written now, and wait for its reply or end."""
        exchange.after = self._receiver.heard
        exchange.seen = self._receiver.seen()
        raw = exchange.hand_out()
        if isinstance(exchange, Ask):
            self._requests.sent(exchange)
            return raw
        self._send_queue.pace(exchange.dest, now)
        if exchange.ids and isinstance(exchange, Motion):
            self._motions.begun(exchange)
        elif exchange.ids and isinstance(exchange, Halt):
            self._motions.halting(exchange, now)
            self._at(self._motions.next)
        else:
            if isinstance(exchange, Motion):
                self._motions.unplan(exchange)
            exchange.end()
        return raw

    def _kept_by(self, exchange: FramedExchange) -> str:
        """Return the reason why an exchange was not written, for people."""
        if isinstance(exchange, Ask) and self._requests.is_poisoned(exchange):
            return "a late reply to an earlier request could still have arrived"
        if self._receiver.is_within_a_frame:
            return (
                "bytes that are not whole messages kept arriving (wrong baud rate, or another kind of "
                "controller?)"
            )
        if self.waits_for_reader:
            return "this program did not read the bytes that had arrived before"
        return "other exchanges came first"

    # Receiving

    def _take(self, events: list[Event], now: float) -> None:
        """Give each event to the exchange that waits for it, or to the subscriptions."""
        counts, wanting = self.counts, self._dispatcher.wanting
        requests, motions = self._requests.awaited, self._motions.awaited
        shared = self._table.shared
        for event in events:
            event.received = now
            raw = event.raw
            began = self._taken
            self._taken = began + len(raw)
            if event.__class__ is not Received:
                self._receiver.count_odd(event)
            if not isinstance(event, (Received, Undocumented)):
                log.debug("unknown message: %r", event)
                self._dispatcher.tell(event)
                continue
            id = raw[0] | raw[1] << 8
            if id in shared:
                id = self._table.key_of(raw)
            counts[id] = counts.get(id, 0) + 1
            if id in requests:
                self._ready = True  # the next request may be sent
                if self._requests.answer(id, event, began):
                    continue
            if id in motions:
                self._motions.end(id, event, began, now)
                self._at(self._motions.next)
            if id in self._faults:
                self._take_fault(id, event, began)
            for subscription in wanting(id):
                subscription.put(event)

    def _take_fault(self, id: int, event: Received | Undocumented, began: int) -> None:
        """End the wait for the motions that a fault report concerns."""
        fault = self._faults[id].read(event.raw)
        self._receiver.faults[id] = fault
        for motion in self._motions.faulted(event, fault, began):
            motion.end(error=self._error_texts.fault(motion, event, fault))

    # Ends of exchanges

    def _waiting(self) -> Iterator[FramedExchange]:
        yield from (halt for halt in self._halts if not halt.done)
        yield from self._send_queue.waiting()
        yield from self._requests.outstanding.values()
        yield from self._motions.waiting()

    def _give_up(self, exchange: FramedExchange, error: StagewireError, now: float) -> None:
        if not exchange.written:
            self._unqueue(exchange)
        elif isinstance(exchange, Ask):
            self._requests.give_up(exchange, now)
            self._at(exchange.until)
        elif isinstance(exchange, Halt):
            self._motions.give_up(exchange, now)
            self._at(exchange.until)
        exchange.end(error=error)
