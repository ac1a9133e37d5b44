"""Dispatch of events to subscriptions: bounded queues that count the events they drop."""

from __future__ import annotations

import logging
from collections import deque
from collections.abc import Callable

from stagewire._codec.events import Event
from stagewire._framings.header.frame import FrameEvent
from stagewire._framings.header.message import FramedMessage
from stagewire._framings.header.table import message_key
from stagewire._sessions.statistics import Statistics
from stagewire.errors import BadValueError, OutOfRangeError, StagewireError

TYPE_CHECKING = False  # importing typing would double the import time
if TYPE_CHECKING:
    from typing import TypeAlias

    Condition: TypeAlias = Callable[[Event], object]
    Wanted: TypeAlias = Condition | type | tuple[type, ...] | None


_log = logging.getLogger("stagewire")


class Subscription:
    """A queue of wanted events. If it is full, the oldest event is dropped.

    The core puts events in, during its calls. One other thread at most takes them out.

    :param ids: the wanted messages; None: all messages, and events that are not messages.
    :param wanted: returns whether an event is wanted; None: all are.
    :param limit: most events that are kept.
    :param statistics: also counts the dropped events.
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
                f"the limit of a subscription must be an integer of at least 1, not {limit!r}"
            )
        self.ids = ids
        self.limit = limit
        self.dropped = 0
        """Number of events that were dropped because they were not taken in time."""
        self.error: StagewireError | None = None
        """Why no more events will follow."""
        self.on_event: Callable[[], object] | None = None
        """Called when an event was put in, or no more events will follow."""
        self._wanted = wanted
        self._queue: deque[Event] = deque()
        self._statistics = statistics
        self._cancel = cancel

    def __len__(self) -> int:
        return len(self._queue)

    def __repr__(self) -> str:
        return f"<Subscription: {len(self)} of {self.limit} events, {self.dropped} dropped>"

    def take(self) -> Event | None:
        """Return the oldest event, or None if the queue is empty."""
        try:
            return self._queue.popleft()
        except IndexError:
            return None

    def close(self) -> None:
        """Cancel the subscription; queued events stay. Harmless if called twice."""
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
        """Note that no more events will follow, and why."""
        self.error = error
        if self.on_event is not None:
            self.on_event()

    def _is_wanted(self, event: Event) -> object:
        assert self._wanted is not None
        try:
            return self._wanted(event)
        except Exception as error:  # raised by user code; others still get events
            self._cancel(self)
            failed = StagewireError(
                f"the condition of the subscription failed for {event!r}: {error!r}"
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
                "a subscription dropped its oldest event, because none of %d was taken in time; take events "
                "sooner, or subscribe with a higher limit (further drops are only counted)",
                self.limit,
            )


class Dispatcher:
    """The subscriptions of a session.

    :param statistics: counts the events they drop.
    :param source_of: returns the address that a frame comes from; None: unknown.
    """

    def __init__(
        self, statistics: Statistics, source_of: Callable[[bytes], int | None] | None = None
    ) -> None:
        self._statistics = statistics
        self._source_of = source_of
        self._subscriptions: list[Subscription] = []
        self._by_id: dict[int, tuple[Subscription, ...]] = {}  # cache of wanting()

    def subscribe(self, wanted: Wanted, limit: int, source: int | None) -> Subscription:
        """Return a new subscription; see :meth:`.Core.subscribe`."""
        ids, condition = _understood(wanted)
        if source is not None:
            condition = self._from(source, condition)
        subscription = Subscription(ids, condition, limit, self._statistics, self._unsubscribe)
        self._subscriptions.append(subscription)
        self._by_id.clear()
        return subscription

    def _unsubscribe(self, subscription: Subscription) -> None:
        if subscription in self._subscriptions:
            self._subscriptions.remove(subscription)
            self._by_id.clear()

    def wanting(self, id: int) -> tuple[Subscription, ...]:
        """Return the subscriptions to a message."""
        found = self._by_id.get(id)
        if found is None:
            wanting = [s for s in self._subscriptions if s.ids is None or id in s.ids]
            self._by_id[id] = found = tuple(wanting)
        return found

    def tell(self, event: Event) -> None:
        """Dispatch an event that is not a message."""
        for subscription in tuple(self._subscriptions):
            if subscription.ids is None:
                subscription.put(event)

    def end(self, error: StagewireError) -> None:
        """End all subscriptions, with the reason."""
        subscriptions, self._subscriptions = self._subscriptions, []
        self._by_id.clear()
        for subscription in subscriptions:
            subscription.end(error)

    def _from(self, source: int, condition: Condition | None) -> Condition:
        source_of = self._source_of
        if source_of is None:
            raise BadValueError("source is not supported: events on this line have no address")

        def wanted(event: Event) -> object:
            if isinstance(event, FrameEvent) and source_of(event.raw) not in (source, None):
                return False
            return condition is None or condition(event)

        return wanted


def _understood(wanted: Wanted) -> tuple[frozenset[int] | None, Condition | None]:
    """Return the ids of the wanted messages (if messages are wanted) and the condition on events.

    Raises :class:`~stagewire.errors.BadValueError` for an invalid ``wanted``.
    """
    if wanted is None:
        return None, None
    classes = (wanted,) if isinstance(wanted, type) else wanted
    if not isinstance(classes, tuple):
        if callable(classes):
            return None, classes
    elif classes and all(isinstance(cls, type) for cls in classes):
        if all(issubclass(cls, FramedMessage) for cls in classes):
            messages: tuple[type[FramedMessage], ...] = classes
            keys = (message_key(cls.layout.id, cls.layout.sub_message) for cls in messages)
            return frozenset(keys), None
        if all(issubclass(cls, Event) for cls in classes):
            return None, lambda event: isinstance(event, classes)
    raise BadValueError(
        "subscribe takes classes of messages, classes of events, or a condition on events, "
        f"not {wanted!r}"
    )
