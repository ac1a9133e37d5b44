"""Who wants to hear what comes: a queue that is bounded, and counts what it loses."""

from __future__ import annotations

import logging
from collections import deque
from collections.abc import Callable

from stagewire._codec.events import Event
from stagewire.errors import OutOfRangeError, StagewireError

TYPE_CHECKING = False  # typing would take half of the time of an import
if TYPE_CHECKING:
    from stagewire._sessions.statistics import Statistics

__all__ = ["Subscription"]

_log = logging.getLogger("stagewire")


class Subscription:
    """A queue of events that were wanted; when it is full, the oldest is lost.

    Events are put in by the core, within its calls, and taken out by one other thread at most.

    :param ids: the messages that it is about; None: all, and what is no message.
    :param wanted: says of an event whether it is wanted; None: all are.
    :param limit: events that are kept at most.
    :param statistics: where what is lost is counted, too.
    :param cancel: called by :meth:`close`.

    Raises :class:`~stagewire.errors.OutOfRangeError` for a limit below 1.
    """

    def __init__(
        self,
        ids: frozenset[int] | None,
        wanted: Callable[[Event], object] | None,
        limit: int,
        statistics: Statistics,
        cancel: Callable[[Subscription], object],
    ) -> None:
        if isinstance(limit, bool) or not isinstance(limit, int) or limit < 1:
            raise OutOfRangeError(
                f"a subscription keeps a number of events from 1 on, not {limit!r}"
            )
        self.ids = ids
        self.limit = limit
        self.dropped = 0
        """Events that were lost because nobody took them in time."""
        self.error: StagewireError | None = None
        """Why nothing more will come."""
        self.on_event: Callable[[], object] | None = None
        """Called when something was put in, or nothing more will come."""
        self._wanted = wanted
        self._queue: deque[Event] = deque()
        self._statistics = statistics
        self._cancel = cancel

    def __len__(self) -> int:
        return len(self._queue)

    def __repr__(self) -> str:
        return f"<Subscription: {len(self)} of {self.limit} events, {self.dropped} dropped>"

    def take(self) -> Event | None:
        """Return the oldest event; None when there is none now."""
        try:
            return self._queue.popleft()
        except IndexError:
            return None

    def close(self) -> None:
        """Want nothing more; what is in the queue stays there. Harmless when done twice."""
        self._cancel(self)

    # For the core

    def put(self, event: Event) -> None:
        """Put an event in if it is wanted."""
        if self._wanted is not None and not self._is_wanted(event):
            return
        queue = self._queue
        if len(queue) >= self.limit:
            self._drop()
        queue.append(event)
        if self.on_event is not None:
            self.on_event()

    def end(self, error: StagewireError) -> None:
        """Say that nothing more will come, and why."""
        self.error = error
        if self.on_event is not None:
            self.on_event()

    def _is_wanted(self, event: Event) -> object:
        assert self._wanted is not None
        try:
            return self._wanted(event)
        except Exception as error:  # it is the user's, and must not end what everybody hears by
            self._cancel(self)
            failed = StagewireError(
                f"the subscription's own condition failed on {event!r}: {error!r}"
            )
            failed.__cause__ = error
            self.end(failed)
            return False

    def _drop(self) -> None:
        self.take()
        self.dropped += 1
        self._statistics.dropped += 1
        if self.dropped == 1:
            _log.warning(
                "a subscription lost its oldest event: nobody took one of %d in time; take them sooner, "
                "or subscribe with a greater limit (it counts what is lost from now on)",
                self.limit,
            )
