# Generated from _devices/asynchronous/parts.py by `python tools/unasync.py`; do not edit.

"""Parts of devices for threads, such as channels and bays, and the motions that they start.

The devices are in :mod:`stagewire._devices.synchronous.devices`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Generic, Protocol, TypeVar, overload

from stagewire._codec.events import Event
from stagewire._devices.event_filter import EventFilter, First, Second, Third
from stagewire._devices.readiness import check_enabling
from stagewire._devices.structure import ChannelsBase, PartBase
from stagewire._devices.synchronous import calls, defaults, motion, readiness, snapshots, status
from stagewire._devices.synchronous.recorder import Recorder
from stagewire._devices.synchronous.transport import Endpoint
from stagewire._devices.tables import (
    Action,
    Command,
    MotionEnd,
    ParameterSet,
    Query,
    Reported,
)
from stagewire._devices.values import Values
from stagewire._sessions.subscriptions import BlockingSubscription
from stagewire._sessions.synchronous import CommandSession, FramedSession

V = TypeVar("V", bound=Values[Any])


class Motion(Generic[Reported]):
    """A motion that was started."""

    def __init__(self, started: motion.Started) -> None:
        self._started = started

    def __repr__(self) -> str:
        return f"<Motion {self._started.running.what}{' (done)' if self.done else ''}>"

    @property
    def done(self) -> bool:
        """Whether the motion has ended or timed out; :meth:`wait` returns its end or raises the error.

        If the controller has to be polled, this is False until :meth:`wait` has seen the end. ``is_moving()``
        asks the controller.
        """
        return self._started.done

    def wait(self, timeout: float | None = None) -> MotionEnd[Reported]:
        """Wait for the end of the motion and return it.

        :param timeout: seconds to wait. After a timeout the motion continues, and you can wait again. None:
            until the timeout of the motion.

        Raise :class:`~stagewire.errors.MotionStoppedError` if it was stopped,
        :class:`~stagewire.errors.TargetNotReachedError` if it ended away from its target,
        :class:`~stagewire.errors.ControllerFaultError` if the controller reported a fault, and
        :class:`~stagewire.errors.MotionTimeoutError`. After the last two, it may still be under way. Also
        raise :class:`~stagewire.errors.ReplyTimeoutError` if it has ended but the final position cannot be
        read, :class:`~stagewire.errors.TransportLostError` and :class:`~stagewire.errors.SessionClosedError`.
        """
        end: MotionEnd[Any] = self._started.wait(timeout)
        return end

    def stop(self, timeout: float | None = None) -> MotionEnd[Reported | None] | None:
        """Stop the motion; the stop is sent before all waiting messages.

        Return None if the controller does not confirm the stop. Raise
        :class:`~stagewire.errors.UnsupportedError` if the motion cannot be stopped, and the errors of
        :meth:`wait`.
        """
        return self._started.stop(timeout)


class Mover(Protocol[Reported]):
    """A part that reports values at the end of its motions, for type checkers."""

    @property
    def _reported(self) -> Reported: ...

    def _act(self, table: Action, timeout: float | None, **given: object) -> MotionEnd[Any]: ...

    def _start(self, table: Action, **given: object) -> Motion[Any]: ...

    def _halt(
        self, table: Action, timeout: float | None, **given: object
    ) -> MotionEnd[Any] | None: ...


class Part(PartBase):
    """Part of a device that has calls: the device itself, a bay, a channel or an axis."""

    _at: Endpoint

    def _get(self, table: ParameterSet[V], timeout: float | None, **asked: object) -> V:
        return calls.query(self._at, table, timeout, asked)

    def _ask(self, table: Query[V], timeout: float | None, **asked: object) -> V:
        return calls.query(self._at, table, timeout, asked)

    def _set(self, table: ParameterSet[Any], timeout: float | None, **given: object) -> None:
        calls.set_all(self._at, table, timeout, given)

    def _establish(
        self,
        table: ParameterSet[Any],
        timeout: float | None,
        causes: str,
        otherwise: Mapping[str, object],
        **given: object,
    ) -> None:
        calls.establish(self._at, table, timeout, given, causes=causes, otherwise=otherwise)

    def _change(self, table: ParameterSet[V], timeout: float | None, **given: object) -> V:
        return calls.change(self._at, table, timeout, given)

    def _tell(self, table: Command, timeout: float | None, **given: object) -> None:
        readiness.tell(self._at, table, timeout, given)

    def _act(self, table: Action, timeout: float | None, **given: object) -> MotionEnd[Any]:
        return motion.act(self._at, table, timeout, given)

    def _start(self, table: Action, **given: object) -> Motion[Any]:
        return Motion(motion.start(self._at, table, None, given))

    def _halt(self, table: Action, timeout: float | None, **given: object) -> MotionEnd[Any] | None:
        return motion.halt(self._at, table, timeout, given)

    def _halt_each(self, table: Action, timeout: float | None) -> None:
        motion.halt_each(self._places().values(), table, timeout)

    @property
    def session(self) -> FramedSession | CommandSession:
        """The session of the device, for messages without a method."""
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
        """Subscribe to messages from this part, except replies to requests; return their queue.

        :param wanted: classes of messages or of values, whose instances the queue returns. Values use the
            scales in effect when they are taken from it. Without classes, the queue returns all events.
        :param limit: maximum number of queued events; when it is exceeded, the oldest is dropped and counted.

        Raise :class:`~stagewire.errors.BadValueError` for any other class, and
        :class:`~stagewire.errors.OutOfRangeError` for a limit below 1.
        """
        events = EventFilter(self._at, wanted)
        return self.session.subscribe_as(events.read, events.wanted, limit, self._source)

    def record(
        self,
        to: str | Path | Callable[[dict[str, Any]], object],
        *,
        overwrite: bool = False,
        poll: float = 0.2,
        listen: bool = False,
    ) -> Recorder:
        """Record every status within a block, in engineering units: ``with tdc.record("run.csv"):``.

        Other calls, such as moves, continue. Status updates are started for the block, unless they were
        on before; nothing else is sent. A unit that sends none is polled. For a device with several channels,
        bays or axes, the column ``part`` names the one of each row.

        A line of a CSV file is written within a second, and is kept if the process is killed. A Parquet file
        is written at the end of the block, and is lost if the process is killed.

        :param to: file that ends in ``.csv`` or ``.parquet``; or a function that is called with each row, a
            dictionary of column and value. It must be fast.
        :param overwrite: whether to replace an existing file.
        :param poll: seconds between two requests to a unit that sends no updates.
        :param listen: whether to send nothing, and record what another program on a shared line asks for.

        Entering the block raises :class:`~stagewire.errors.RecordingError` for a file that exists or cannot
        be created, and :class:`~stagewire.errors.UnsupportedError` for a unit that reports no status.

        Leaving the block raises :class:`~stagewire.errors.RecordingError` if the recording is incomplete,
        such as after a loss of the line or on a full disk. If the block itself raises an error, that error is
        kept and gets a note.
        """
        return Recorder(self._places(), to, overwrite=overwrite, poll=poll, listen=listen)


class Stoppable(Part):
    """A part whose outputs or loops are ended by several messages, or by one with values."""

    def stop(self, *, timeout: float | None = None) -> None:
        """End the outputs and loops of this part that its unit can end; the page of the unit names them.

        The messages are sent before all waiting messages. They are also sent if nothing was started here.

        :param timeout: of each message, in seconds.
        """
        motion.stop_outputs(self._at, timeout)


class Channel(Part):
    """One channel of a controller."""

    def is_moving(self, *, timeout: float | None = None) -> bool:
        """Ask the controller whether it moves.

        Raise :class:`~stagewire.errors.UnsupportedError` for a unit that cannot be asked.
        """
        return calls.is_moving(self._at, timeout)

    @property
    def position(self) -> float:
        """The position in the unit of the stage: mm, or degrees for a rotary stage.

        Each access sends a request. Axes of the MS2000 have positions in um.

        Raise :class:`~stagewire.errors.UnknownScaleError` if the stage is unknown, and
        :class:`~stagewire.errors.UnsupportedError` for a unit that reports no position of a motor.
        """
        return status.position(self._at)

    @property
    def position_mm(self) -> float:
        """The position in mm; otherwise like :attr:`position`. A rotary stage has none in mm."""
        return status.position(self._at, "mm")

    @property
    def position_deg(self) -> float:
        """The position in degrees; otherwise like :attr:`position`. Only rotary stages have one."""
        return status.position(self._at, "deg")

    @property
    def position_counts(self) -> int:
        """The position in counts, for which no scale is required; each access sends a request."""
        return status.position_counts(self._at)

    @property
    def travel(self) -> tuple[float, float] | None:
        """The lowest and highest position of moves, in the unit of :attr:`position`; None if unknown.

        It is known if both ends were passed to ``open``, as ``travel_mm=12``. Nothing is sent.
        """
        return status.travel(self._at)

    def is_homed(self, *, timeout: float | None = None) -> bool:
        """Ask the controller whether the stage is homed.

        Raise :class:`~stagewire.errors.UnsupportedError` for a unit that does not report it.
        """
        return status.is_homed(self._at, timeout)

    def wait_for(self, bit: str, *, on: bool = True, timeout: float | None = None) -> Values[Any]:
        """Wait until a bit of the status is set, and return the status.

        The status is requested every 50 ms. Nothing moves or stops.

        :param bit: name of the bit, such as ``homed`` or ``moving_forward``; an unknown name lists those of
            the unit.
        :param on: False: wait until the bit is clear.
        :param timeout: in seconds; default: the timeout of motions.

        Raise :class:`~stagewire.errors.BadValueError` for an unknown bit,
        :class:`~stagewire.errors.UnsupportedError` for a unit without status bits, and
        :class:`~stagewire.errors.MotionTimeoutError`.
        """
        return status.wait_for(self._at, bit, timeout, on=on)

    def is_enabled(self, *, timeout: float | None = None) -> bool:
        """Ask the controller whether the channel is enabled.

        Raise :class:`~stagewire.errors.UnsupportedError` for a unit without motor channels that can be
        enabled.
        """
        check_enabling(self._at.connection.unit, dir(self))
        return readiness.is_enabled(self._at, timeout)

    def enable(self, *, timeout: float | None = None) -> None:
        """Enable the channel, and read its state back. No motion enables a channel by itself.

        Raise :class:`~stagewire.errors.NotReadyError` if the controller still reports it as disabled, and the
        errors of :meth:`is_enabled`.
        """
        check_enabling(self._at.connection.unit, dir(self))
        readiness.switch_channel(self._at, timeout, on=True)

    def disable(self, *, timeout: float | None = None) -> None:
        """Disable the channel, and read its state back. The motor releases its load.

        Raise :class:`~stagewire.errors.NotReadyError` if the controller still reports it as enabled, and the
        errors of :meth:`is_enabled`.
        """
        check_enabling(self._at.connection.unit, dir(self))
        readiness.switch_channel(self._at, timeout, on=False)

    def snapshot(self, *, timeout: float | None = None) -> dict[str, Any]:
        """Read all settings of this channel, and return them as plain data.

        ``{"unit": "KDC101", "settings": {"vel_params": {"max_velocity": 767367, …}, …}}``: numbers in counts,
        by the names of the ``set_`` methods and of their keywords. It can be stored as JSON. A set that the
        controller does not report is left out, with a warning in the log. Counters of positions are left out.

        :param timeout: of each request, in seconds.
        """
        return snapshots.snapshot(self._at, timeout)

    def restore(
        self,
        snapshot: Mapping[str, Any],
        *,
        tuning: bool = False,
        timeout: float | None = None,
    ) -> tuple[str, ...]:
        """Write back the settings of a snapshot that differ from those that the controller has now.

        Nothing moves: sets that open, move, enable or change an output are not written. Control loops and the
        drive of motors are written only with ``tuning=True``. All values are checked before the first set is
        written. Nothing is saved permanently.

        :param timeout: of each request, in seconds.
        :return: the names of the sets that were written.

        Raise :class:`~stagewire.errors.BadValueError` for anything but a snapshot of the same unit,
        :class:`~stagewire.errors.OutOfRangeError`, and :class:`~stagewire.errors.LimitError` for a value
        above a limit of the stage.
        """
        return snapshots.restore(self._at, snapshot, timeout, tuning=tuning)

    def apply_stage_defaults(self, *, timeout: float | None = None) -> tuple[Values[Any], ...]:
        """Write the parameters with which the vendor's program drives the stage on this channel.

        These are home, velocity, jog and limit switch parameters, as far as the registry has them for the
        stage and the unit supports them; ``stage.defaults`` lists them. Other parameters are not changed, and
        no other call does this. Each set is read, changed and written.

        :return: the sets that were written.

        Raise :class:`~stagewire.errors.UnsupportedError` without a stage, or for one without such parameters;
        :class:`~stagewire.errors.NotReadyError` if the registry lacks a value that motions need and the
        controller holds one that cannot work; :class:`~stagewire.errors.UnknownScaleError` and
        :class:`~stagewire.errors.LimitError`. Then nothing was written.
        """
        return defaults.apply_defaults(self._at, timeout)


class Bay(Channel):
    """A bay of a rack: a controller with one channel."""


class Axis(Channel):
    """An axis of a controller whose commands have no frame."""


C = TypeVar("C", bound=Channel)
B = TypeVar("B", bound=Part)


class ChannelsBay(ChannelsBase[C], Part, Generic[C]):
    """A bay of a rack: a controller with several channels."""
