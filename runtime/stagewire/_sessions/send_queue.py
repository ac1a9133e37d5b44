"""Messages to be sent, by address: order, pacing, waiting requests; and keep-alive messages."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Mapping
from math import inf

from stagewire._sessions.framed_exchanges import Ask, FramedExchange
from stagewire._sessions.requests import Requests
from stagewire.errors import OutOfRangeError


class _Lane:
    """The exchanges waiting to be sent to one address."""

    __slots__ = ("free_at", "queue")

    def __init__(self) -> None:
        self.queue: deque[FramedExchange] = deque()
        self.free_at = 0.0  # end of the pacing


class SendQueue:
    """The exchanges of one line that wait to be written.

    :param requests: decides which requests have to wait.
    :param pacing: seconds of pause after a frame without a reply.
    """

    def __init__(self, requests: Requests, pacing: float) -> None:
        self._requests = requests
        self._pacing = pacing
        self._lanes: dict[int, _Lane] = {}
        self._busy: dict[int, _Lane] = {}  # lanes with waiting exchanges
        self._paced: set[_Lane] = set()  # lanes in which the last output begins a pause

    def add(self, exchange: FramedExchange) -> None:
        """Add an exchange to the end of the queue."""
        dest = exchange.dest
        lane = self._lanes.get(dest)
        if lane is None:
            lane = self._lanes[dest] = _Lane()
        lane.queue.append(exchange)
        self._busy[dest] = lane

    def remove(self, exchange: FramedExchange) -> None:
        """Remove an exchange that was not written."""
        self._lanes[exchange.dest].queue.remove(exchange)

    def pace(self, dest: int, now: float) -> None:
        """Note that a frame without a reply is written now."""
        lane = self._lanes.setdefault(dest, _Lane())
        lane.free_at = now + self._pacing
        self._paced.add(lane)

    def wrote(self, now: float) -> None:
        """Begin the pauses after the frames of the last output now."""
        for lane in self._paced:
            lane.free_at = now + self._pacing
        self._paced.clear()

    def take(
        self, now: float, write: Callable[[FramedExchange], object], may_ask: Callable[[], bool]
    ) -> float:
        """Write the exchanges that may be written now; return when the next pacing ends.

        :param may_ask: returns whether all received bytes were processed; if not, no request is written.
        """
        paced_until = inf
        for dest, lane in tuple(self._busy.items()):
            self._empty(lane, now, write, may_ask)
            if not lane.queue:
                del self._busy[dest]
            elif now < lane.free_at:
                paced_until = min(paced_until, lane.free_at)
        return paced_until

    def _empty(
        self,
        lane: _Lane,
        now: float,
        write: Callable[[FramedExchange], object],
        may_ask: Callable[[], bool],
    ) -> None:
        queue, requests = lane.queue, self._requests
        held: list[FramedExchange] = []
        while queue and lane.free_at <= now:
            exchange = queue[0]
            if exchange.ids and not may_ask():
                break
            if isinstance(exchange, Ask):
                if not requests.may_be_sent(exchange):
                    break
                if requests.is_poisoned(exchange):  # later ones may be sent
                    held.append(queue.popleft())
                    continue
            queue.popleft()
            write(exchange)
        queue.extendleft(reversed(held))

    def waiting(self) -> Iterator[FramedExchange]:
        """Yield all waiting exchanges."""
        for lane in self._busy.values():
            yield from lane.queue


class KeepAlive:
    """Messages that are sent periodically, whatever else happens."""

    __slots__ = ("_period", "_signs", "next")

    def __init__(self) -> None:
        self._signs: dict[int, bytes] = {}
        self._period = inf
        self.next = inf
        """When they are sent next."""

    def set(self, signs: Mapping[int, bytes], period: float) -> None:
        """Send all messages now, and then every ``period`` seconds.

        :param signs: address -> its message, which replaces the previous one; empty bytes: none any more. An
            empty mapping removes all.

        Raises :class:`~stagewire.errors.OutOfRangeError` for an invalid period.
        """
        if not 0 < period < inf:
            raise OutOfRangeError(f"a period must be a number of seconds above 0, not {period!r}")
        together = {**self._signs, **signs} if signs else {}
        self._signs = {address: sign for address, sign in together.items() if sign}
        self._period = period
        self.next = 0.0 if self._signs else inf

    def take(self, now: float) -> bytes:
        """Return the bytes to send now. Missed periods are not made up for."""
        self.next = now + self._period
        return b"".join(self._signs.values())
