"""The filter of a subscription: which events a part of a device receives, and in which form."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, TypeVar

from stagewire._codec.events import Event
from stagewire._codec.message import Message
from stagewire._devices.endpoint import Endpoint
from stagewire._devices.stages import Place
from stagewire._devices.unit import Facts
from stagewire._devices.values import Values
from stagewire._framings.header.frame import Received
from stagewire._framings.header.message import FramedMessage
from stagewire.errors import BadValueError

First = TypeVar("First", bound=Message | Values[Any])
Second = TypeVar("Second", bound=Message | Values[Any])
Third = TypeVar("Third", bound=Message | Values[Any])


class EventFilter:
    """The filter of one subscription of a part.

    :param at: the part.
    :param classes: classes of messages or of values; none: all events.

    Raise :class:`~stagewire.errors.BadValueError` for any other class, and for a message that is wanted both
    as message and as values.
    """

    def __init__(self, at: Endpoint[Any], classes: tuple[type[Any], ...]) -> None:
        self._at = at
        self._channel = None if at.connection.unit.channels == 1 else at.channel
        self._as: dict[type[Message], type[Any]] = {}
        for cls in classes:
            for message in _messages(at.connection.facts, cls):
                if self._as.setdefault(message, cls) is not cls:
                    raise BadValueError(
                        f"cannot subscribe to {message.__name__} both as message and as values; use the "
                        "values, which contain their message"
                    )
        self._ids = {message.layout.id for message in self._as}

    def wanted(self, event: Event) -> bool:
        """Return whether an event is a message of the wanted classes and of the channel."""
        if not self._as and self._channel is None:
            return True
        # Compare the id first, because decoding a message takes longer.
        if not isinstance(event, Received) or (self._ids and event.id not in self._ids):
            return False
        message = event.frame.message
        if self._as and type(message) not in self._as:
            return False
        field = self._at.connection.channel_field(type(message))
        return None in (self._channel, field) or getattr(message, str(field)) == self._channel

    def read(self, event: Event) -> Any:
        """Return an event in the wanted form; values use the current scales."""
        if not self._as:
            return event
        assert isinstance(event, Received)
        message = event.frame.message
        cls = self._as[type(message)]
        if cls is type(message):
            return message
        place = self._place(event, message)
        return self._at.connection.report(cls, message, place, event.received)

    def _place(self, event: Received, message: Message) -> Place:
        """Return the channel that a message is about, which may be any of a device."""
        here, connection = self._at, self._at.connection
        field = connection.channel_field(type(message))
        channel = here.channel if field is None else getattr(message, field)
        # Some controllers reply without swapping source and destination.
        for address in (event.source, event.dest, here.address):
            if (address, channel) in connection.places:
                return address, channel
        return here.place


def _messages(facts: Facts, cls: object) -> Iterator[type[Message]]:
    """Yield the classes of messages that a class stands for."""
    found = []
    if isinstance(cls, type) and issubclass(cls, Values):
        found = [message for message, values in facts.all_values().items() if values is cls]
    elif isinstance(cls, type) and issubclass(cls, Message):
        found = [cls]
    if not found or not all(issubclass(message, FramedMessage) for message in found):
        raise BadValueError(
            f"cannot subscribe to {cls!r}: use classes of {facts.package}.messages that have frames, or of "
            f"{facts.package}.devices.values"
        )
    yield from found
