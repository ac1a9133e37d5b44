"""Who wants to hear what."""

from __future__ import annotations

from collections.abc import Callable

from stagewire._codec.events import Event
from stagewire._framings.header.frame import FrameEvent
from stagewire._framings.header.message import FramedMessage
from stagewire._sessions.statistics import Statistics
from stagewire._sessions.subscription import Subscription
from stagewire.errors import BadValueError, StagewireError

TYPE_CHECKING = False  # typing would take half of the time of an import
if TYPE_CHECKING:
    from typing import TypeAlias

    Condition: TypeAlias = Callable[[Event], object]
    Wanted: TypeAlias = Condition | type | tuple[type, ...] | None

__all__ = ["News"]


class News:
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
