"""The motions that the library started and that may still be under way, and the outputs to switch off."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator
from typing import Any, Final, TypeAlias

from stagewire._codec.message import Message
from stagewire._devices.tables import Order
from stagewire._devices.unit import Unit
from stagewire._sessions.exchange import Exchange

__all__ = ["BEGINNING", "Motions", "Outputs", "Running"]

Place: TypeAlias = tuple[int, int | None]
"""Address and channel."""

BEGINNING: Final = 0.5
"""Maximum delay in seconds before a started motion shows in the status."""


class Running:
    """A motion that was started.

    :param what: name of the call, for messages.
    :param stop: bytes that stop it; empty if it cannot be stopped.
    :param halt: the same stop as a message.
    """

    __slots__ = ("ended", "exchange", "halt", "left", "started", "stop", "stopped", "what")

    def __init__(self, what: str, stop: bytes, started: float, halt: Message | None = None) -> None:
        self.what = what
        self.stop = stop
        self.halt = halt
        self.started = started
        self.exchange: Exchange | None = None
        """The exchange that reports its end; None if the end is polled for or not reported."""
        self.ended: float | None = None
        """When its end was reported, in the time of the session."""
        self.stopped = False
        """Whether a stop was sent after the start."""
        self.left = False
        """Whether it was started over an earlier line, so that its end will not be reported.

        A stop that was sent as that line was closed does not change this, because it was not confirmed.
        """

    def just_begun(self, now: float) -> bool:
        """Return whether it started so recently that a status may not show it yet."""
        return now - self.started < BEGINNING


class Motions:
    """The motions that were started, by address and channel; at most one each.

    Threads add and remove entries while a signal handler reads them, so every step is a single dictionary
    operation.
    """

    def __init__(self) -> None:
        self._running: dict[tuple[int, int | None], Running] = {}
        self._orders: dict[tuple[int, int | None], int] = {}

    def start(self, place: tuple[int, int | None], running: Running) -> None:
        """Add a motion that is about to start; it replaces an earlier one there."""
        self._running[place] = running

    def at(self, place: tuple[int, int | None]) -> Running | None:
        """Return the motion that may be under way there."""
        return self._running.get(place)

    def refused(
        self, place: tuple[int, int | None], running: Running, before: Running | None
    ) -> None:
        """Remove a motion that was not sent, and restore the previous one."""
        if self._running.get(place) in (running, None):
            if before is None:
                self._running.pop(place, None)
            else:
                self._running[place] = before

    def over(self, place: tuple[int, int | None], running: Running) -> None:
        """Remove a motion that has ended, unless another one was started there since."""
        if self._running.get(place) is running:
            self._running.pop(place, None)

    def stopping(self, place: tuple[int, int | None]) -> None:
        """Record that a stop is about to be sent."""
        self._orders[place] = self.orders(place) + 1

    def orders(self, place: tuple[int, int | None]) -> int:
        """Return how many stops were ordered there."""
        return self._orders.get(place, 0)

    def stopped(self, place: tuple[int, int | None]) -> None:
        """Record that a stop was sent, so that nothing there needs to be stopped."""
        running = self._running.pop(place, None)
        if running is not None:
            running.stopped = True

    def names(self, *, stopped: bool = False) -> tuple[str, ...]:
        """Return the names of the motions that may be under way, for messages.

        :param stopped: whether a stop is sent to all that can be stopped; they are then left out.
        """
        found = tuple(self._running.values())
        return tuple(running.what for running in found if not (stopped and running.stop))

    def halts(self) -> list[tuple[int, Message]]:
        """Return the address and the stop of each motion."""
        return [
            (address, running.halt)
            for (address, _), running in tuple(self._running.items())
            if running.halt is not None
        ]

    def leave(self) -> None:
        """Mark all motions as started over an earlier line, even if stops were sent last."""
        for running in tuple(self._running.values()):
            running.left = True

    def stops(self, without: Collection[bytes] = ()) -> bytes:
        """Return the bytes that stop everything; takes no lock, because signal handlers call it.

        :param without: stops that are sent anyway, and left out.
        """
        stops = [running.stop for running in tuple(self._running.values())]
        return b"".join([stop for stop in stops if stop not in without])


class Outputs:
    """The outputs of one controller that can be brought into a state.

    :param unit: unit of the controller.
    :param channel_field: returns the field of a message with the channel; None if it has none.
    """

    def __init__(self, unit: Unit, channel_field: Callable[[type[Message]], str | None]) -> None:
        self._unit = unit
        self._channel_field = channel_field
        self._keeping = [order for order in (*unit.safe_state, *unit.stop_state) if order.kept]
        self._held: dict[tuple[int, type[Message]], dict[str, int]] = {}

    def forget(self) -> None:
        """Forget the values that the controller holds, before they are read again on another line."""
        self._held.clear()

    def learn(self, address: int, message: Message) -> None:
        """Store the values of a message that a later one has to keep."""
        for order in self._keeping:
            read = order.read
            if read is not None and (
                read.is_written_with(type(message)) or type(message) is read.get
            ):
                self._held[address, order.message] = {
                    name: getattr(message, name) for name in order.kept
                }

    def unread(self, orders: Iterable[Order], address: int) -> Iterator[Order]:
        """Yield the messages that cannot be made before the values that they keep were read."""
        for order in orders:
            if order.kept and (address, order.message) not in self._held:
                yield order

    def off(self, places: Iterable[Place], protocol: Any) -> list[bytes]:
        """Return the frames that switch off the outputs that can burn or heat; takes no lock."""
        orders = self._unit.safe_state
        found = self.messages(orders, places) if orders else []
        return [message.pack(address, protocol.host) for address, message in found]

    def messages(self, orders: Iterable[Order], places: Iterable[Place]) -> list[tuple[int, Any]]:
        """Return messages with their addresses, each once; those that cannot be made are left out.

        :param places: the channels to which they are sent.
        """
        found: dict[tuple[int, type[Message], tuple[Any, ...]], tuple[int, Any]] = {}
        at = tuple(places)
        for order in orders:
            cls: Any = order.message
            field = self._channel_field(cls)
            for address, channel in at:
                if order.kept and (address, cls) not in self._held:
                    continue
                values: dict[str, int | None] = {
                    **order.values,
                    **self._held.get((address, cls), {}),
                }
                if field is not None:
                    values[field] = channel
                found.setdefault((address, cls, tuple(values.items())), (address, cls(**values)))
        return list(found.values())
