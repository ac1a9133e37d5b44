"""Where a call goes, and how long it may last.

An endpoint is one address, and one channel of it, of one open controller.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from typing import Any, Final, Generic

from stagewire._codec.message import Message
from stagewire._devices.connection import Connection, Place, T
from stagewire._devices.motions import Running
from stagewire._devices.scales import Scales
from stagewire._devices.tables import Action, Command, ParameterSet, Query
from stagewire._framings.slots.command import Command as WireCommand
from stagewire.errors import BadValueError

CONTROLLER: Final = -1
"""In place of an axis: the controller itself."""
MOMENT: Final = 0.001
"""Seconds; what a call that has no time left gives to its last question."""


class Deadline:
    """The end of a call that has several parts.

    :param now: the clock of the session.
    :param seconds: from now on, for all of them.
    """

    __slots__ = ("_end", "_now")

    def __init__(self, now: Callable[[], float], seconds: float) -> None:
        self._now = now
        self._end = now() + seconds

    @property
    def left(self) -> float:
        """Seconds; when there is none left a moment, in which a session says what was not done."""
        return max(MOMENT, self._end - self._now())

    @property
    def over(self) -> bool:
        """Whether there is none left."""
        return self._now() >= self._end


class Endpoint(Generic[T]):
    """One address, or axis, and one channel.

    :param connection: the controller.
    :param address: of whom a call goes to; of an axis its identifier.
    :param channel: that messages name; None where they name none.
    :param name: for people, such as ``BBD102 bay 2``.
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
        """The session; another one after the link was opened again."""
        return self.connection.transport

    @property
    def place(self) -> Place:
        """What distinguishes it from others of the controller."""
        return self.address, self.channel

    def now(self) -> float:
        """Return the time of the session in seconds."""
        return self.connection.transport.now()

    def deadline(self, seconds: float) -> Deadline:
        """Return the end of a call that may last so long."""
        return Deadline(self.connection.transport.now, seconds)

    def scales(self) -> Scales:
        """Return the scales that hold now."""
        return self.connection.scales(self.place)

    def seconds(self, timeout: float | None) -> float:
        """Return how long a call may last."""
        return _seconds(timeout, self.connection.choices.timeout)

    def motion_seconds(self, timeout: float | None) -> float:
        """Return how long a motion may last."""
        return _seconds(timeout, self.connection.choices.motion_timeout)

    def part_of(self, deadline: Deadline) -> float:
        """Return how long one question of a longer call may last."""
        return min(self.connection.choices.timeout, deadline.left)

    def address_of(self, table: ParameterSet[Any] | Query[Any] | Command | Action) -> int:
        """Return who takes the messages of a table."""
        return self.connection.unit.address if table.motherboard else self.address

    def message(self, cls: type[Message], fields: Mapping[str, Any]) -> Message:
        """Make a message for this channel; its own constructor checks all fields."""
        field = self.connection.channel_field(cls)
        if field is not None and field not in fields:
            fields = {field: self.channel, **fields}
        made: Message = cls(**fields)
        return made

    def running(self, table: Action | Command, what: str) -> Running | None:
        """Return how what a message starts is stopped; None where it starts nothing that goes on."""
        halt = table.halted_by
        if halt is None:
            return None
        if halt.message.layout.message not in self.connection.unit.messages:
            return Running(what, b"", self.now())
        stop = self.message(halt.message, defaults_of(halt))
        return Running(what, self._encode(stop), self.now(), stop)

    def _encode(self, message: Any) -> bytes:
        if isinstance(message, WireCommand):
            return message.pack(self.address)
        protocol: Any = self.connection.facts.protocol
        packed: bytes = message.pack(self.address, protocol.host)
        return packed


def defaults_of(table: Action) -> dict[str, int]:
    """Return the fields of a message as the library itself sends it."""
    return {entry.field: entry.default for entry in table.given if entry.default is not None}


def _seconds(timeout: float | None, default: float) -> float:
    """Return how long a call may last.

    Raises :class:`~stagewire.errors.BadValueError` for what is no time.
    """
    if timeout is None:
        return default
    if isinstance(timeout, bool) or not isinstance(timeout, int | float) or timeout != timeout:
        raise BadValueError(f"timeout takes seconds, not {timeout!r}")
    if timeout <= 0:
        raise BadValueError(f"timeout takes seconds, more than 0, not {timeout}")
    return float(min(timeout, threading.TIMEOUT_MAX))  # of infinity, too: locks take no more
