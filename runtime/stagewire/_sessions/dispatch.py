"""Dispatch of events to subscriptions: bounded queues that count what they lose."""

from __future__ import annotations

import logging
from collections import deque
from collections.abc import Callable

from stagewire._codec.events import Event
from stagewire._framings.header.frame import FrameEvent
from stagewire._framings.header.message import FramedMessage
from stagewire._sessions.statistics import Statistics
from stagewire.errors import BadValueError, OutOfRangeError, StagewireError

TYPE_CHECKING = False  # typing would take half of the time of an import
if TYPE_CHECKING:
    from typing import TypeAlias

    Condition: TypeAlias = Callable[[Event], object]
    Wanted: TypeAlias = Condition | type | tuple[type, ...] | None


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


class Dispatcher:
    """The subscriptions of a session.

    :param statistics: where what they lose is counted.
    :param source_of: says where a frame comes from; None: it does not say.
    """

    def __init__(
        self, statistics: Statistics, source_of: Callable[[bytes], int | None] | None = None
    ) -> None:
        self._statistics = statistics
        self._source_of = source_of
        self._subscriptions: list[Subscription] = []
        self._by_id: dict[int, tuple[Subscription, ...]] = {}  # as it was found for each message

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
        """Return who wants to hear of a message."""
        found = self._by_id.get(id)
        if found is None:
            wanting = [s for s in self._subscriptions if s.ids is None or id in s.ids]
            self._by_id[id] = found = tuple(wanting)
        return found

    def tell(self, event: Event) -> None:
        """Tell what is no message."""
        for subscription in tuple(self._subscriptions):
            if subscription.ids is None:
                subscription.put(event)

    def end(self, error: StagewireError) -> None:
        """Say that nothing more will come, and why."""
        subscriptions, self._subscriptions = self._subscriptions, []
        self._by_id.clear()
        for subscription in subscriptions:
            subscription.end(error)

    def _from(self, source: int, condition: Condition | None) -> Condition:
        source_of = self._source_of
        if source_of is None:
            raise BadValueError("what comes on this line does not say where it comes from")

        def wanted(event: Event) -> object:
            if isinstance(event, FrameEvent) and source_of(event.raw) not in (source, None):
                return False
            return condition is None or condition(event)

        return wanted


def _understood(wanted: Wanted) -> tuple[frozenset[int] | None, Condition | None]:
    """Return the ids of the messages that are wanted, if it is messages, and what has to hold of an event.

    Raises :class:`~stagewire.errors.BadValueError` for what cannot be wanted.
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
            return frozenset(cls.layout.id for cls in messages), None
        if all(issubclass(cls, Event) for cls in classes):
            return None, lambda event: isinstance(event, classes)
    raise BadValueError(
        "a subscription is to classes of messages, to classes of events, or by a condition on events, "
        f"not to {wanted!r}"
    )
