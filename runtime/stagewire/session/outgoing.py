"""What waits to be sent, address by address: order, pacing, and requests that wait for each other."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from math import inf

from stagewire.session.framed_exchanges import Ask, FramedExchange
from stagewire.session.requests import Requests

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

    def take(self, now: float, write: Callable[[FramedExchange], object]) -> float:
        """Have everything written that may be now; return when there may be more, by time alone."""
        more_at = inf
        for dest, lane in tuple(self._busy.items()):
            more_at = min(more_at, self._empty(lane, now, write))
            if not lane.queue:
                del self._busy[dest]
        return more_at

    def _empty(self, lane: _Lane, now: float, write: Callable[[FramedExchange], object]) -> float:
        queue, requests = lane.queue, self._requests
        held: list[FramedExchange] = []
        more_at = inf
        while queue:
            exchange = queue[0]
            if now < lane.free_at:
                more_at = min(more_at, lane.free_at)
                break
            if isinstance(exchange, Ask):
                if not requests.may_be_sent(exchange):
                    break
                until = requests.poisoned_until(exchange)
                if until is not None:  # others may go on
                    more_at = min(more_at, until)
                    held.append(queue.popleft())
                    continue
            queue.popleft()
            write(exchange)
        queue.extendleft(reversed(held))
        return more_at

    def waiting(self) -> Iterator[FramedExchange]:
        """Yield all that waits."""
        for lane in self._busy.values():
            yield from lane.queue

    def forget(self) -> None:
        """Forget all of it."""
        self._lanes.clear()
        self._busy.clear()
