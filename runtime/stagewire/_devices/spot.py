"""Where a call goes: one address, and one channel of it, of one open controller."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import AbstractAsyncContextManager
from typing import Any, Final, cast

from stagewire._codec.message import Message
from stagewire._devices.connection import Connection, Place
from stagewire._devices.line import Deadline, Line, LineOfFrames, seconds_of
from stagewire._devices.motions import Running
from stagewire._devices.scales import Scales
from stagewire._devices.tables import Action, Command, ParameterSet, Query
from stagewire._framings.slots.command import Command as WireCommand

__all__ = ["CONTROLLER", "Spot", "defaults_of"]

CONTROLLER: Final = -1
"""In place of an axis: the controller itself."""


class Spot:
    """One address, or axis, and one channel.

    :param connection: the controller.
    :param address: of whom a call goes to; of an axis its identifier.
    :param channel: that messages name; None where they name none.
    :param name: for people, such as ``BBD102 bay 2``.
    """

    __slots__ = ("address", "channel", "connection", "name")

    def __init__(
        self, connection: Connection, address: int, channel: int | None, name: str
    ) -> None:
        self.connection = connection
        self.address = address
        self.channel = channel
        self.name = name

    @property
    def line(self) -> Line:
        """The session; another one after the line was opened again."""
        return self.connection.line

    @property
    def frames(self) -> LineOfFrames:
        """The same, to a controller that has an address."""
        return cast(LineOfFrames, self.connection.line)

    @property
    def place(self) -> Place:
        """What distinguishes it from others of the controller."""
        return self.address, self.channel

    def scales(self) -> Scales:
        """Return the scales that hold now."""
        return self.connection.scales(self.place)

    def seconds(self, timeout: float | None) -> float:
        """Return how long a call may last."""
        return seconds_of(timeout, self.connection.choices.timeout)

    def motion_seconds(self, timeout: float | None) -> float:
        """Return how long a motion may last."""
        return seconds_of(timeout, self.connection.choices.motion_timeout)

    def part_of(self, deadline: Deadline) -> float:
        """Return how long one question of a longer call may last."""
        return min(self.connection.choices.timeout, deadline.left)

    def lock(self, key: str, what: str, seconds: float) -> AbstractAsyncContextManager[None]:
        """Keep others out of what has the same key here."""
        return self.line.lock((self.address, self.channel, key), what, seconds)

    def address_of(self, table: ParameterSet[Any] | Query[Any] | Command | Action) -> int:
        """Return who takes the messages of a table."""
        return self.connection.unit.address if table.motherboard else self.address

    def message(self, cls: type[Message], fields: Mapping[str, Any]) -> Message:
        """Make a message for this channel; its own constructor checks all fields."""
        field = self.connection.channel_field(cls)
        if field is None or field in fields:
            return _make(cls, fields)
        return _make(cls, {field: self.channel, **fields})

    def running(self, table: Action | Command, what: str) -> Running | None:
        """Return how what a message starts is stopped; None where it starts nothing that goes on."""
        halt = table.halted_by
        if halt is None:
            return None
        if halt.message.layout.message not in self.connection.unit.messages:
            return Running(what, b"", self.line.now())
        stop = self.message(halt.message, defaults_of(halt))
        return Running(what, self._encode(stop), self.line.now(), stop)

    def _encode(self, message: Any) -> bytes:
        if isinstance(message, WireCommand):
            return message.pack(self.address)
        protocol: Any = self.connection.facts.protocol
        packed: bytes = message.pack(self.address, protocol.host)
        return packed


def defaults_of(table: Action) -> dict[str, int]:
    """Return the fields of a message as the library itself sends it."""
    return {entry.field: entry.default for entry in table.given if entry.default is not None}


def _make(cls: type[Message], fields: Mapping[str, Any]) -> Message:
    made: Message = cls(**fields)
    return made
