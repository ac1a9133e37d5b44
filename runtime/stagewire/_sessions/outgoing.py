"""What waits to be sent, address by address: order, pacing, and requests that wait for each other."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from math import inf

from stagewire._sessions.framed_exchanges import Ask, FramedExchange
from stagewire._sessions.requests import Requests

__all__ = ["Outgoing"]


class _Lane:
    """What waits to be sent to one address."""

    __slots__ = ("free_at", "queue")

    def __init__(self) -> None:
        self.queue: deque[FramedExchange] = deque()
        self.free_at = 0.0  # by pacing


class Outgoing:
    """The frames of one line that wait to be written.

    :param requests: which requests have to wait.
    :param pacing: seconds after a frame without a reply.
    """

    def __init__(self, requests: Requests, pacing: float) -> None:
        self._requests = requests
        self._pacing = pacing
        self._lanes: dict[int, _Lane] = {}
        self._busy: dict[int, _Lane] = {}  # those where something waits

    def add(self, exchange: FramedExchange) -> None:
        """Let something wait for its turn."""
        dest = exchange.dest
        lane = self._lanes.get(dest)
        if lane is None:
            lane = self._lanes[dest] = _Lane()
        lane.queue.append(exchange)
        self._busy[dest] = lane

    def remove(self, exchange: FramedExchange) -> None:
        """Let something wait no more."""
        self._lanes[exchange.dest].queue.remove(exchange)

    def pace(self, dest: int, now: float) -> None:
        """Note that a frame without a reply is written now."""
        self._lanes.setdefault(dest, _Lane()).free_at = now + self._pacing

    def take(
        self, now: float, write: Callable[[FramedExchange], object], may_ask: Callable[[], bool]
    ) -> float:
        """Have everything written that may be now; return when the pacing of something else is over.

        :param may_ask: says whether all that has come is known; if not, nothing is written that is answered.
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
                if requests.is_poisoned(exchange):  # others may go on
                    held.append(queue.popleft())
                    continue
            queue.popleft()
            write(exchange)
        queue.extendleft(reversed(held))

    def waiting(self) -> Iterator[FramedExchange]:
        """Yield all that waits."""
        for lane in self._busy.values():
            yield from lane.queue
