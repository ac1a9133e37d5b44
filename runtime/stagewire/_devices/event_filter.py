"""The filter of a subscription: the events that a part of a device gets, and in which form."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, TypeVar

from stagewire._codec.events import Event
from stagewire._codec.message import Message
from stagewire._devices.connection import Place
from stagewire._devices.endpoint import Endpoint
from stagewire._devices.unit import Facts
from stagewire._devices.values import Values
from stagewire._framings.header.frame import Received
from stagewire._framings.header.message import FramedMessage
from stagewire.errors import BadValueError

First = TypeVar("First", bound=Message | Values[Any])
Second = TypeVar("Second", bound=Message | Values[Any])
Third = TypeVar("Third", bound=Message | Values[Any])


class EventFilter:
    """The events of one subscription of a part.

    :param at: the part.
    :param classes: of messages, or of their values; none: everything, as events.

    Raises :class:`~stagewire.errors.BadValueError` for what is no such class, and for a message that is to be
    given out in two ways.
    """

    def __init__(self, at: Endpoint[Any], classes: tuple[type[Any], ...]) -> None:
        self._at = at
        self._channel = None if at.connection.unit.channels == 1 else at.channel
        self._as: dict[type[Message], type[Any]] = {}
        for cls in classes:
            for message in _messages(at.connection.facts, cls):
                if self._as.setdefault(message, cls) is not cls:
                    raise BadValueError(
                        f"{message.__name__} is subscribed to as message and as values; leave one out, as "
                        "values have their message"
                    )
        self._ids = {message.layout.id for message in self._as}

    def wanted(self, event: Event) -> bool:
        """Say whether an event is given out: a message of the classes, and of the channel."""
        if not self._as and self._channel is None:
            return True
        # By its id first: to decode a message takes longer.
        if not isinstance(event, Received) or (self._ids and event.id not in self._ids):
            return False
        message = event.frame.message
        if self._as and type(message) not in self._as:
            return False
        field = self._at.connection.channel_field(type(message))
        return None in (self._channel, field) or getattr(message, str(field)) == self._channel

    def read(self, event: Event) -> Any:
        """Return as what an event is given out; values have the scales that hold now."""
        if not self._as:
            return event
        assert isinstance(event, Received)
        message = event.frame.message
        cls = self._as[type(message)]
        if cls is type(message):
            return message
        return cls(message, self._at.connection.scales(self._place(event, message)))

    def _place(self, event: Received, message: Message) -> Place:
        """Return the channel that a message is about: a device hears those of all its bays and channels."""
        here, connection = self._at, self._at.connection
        field = connection.channel_field(type(message))
        channel = here.channel if field is None else getattr(message, field)
        # Some controllers send back the addresses of what they were sent, not exchanged.
        for address in (event.source, event.dest, here.address):
            if (address, channel) in connection.places:
                return address, channel
        return here.place


def _messages(facts: Facts, cls: object) -> Iterator[type[Message]]:
    """Give the messages that a class stands for."""
    found = []
    if isinstance(cls, type) and issubclass(cls, Values):
        found = [message for message, values in facts.all_values().items() if values is cls]
    elif isinstance(cls, type) and issubclass(cls, Message):
        found = [cls]
    if not found or not all(issubclass(message, FramedMessage) for message in found):
        raise BadValueError(
            f"a subscription is to classes of {facts.package}.messages that come in frames, or of "
            f"{facts.package}.devices.values, not to {cls!r}"
        )
    yield from found
