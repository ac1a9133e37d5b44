# Generated from _devices/asynchronous/parts.py by `python tools/unasync.py`; do not edit.

"""Parts of devices for threads: what calls go to, and the motions that they start.

See :mod:`stagewire._devices.synchronous.devices` for the devices themselves.
"""

from __future__ import annotations

from typing import Any, Generic, TypeVar, overload

from stagewire._codec.events import Event
from stagewire._devices.event_filter import EventFilter, First, Second, Third
from stagewire._devices.structure import ChannelsBase, PartBase
from stagewire._devices.synchronous import calls, motion
from stagewire._devices.synchronous.transport import Endpoint
from stagewire._devices.tables import Action, Command, MotionEnd, ParameterSet, Query
from stagewire._devices.values import Values
from stagewire._sessions.subscriptions import BlockingSubscription
from stagewire._sessions.synchronous import CommandSession, FramedSession

V = TypeVar("V", bound=Values[Any])


class Motion:
    """A motion that was started."""

    def __init__(self, started: motion.Started) -> None:
        self._started = started

    def __repr__(self) -> str:
        return f"<Motion {self._started.running.what}{' (done)' if self.done else ''}>"

    @property
    def done(self) -> bool:
        """Whether nothing more is awaited: its end has come, or the time for it has passed.

        Which of them, :meth:`wait` says. Of what is polled for, whether :meth:`wait` has seen its end.
        Whether it moves, ``is_moving()`` tells.
        """
        return self._started.done

    def wait(self, timeout: float | None = None) -> MotionEnd:
        """Wait for its end and return it.

        :param timeout: seconds; when they have passed, it goes on, and may be waited for again. None: as long
            as the motion may last.

        Raises :class:`~stagewire.errors.MotionStoppedError` for one that was stopped,
        :class:`~stagewire.errors.TargetNotReachedError` for one that ended elsewhere,
        :class:`~stagewire.errors.ControllerFaultError` where the controller reported a fault, and
        :class:`~stagewire.errors.MotionTimeoutError`; after the last two it may still be under way. Also
        :class:`~stagewire.errors.ReplyTimeoutError` where it has ended and the question where gets no answer,
        :class:`~stagewire.errors.TransportLostError` and :class:`~stagewire.errors.SessionClosedError`.
        """
        return self._started.wait(timeout)

    def stop(self, timeout: float | None = None) -> MotionEnd | None:
        """Stop it, before everything else that waits.

        Returns None when it is with the line, where the controller says nothing more. Raises
        :class:`~stagewire.errors.UnsupportedError` where nothing stops it, and as :meth:`wait` does.
        """
        return self._started.stop(timeout)


class Part(PartBase):
    """Something that calls go to: a device, a bay, a channel or an axis."""

    _at: Endpoint

    def _get(self, table: ParameterSet[V], timeout: float | None, **asked: object) -> V:
        return calls.query(self._at, table, timeout, asked)

    def _ask(self, table: Query[V], timeout: float | None, **asked: object) -> V:
        return calls.query(self._at, table, timeout, asked)

    def _set(self, table: ParameterSet[Any], timeout: float | None, **given: object) -> None:
        calls.set_all(self._at, table, timeout, given)

    def _change(self, table: ParameterSet[V], timeout: float | None, **given: object) -> V:
        return calls.change(self._at, table, timeout, given)

    def _tell(self, table: Command, timeout: float | None, **given: object) -> None:
        calls.tell(self._at, table, timeout, given)

    def _act(self, table: Action, timeout: float | None, **given: object) -> MotionEnd:
        return motion.act(self._at, table, timeout, given)

    def _start(self, table: Action, **given: object) -> Motion:
        return Motion(motion.start(self._at, table, None, given))

    def _halt(self, table: Action, timeout: float | None, **given: object) -> MotionEnd | None:
        return motion.halt(self._at, table, timeout, given)

    @property
    def session(self) -> FramedSession | CommandSession:
        """The session below, for what no method does."""
        return self._at.transport.session

    @overload
    def subscribe(self, *, limit: int = 1000) -> BlockingSubscription[Event]: ...

    @overload
    def subscribe(
        self, first: type[First], /, *, limit: int = 1000
    ) -> BlockingSubscription[First]: ...

    @overload
    def subscribe(
        self, first: type[First], second: type[Second], /, *, limit: int = 1000
    ) -> BlockingSubscription[First | Second]: ...

    @overload
    def subscribe(
        self,
        first: type[First],
        second: type[Second],
        /,
        *others: type[Third],
        limit: int = 1000,
    ) -> BlockingSubscription[First | Second | Third]: ...

    def subscribe(self, *wanted: type[Any], limit: int = 1000) -> BlockingSubscription[Any]:
        """Return a queue of what comes from here from now on, except what answers a question.

        :param wanted: classes of messages, or of their values, and of no other form of theirs; they are given
            out themselves, values in the scales that hold when they are taken. None: everything, as events.
        :param limit: how much is kept at most; then the oldest is lost, and counted.

        Raises :class:`~stagewire.errors.BadValueError` for what is no such class, and
        :class:`~stagewire.errors.OutOfRangeError` for a limit below 1.
        """
        events = EventFilter(self._at, wanted)
        return self.session.subscribe_as(events.read, events.wanted, limit, self._source)


class Channel(Part):
    """One channel of a controller."""

    def is_moving(self, *, timeout: float | None = None) -> bool:
        """Ask whether it moves.

        Raises :class:`~stagewire.errors.UnsupportedError` for a unit that cannot be asked.
        """
        return calls.is_moving(self._at, timeout)


class Bay(Channel):
    """A bay of a rack: a controller with one channel."""


class Axis(Channel):
    """An axis of a controller whose commands have no frame."""


C = TypeVar("C", bound=Channel)
B = TypeVar("B", bound=Part)


class ChannelsBay(ChannelsBase[C], Part, Generic[C]):
    """A bay of a rack: a controller with several channels."""
