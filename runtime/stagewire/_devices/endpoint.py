"""Endpoints and deadlines of calls.

An endpoint is one address, and one channel of it, on one open controller.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from typing import Any, Final, Generic

from stagewire._codec.message import Message
from stagewire._devices.connection import Connection, T
from stagewire._devices.motions import Running
from stagewire._devices.scales import Scales
from stagewire._devices.stages import Place
from stagewire._devices.tables import Action, Command, ParameterSet, Query
from stagewire._framings.slots.command import Command as WireCommand
from stagewire.errors import BadValueError

CONTROLLER: Final = -1
"""Address of the controller itself, used instead of an axis."""
MOMENT: Final = 0.001
"""Timeout in seconds of the last request of a call that has no time left."""


class Deadline:
    """The deadline of a call with several steps.

    :param now: clock of the session.
    :param seconds: time for all steps together.
    """

    __slots__ = ("_end", "_now")

    def __init__(self, now: Callable[[], float], seconds: float) -> None:
        self._now = now
        self._end = now() + seconds

    @property
    def left(self) -> float:
        """Remaining seconds; after the deadline a moment, in which a session reports what was not done."""
        return max(MOMENT, self._end - self._now())

    @property
    def over(self) -> bool:
        """Whether no time is left."""
        return self._now() >= self._end


class Endpoint(Generic[T]):
    """One address, or axis, and one channel.

    :param connection: the controller.
    :param address: destination of messages; for an axis, its identifier.
    :param channel: channel in messages; None if they have none.
    :param name: name in messages, such as ``BBD102 bay 2``.
    """

    __slots__ = ("address", "channel", "connection", "name")

    def __init__(
        self, connection: Connection[T], address: int, channel: int | None, name: str
    ) -> None:
        self.connection = connection
        self.address = address
        self.channel = channel
        self.name = name

    @property
    def transport(self) -> T:
        """The current transport; it is replaced when the link is reopened."""
        return self.connection.transport

    @property
    def place(self) -> Place:
        """Address and channel, which identify the endpoint on its controller."""
        return self.address, self.channel

    def now(self) -> float:
        """Return the time of the session in seconds."""
        return self.connection.transport.now()

    def deadline(self, seconds: float) -> Deadline:
        """Return the deadline of a call with a timeout in seconds."""
        return Deadline(self.connection.transport.now, seconds)

    def scales(self) -> Scales:
        """Return the current scales."""
        return self.connection.scales(self.place)

    def seconds(self, timeout: float | None) -> float:
        """Return the timeout of a call in seconds."""
        return _seconds(timeout, self.connection.choices.timeout)

    def motion_seconds(self, timeout: float | None) -> float:
        """Return the timeout of a motion in seconds."""
        return _seconds(timeout, self.connection.choices.motion_timeout)

    def part_of(self, deadline: Deadline) -> float:
        """Return the timeout of one request within a longer call."""
        return min(self.connection.choices.timeout, deadline.left)

    def address_of(self, table: ParameterSet[Any] | Query[Any] | Command | Action) -> int:
        """Return the destination address of the messages of a table."""
        return self.connection.unit.address if table.motherboard else self.address

    def message(self, cls: type[Message], fields: Mapping[str, Any]) -> Message:
        """Return a message for this channel; its constructor checks all fields.

        A controller with one channel gets the default of a channel that may be left out.
        """
        field = self.connection.channel_field(cls)
        if field in cls.layout.optional and self.connection.unit.channels == 1:
            field = None
        if field is not None and field not in fields:
            fields = {field: self.channel, **fields}
        made: Message = cls(**fields)
        return made

    def running(self, table: Action | Command, what: str) -> Running | None:
        """Return the entry of a motion that a message starts, with its stop; None if it starts no motion."""
        halt = self.halt_of(table)
        if halt is None:
            return None
        if halt.message.layout.message not in self.connection.unit.messages:
            return Running(what, b"", self.now())
        stop = self.message(halt.message, {**self._every_channel(halt), **defaults_of(halt)})
        return Running(what, self._encode(stop), self.now(), stop)

    def halt_of(self, table: Action | Command) -> Action | None:
        """Return the action that stops the motion of a table on this unit; None if it starts no motion."""
        for halt in reversed(table.or_halted_by):
            if halt.message.layout.message in self.connection.unit.messages:
                return halt
        return table.halted_by

    def _every_channel(self, halt: Action) -> Mapping[str, int]:
        """Return the channel of the stop of a whole rack: the bits of all its channels."""
        field = self.connection.channel_field(halt.message)
        bays = len(self.connection.unit.bays)
        return {field: (1 << bays) - 1} if field and self.channel is None and bays else {}

    def _encode(self, message: Any) -> bytes:
        if isinstance(message, WireCommand):
            return message.pack(self.address)
        protocol: Any = self.connection.facts.protocol
        packed: bytes = message.pack(self.address, protocol.host)
        return packed


def defaults_of(table: Action) -> dict[str, int]:
    """Return the default fields of a message that the library sends itself."""
    return {entry.field: entry.default for entry in table.given if entry.default is not None}


def _seconds(timeout: float | None, default: float) -> float:
    """Return the timeout of a call in seconds.

    Raise :class:`~stagewire.errors.BadValueError` for an invalid timeout.
    """
    if timeout is None:
        return default
    if isinstance(timeout, bool) or not isinstance(timeout, int | float) or timeout != timeout:
        raise BadValueError(f"timeout must be a number of seconds, not {timeout!r}")
    if timeout <= 0:
        raise BadValueError(f"timeout must be more than 0 seconds, not {timeout}")
    return float(min(timeout, threading.TIMEOUT_MAX))  # also for infinity: locks accept no more
