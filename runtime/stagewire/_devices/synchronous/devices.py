# Generated from _devices/asynchronous/devices.py by `python tools/unasync.py`; do not edit.

"""Base classes of generated devices for threads. Any thread may make any call."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, Literal, Self, TypeVar

from stagewire._devices.endpoint import CONTROLLER
from stagewire._devices.locks import Locks
from stagewire._devices.options import Length, OpenOptions, check_guest
from stagewire._devices.structure import (
    AxesBase,
    BaysBase,
    ChannelsBase,
    DeviceBase,
    connect,
    url_of,
)
from stagewire._devices.synchronous import positions
from stagewire._devices.synchronous.handshake import greet, leave, wait_for_timeouts
from stagewire._devices.synchronous.parts import Axis, Channel, Part
from stagewire._devices.synchronous.transport import (
    CommandTransport,
    FramedTransport,
    open_session,
)
from stagewire._devices.unit import commanded, framed
from stagewire._links.link import Closing, Link
from stagewire._links.usb import usb_url
from stagewire._sessions.command_exchanges import in_low_level, switching
from stagewire._sessions.synchronous import CommandSession, FramedSession
from stagewire.errors import (
    LinkOpenError,
    ReplyTimeoutError,
    SessionClosedError,
    StagewireError,
    UnsupportedError,
)
from stagewire.quantities import Number, Stage

if TYPE_CHECKING:
    from types import TracebackType

    from stagewire._devices.connection import Connection
    from stagewire._sessions.command_exchanges import Mode


C = TypeVar("C", bound=Channel)
B = TypeVar("B", bound=Part)
X = TypeVar("X", bound=Axis)
D = TypeVar("D", bound="_Opened")  # editors that use jedi do not complete the members of Self


class _Opened(DeviceBase, Part, Closing):
    """An open controller of any kind; a context manager."""

    _link: str | Link | Device

    def __init__(self, connection: Connection[Any]) -> None:
        super().__init__(connection)
        self._locks = Locks()
        self._opened = 0  # how many times the line was reopened

    @classmethod
    def open(
        cls: type[D],
        url: str | Link | Device | None = None,
        *,
        bay: int | None = None,
        stage: Stage | str | None = None,
        scale_source: str | None = None,
        stages: Mapping[Any, Stage | str] | None = None,
        travel_mm: Length | Mapping[Any, Length] | None = None,
        travel_deg: Length | Mapping[Any, Length] | None = None,
        max_velocity_mm_per_s: Number | Mapping[Any, Number] | None = None,
        max_acceleration_mm_per_s2: Number | Mapping[Any, Number] | None = None,
        max_velocity_deg_per_s: Number | Mapping[Any, Number] | None = None,
        max_acceleration_deg_per_s2: Number | Mapping[Any, Number] | None = None,
        target_tolerance_mm: Number | None = None,
        target_tolerance_deg: Number | None = None,
        target_tolerance_counts: int | None = None,
        max_volts: Number | None = None,
        max_travel_um: Number | None = None,
        settings: Mapping[str, Number] | None = None,
        serial_number: int | None = None,
        model: str | None = None,
        address: int | None = None,
        baudrate: int | None = None,
        rtscts: bool | None = None,
        line: Literal["usb", "rs232"] = "usb",
        timeout: float = 1.0,
        motion_timeout: float = 60.0,
        pacing: float | None = None,
        reconnect_pause: float = 1.5,
        on_close: Literal["stop", "leave"] = "stop",
        background: bool = True,
        identify: bool = True,
        log: str | Path | None = None,
        refuse_prefix_bytes: bool = False,
    ) -> D:
        """Open a line and return the controller on it. Nothing moves.

        The output of a laser or heater is switched off, unless ``on_close`` is ``leave``.

        :param url: such as ``/dev/ttyUSB0``, ``COM3``, ``usb://83812345``, ``socket://host:4001`` or
            ``virtual://TDC001``. If it is left out, the USB port of ``serial_number=`` is opened. For a
            module of a rack, also another open module, to share its line: closing that module closes the
            line, closing this one leaves it open.
        :param bay: bay of a module in its rack, counted from 1, which is also the default: bay 1 is 0x21
        :param stage: stage on every channel: a :class:`Stage`, or its name in the registry or in the
            catalogue of the vendor (``MTS25/M-Z8``). The default is the stage that is built into the unit or
            that the controller reports. It determines the scales; without it only raw counts can be used.
        :param scale_source: source whose figures are used where the sources for the scales of a stage
            contradict each other, such as ``document`` or ``vendor``. Without it such scales are unknown.
        :param stages: stages by channel number, bay number or name of the axis, if they differ
        :param travel_mm: travel of the stage: from 0 to this value, or ``(low, high)``; or a mapping by
            channel as in ``stages``. Targets outside are refused. The default limit is the length of the
            travel in the registry, if known.
        :param travel_deg: travel of a rotary stage; otherwise like ``travel_mm``
        :param max_velocity_mm_per_s: maximum velocity; or a mapping by channel as in ``stages``. It replaces
            the limit of the stage in the registry, and may be higher.
        :param max_acceleration_mm_per_s2: maximum acceleration; otherwise like ``max_velocity_mm_per_s``
        :param max_velocity_deg_per_s: maximum velocity of a rotary stage; otherwise like
            ``max_velocity_mm_per_s``
        :param max_acceleration_deg_per_s2: maximum acceleration of a rotary stage; otherwise like
            ``max_velocity_mm_per_s``
        :param target_tolerance_mm: how far from its target a motion may end, on every channel whose scale is
            known and in mm. If it ends further away, :class:`~stagewire.errors.TargetNotReachedError` is
            raised. The default is 0.01 mm, or 500 counts if the scale is unknown.
        :param target_tolerance_deg: the same on every channel with a rotary stage; the default is 0.1
            degrees
        :param target_tolerance_counts: the same in counts on every channel, with or without a known scale;
            use it without the other two
        :param max_volts: rating of the actuator. Voltages above it are refused, and so is a range of the
            controller above it. Without it, the limit that the controller has set is not raised.
        :param max_travel_um: travel of the actuator, if the controller is not asked for it or does not
            report it
        :param settings: other settings that scales depend on, for a controller that is not asked for them or
            does not report them, by name and in their units: ``{"diode_full_scale": 220}``, or
            ``{"maximum_volts": 75}`` for the output voltage at full scale
        :param serial_number: expected serial number; opening a controller with a different one fails
        :param model: name of a controller that is newer than the document: ``BSC203`` for one that is opened
            as ``BSC103``. Its scales are used, and opening another controller fails. By default the serial
            number and the reported model decide.
        :param address: address of the controller, if it differs from the documented one
        :param baudrate: baud rate of a serial port; None: 115200, or 9600 for controllers whose commands
            have no frame
        :param rtscts: hardware handshake; None: the default of the port
        :param line: type of the line. On ``usb``, the default, keep-alive messages are sent to controllers
            that need them.
        :param timeout: timeout of a call in seconds
        :param motion_timeout: timeout of a motion in seconds
        :param pacing: pause after a message without a reply, in seconds; None: as the unit requires
        :param reconnect_pause: seconds from the loss of a line until ``reconnect()`` sends anything. It must
            be longer than the controller waits for the rest of a message.
        :param on_close: whether motions started here are stopped or left running when the device is closed
            or the program ends. With ``leave``, the output of a laser or heater also stays as it is, now and
            then.
        :param background: whether a background thread reads messages and keeps the controller alive. Only the
            classes for threads have one.
        :param identify: whether to ask the controller for its identity and for the settings that its scales
            depend on. If False, the scales are those of ``model``, or else of the class.
        :param log: file for a capture of both directions
        :param refuse_prefix_bytes: whether to refuse values whose bytes look like a setup command (command
            protocols only)

        Raise :class:`~stagewire.errors.LinkOpenError`, :class:`~stagewire.errors.WrongUnitError`,
        :class:`~stagewire.errors.ReplyTimeoutError`, :class:`~stagewire.errors.BadValueError`,
        :class:`~stagewire.errors.UnknownScaleError`, and :class:`~stagewire.errors.OutOfRangeError` for a bay
        that does not exist.
        """
        options = OpenOptions(
            stage=stage,
            scale_source=scale_source,
            stages=stages,
            travel_mm=travel_mm,
            travel_deg=travel_deg,
            max_velocity_mm_per_s=max_velocity_mm_per_s,
            max_acceleration_mm_per_s2=max_acceleration_mm_per_s2,
            max_velocity_deg_per_s=max_velocity_deg_per_s,
            max_acceleration_deg_per_s2=max_acceleration_deg_per_s2,
            target_tolerance_mm=target_tolerance_mm,
            target_tolerance_deg=target_tolerance_deg,
            target_tolerance_counts=target_tolerance_counts,
            max_volts=max_volts,
            max_travel_um=max_travel_um,
            settings=settings,
            serial_number=serial_number,
            model=model,
            address=address,
            baudrate=baudrate,
            rtscts=rtscts,
            line=line,
            timeout=timeout,
            motion_timeout=motion_timeout,
            pacing=pacing,
            reconnect_pause=reconnect_pause,
            on_close=on_close,
            background=background,
            identify=identify,
            log=log,
            refuse_prefix_bytes=refuse_prefix_bytes,
        )
        link = usb_url(serial_number) if url is None else url
        if isinstance(link, Device):
            check_guest(cls.unit, options, link.unit.name)
            while isinstance(link._link, Device):  # a guest itself
                link = link._link
        device = cls(connect(cls, url_of(link), options, bay))
        device._link = link
        device._connect()
        return device

    def _connect(self) -> None:
        """Open the line and identify the controller."""
        raise NotImplementedError

    def reconnect(self) -> None:
        """Open the line again with the same options, and read the identity and the settings again.

        Nothing is sent again. A motion that was under way when the line was lost or closed may still be. The
        status is therefore read before the next motion there, which is refused
        (:class:`~stagewire.errors.MotionUnderWayError`) if the stage moves or has no status. A capture
        continues in a new file: ``session-2.txt`` follows ``session.txt``.

        After a loss, wait ``reconnect_pause`` seconds before sending anything, so that the controller
        discards a message that was cut off. If the controller does not answer, the stops of motions that may
        be under way are sent before the line is closed. If another call is already reconnecting, wait for it
        and use its line.

        Raise the errors of :meth:`open`, :class:`~stagewire.errors.WrongUnitError` for a different serial
        number than before, and :class:`~stagewire.errors.LinkOpenError` for a line that was not opened by a
        URL.
        """
        if isinstance(self._link, Link):
            raise LinkOpenError(
                f"{self.url} was not opened by this device and cannot be reopened; "
                "open a new link, and the device on it"
            )
        before = self._opened
        with self._locks.lock("reconnect", f"{self._at.name}: reconnect", None):
            session = self.session
            if self._opened != before and not (session.lost or session.closed):
                return
            self.close()
            self._at.connection.broken_at = session.broken_at
            self._at.connection.forget()
            self._connect()
            self._opened += 1

    def __enter__(self: D) -> D:
        if self.session.closed:
            raise SessionClosedError(
                f"{self._at.name} at {self.url} was closed: call reconnect(), or open it again"
            )
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._leave(aborted=kind is not None)

    @property
    def left_moving(self) -> tuple[str, ...]:
        """The motions that may continue after :meth:`close`, such as ``TDC001: move_absolute``.

        They are those that were started here and whose end is unknown, if the device was opened with
        ``on_close="leave"`` or if the line was lost, so that no stop could be sent. Empty before
        :meth:`close`.
        """
        return self._at.connection.left_moving

    def close(self) -> None:
        """Stop the motions started here, unless ``on_close`` is ``leave``, and close the line.

        The output of a laser or heater is switched off, whatever switched it on.

        The updates that were started here are stopped. At the end of a ``with`` block that an exception ends,
        the controller is also told that the host disconnects, if its unit has such a message. The stops are
        sent first. Closing a closed device does nothing.

        Motions that may continue are logged as a warning, and listed in :attr:`left_moving`.
        """
        self._leave(aborted=False)

    def _leave(self, *, aborted: bool) -> None:
        connection, session = self._at.connection, self.session
        if not session.closed:
            connection.aborted = aborted
            connection.note_motions(lost=session.lost)
        if isinstance(self._link, Device):
            leave(connection)
            with suppress(ValueError):  # closed before
                self._link.session.on_close.remove(connection.last_words)
        connection.transport.close()


class Device(_Opened):
    """An open controller whose messages have frames."""

    def _connect(self) -> None:
        connection = self._at.connection
        host = self._link
        if guest := isinstance(host, Device):
            session = host.session
        else:
            session = open_session(FramedSession, framed(self.facts), host, connection)
        transport = FramedTransport(session, connection.telling, guest)
        try:
            greet(connection, self._at, transport)
        except BaseException as error:
            # It may still receive, and an earlier motion may still be under way.
            if isinstance(error, ReplyTimeoutError):
                session.on_close.append(connection.last_words)
            if guest:
                leave(connection)
            transport.close()
            raise
        connection.aborted = not guest  # until it is closed
        session.on_close.insert(0, connection.last_words)  # before the owner of the line ends it

    @property
    def session(self) -> FramedSession:
        """The session of the device, for messages without a method."""
        transport = self._at.transport
        assert isinstance(transport, FramedTransport)
        return transport.session


class SingleChannelDevice(Device, Channel):
    """A controller with one channel; the device itself is the channel."""


class PositionsDevice(SingleChannelDevice):
    """A controller that has only a few positions, such as a filter flipper; the device is the channel.

    It reports no end of a move, and a move cannot be stopped: neither :meth:`close` nor Ctrl-C stops it.
    """

    @property
    def position(self) -> int | None:  # type: ignore[override]  # not a length
        """The position that the controller reports, counted from 1; None if it reports none.

        It reports none while it moves. Each access sends a request.
        """
        return positions.position_of(self._at)

    def move_to(self, position: int, *, timeout: float | None = None) -> None:
        """Move to a position, and wait until the controller reports it.

        No move is sent if it reports this position already.

        :param position: counted from 1.
        :param timeout: in seconds; default: twice the transit time, and the timeout of the device.

        Raise :class:`~stagewire.errors.OutOfRangeError` and :class:`~stagewire.errors.BadValueError` for a
        position that does not exist, and :class:`~stagewire.errors.MotionTimeoutError` if the position is not
        reported in time; the move is not sent again.
        """
        positions.move_to(self._at, position, timeout)

    @property
    def transit_time(self) -> int:
        """The time of a move between two positions in ms; each access sends a request."""
        return positions.transit_time(self._at)

    def set_transit_time(self, milliseconds: int, *, timeout: float | None = None) -> None:
        """Set the time of a move in ms, and keep the other parameters of its set.

        The unit also needs this time in its own counts, which are computed as the document describes.

        Raise :class:`~stagewire.errors.OutOfRangeError` and :class:`~stagewire.errors.BadValueError` for an
        invalid time, and the errors of the ``change_`` methods.
        """
        positions.set_transit_time(self._at, milliseconds, timeout)


class ChannelsDevice(ChannelsBase[C], Device, Generic[C]):
    """A controller with several channels."""


class RackDevice(BaysBase[B], Device, Generic[B]):
    """A rack: calls of the device go to the motherboard, calls of a bay to the controller in it."""


class SingleChannelModule(Device, Channel):
    """A controller with one channel in a bay of a rack; the device itself is the channel."""


class ModuleDevice(ChannelsBase[C], Device, Generic[C]):
    """A controller with several channels in a bay of a rack."""


class AxesDevice(AxesBase[X], _Opened, Generic[X]):
    """A controller of axes, whose commands have no frame and whose replies contain only values.

    It expects either commands or lines of text, depending on its mode. Opening it sends nothing. Begin with
    :meth:`low_level`, or with the documented command that switches the mode.
    """

    def _connect(self) -> None:
        connection = self._at.connection
        assert not isinstance(self._link, Device)  # only modules share a line
        session = open_session(
            CommandSession,
            commanded(self.facts),
            self._link,
            connection,
            refuse_prefix_bytes=connection.choices.refuse_prefix_bytes,
        )
        connection.transport = CommandTransport(session)
        wait_for_timeouts(connection)
        session.on_close.append(self._last_words)

    @property
    def mode(self) -> Mode:
        """The mode of the controller, if the session knows it: ``low_level``, ``high_level``, ``unknown``."""
        return self.session.mode

    @contextmanager
    def low_level(self, *, timeout: float | None = None) -> Iterator[Self]:
        """Switch the controller to commands within the block, and back to lines of text after it.

        :param timeout: seconds for each of the two commands that switch the mode.

        Raise :class:`~stagewire.errors.UnsupportedError` for a controller without such a command.
        """
        self._switch("low_level", timeout)
        try:
            yield self
        except BaseException:
            with suppress(StagewireError):  # the line may be lost; the first error matters more
                self._switch("high_level", timeout)
            raise
        self._switch("high_level", timeout)

    def _switch(self, format: str, timeout: float | None) -> None:
        command = switching(commanded(self.facts), format)
        if command is None:
            raise UnsupportedError(
                f"{self._at.name} has no command to switch to its {format} format"
            )
        self._at.transport.send(command(), CONTROLLER, self._at.seconds(timeout))

    def _last_words(self) -> bytes:
        """Return the stops to send before the link is closed, in the low-level format."""
        stops = self._at.connection.last_words()
        return in_low_level(commanded(self.facts), stops, self.session.mode) if stops else b""

    def text(self, line: str, *, timeout: float | None = None) -> str:
        """Send a line of text and return the reply, both without line ends.

        Raise :class:`~stagewire.errors.WrongModeError` unless the controller expects text, and
        :class:`~stagewire.errors.ReplyTimeoutError`.
        """
        return self.session.text(line, self._at.seconds(timeout))

    @property
    def session(self) -> CommandSession:
        """The session of the device, for messages without a method."""
        transport = self._at.transport
        assert isinstance(transport, CommandTransport)
        return transport.session
