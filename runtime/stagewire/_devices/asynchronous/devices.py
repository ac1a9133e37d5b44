"""Base classes of generated devices for asyncio. Each device belongs to one event loop.

:mod:`stagewire._devices.synchronous.devices` contains the same classes for threads.
"""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from typing import TYPE_CHECKING, Any, Generic, Self, TypeVar, Unpack

from stagewire._devices.asynchronous import positions
from stagewire._devices.asynchronous.handshake import greet, leave, wait_for_timeouts
from stagewire._devices.asynchronous.parts import Axis, Channel, Part
from stagewire._devices.asynchronous.transport import (
    CommandTransport,
    FramedTransport,
    open_session,
)
from stagewire._devices.endpoint import CONTROLLER
from stagewire._devices.locks import AsyncLocks
from stagewire._devices.opening import Opening
from stagewire._devices.options import OpenOptions, check_guest
from stagewire._devices.structure import (
    AxesBase,
    BaysBase,
    ChannelsBase,
    DeviceBase,
    connect,
    url_of,
)
from stagewire._devices.unit import commanded, framed
from stagewire._links.link import AsyncClosing, AsyncLink
from stagewire._links.usb import usb_url
from stagewire._sessions.asynchronous import AsyncCommandSession, AsyncFramedSession
from stagewire._sessions.command_exchanges import in_low_level, switching
from stagewire.errors import (
    LinkOpenError,
    ReplyTimeoutError,
    SessionClosedError,
    StagewireError,
    UnsupportedError,
)

if TYPE_CHECKING:
    from types import TracebackType

    from stagewire._devices.connection import Connection
    from stagewire._sessions.command_exchanges import Mode


C = TypeVar("C", bound=Channel)
B = TypeVar("B", bound=Part)
X = TypeVar("X", bound=Axis)


class _Opened(DeviceBase, Part, AsyncClosing):
    """An open controller of any kind; a context manager."""

    _link: str | AsyncLink | Device

    def __init__(self, connection: Connection[Any]) -> None:
        super().__init__(connection)
        self._locks = AsyncLocks()
        self._opened = 0  # how many times the line was reopened

    @classmethod
    def open(
        cls, url: str | AsyncLink | None = None, **options: Unpack[OpenOptions]
    ) -> Opening[Self]:
        """Open a line and return the controller on it, to await or to enter. Nothing moves.

        ``async with TDC001.open(url) as tdc:`` closes it at the end. After ``tdc = await TDC001.open(url)``,
        call :meth:`close`.

        :param url: such as ``/dev/ttyUSB0``, ``COM3``, ``usb://83812345``, ``socket://host:4001`` or
            ``virtual://TDC001``. If it is left out, the USB port of ``serial_number=`` is opened.

        For the options, see :class:`~stagewire.devices.OpenOptions`. Raise
        :class:`~stagewire.errors.LinkOpenError`, :class:`~stagewire.errors.WrongUnitError`,
        :class:`~stagewire.errors.ReplyTimeoutError`, :class:`~stagewire.errors.BadValueError` and
        :class:`~stagewire.errors.UnknownScaleError`.
        """
        return cls._open(url, options)

    @classmethod
    def _open(
        cls, link: str | AsyncLink | Device | None, options: OpenOptions, bay: int = 1
    ) -> Opening[Self]:
        if link is None:
            link = usb_url(options.get("serial_number"))
        if isinstance(link, Device):
            check_guest(cls.unit, options, link.unit.name)
            while isinstance(link._link, Device):  # a guest itself
                link = link._link
        device = cls(connect(cls, url_of(link), options, bay))
        device._link = link
        return Opening(device)

    async def _connect(self) -> None:
        """Open the line and identify the controller."""
        raise NotImplementedError

    async def reconnect(self) -> None:
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
        if isinstance(self._link, AsyncLink):
            raise LinkOpenError(
                f"{self.url} was not opened by this device and cannot be reopened; "
                "open a new link, and the device on it"
            )
        before = self._opened
        async with self._locks.lock("reconnect", f"{self._at.name}: reconnect", None):
            session = self.session
            if self._opened != before and not (session.lost or session.closed):
                return
            await self.close()
            self._at.connection.broken_at = session.broken_at
            self._at.connection.forget()
            await self._connect()
            self._opened += 1

    async def __aenter__(self) -> Self:
        if self.session.closed:
            raise SessionClosedError(
                f"{self._at.name} at {self.url} was closed: call reconnect(), or open it again"
            )
        return self

    async def __aexit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        await self._leave(aborted=kind is not None)

    @property
    def left_moving(self) -> tuple[str, ...]:
        """The motions that may continue after :meth:`close`, such as ``TDC001: move_absolute``.

        They are those that were started here and whose end is unknown, if the device was opened with
        ``on_close="leave"`` or if the line was lost, so that no stop could be sent. Empty before
        :meth:`close`.
        """
        return self._at.connection.left_moving

    async def close(self) -> None:
        """Stop the motions started here, unless ``on_close`` is ``leave``, and close the line.

        The updates that were started here are stopped. At the end of a ``with`` block that an exception ends,
        the controller is also told that the host disconnects, if its unit has such a message. The stops are
        sent first. Closing a closed device does nothing.

        Motions that may continue are logged as a warning, and listed in :attr:`left_moving`.
        """
        await self._leave(aborted=False)

    async def _leave(self, *, aborted: bool) -> None:
        connection, session = self._at.connection, self.session
        if not session.closed:
            connection.aborted = aborted
            connection.note_motions(lost=session.lost)
        if isinstance(self._link, Device):
            await leave(connection)
            with suppress(ValueError):  # closed before
                self._link.session.on_close.remove(connection.last_words)
        await connection.transport.close()


class Device(_Opened):
    """An open controller whose messages have frames."""

    async def _connect(self) -> None:
        connection = self._at.connection
        host = self._link
        if guest := isinstance(host, Device):
            session = host.session
        else:
            session = await open_session(AsyncFramedSession, framed(self.facts), host, connection)
        transport = FramedTransport(session, connection.telling, guest)
        try:
            await greet(connection, self._at, transport)
        except BaseException as error:
            # It may still receive, and an earlier motion may still be under way.
            if isinstance(error, ReplyTimeoutError):
                session.on_close.append(connection.last_words)
            if guest:
                await leave(connection)
            await transport.close()
            raise
        connection.aborted = not guest  # until it is closed
        session.on_close.insert(0, connection.last_words)  # before the owner of the line ends it

    @property
    def session(self) -> AsyncFramedSession:
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
    async def position(self) -> int | None:
        """The position that the controller reports, counted from 1; None if it reports none.

        It reports none while it moves. Each access sends a request.
        """
        return await positions.position_of(self._at)

    async def move_to(self, position: int, *, timeout: float | None = None) -> None:
        """Move to a position, and wait until the controller reports it.

        No move is sent if it reports this position already.

        :param position: counted from 1.
        :param timeout: in seconds; default: twice the transit time, and the timeout of the device.

        Raise :class:`~stagewire.errors.OutOfRangeError` and :class:`~stagewire.errors.BadValueError` for a
        position that does not exist, and :class:`~stagewire.errors.MotionTimeoutError` if the position is not
        reported in time; the move is not sent again.
        """
        await positions.move_to(self._at, position, timeout)

    @property
    async def transit_time(self) -> int:
        """The time of a move between two positions in ms; each access sends a request."""
        return await positions.transit_time(self._at)

    async def set_transit_time(self, milliseconds: int, *, timeout: float | None = None) -> None:
        """Set the time of a move in ms, and keep the other parameters of its set.

        The unit also needs this time in its own counts, which are computed as the document describes.

        Raise :class:`~stagewire.errors.OutOfRangeError` and :class:`~stagewire.errors.BadValueError` for an
        invalid time, and the errors of the ``change_`` methods.
        """
        await positions.set_transit_time(self._at, milliseconds, timeout)


class ChannelsDevice(ChannelsBase[C], Device, Generic[C]):
    """A controller with several channels."""


class RackDevice(BaysBase[B], Device, Generic[B]):
    """A rack: calls of the device go to the motherboard, calls of a bay to the controller in it."""


class _Module(Device):
    """A controller in a bay of a rack."""

    @classmethod
    def open(
        cls,
        url: str | AsyncLink | Device | None = None,
        bay: int = 1,
        **options: Unpack[OpenOptions],
    ) -> Opening[Self]:
        """Open a line to a rack and return the controller in a bay, counted from 1: bay 1 is 0x21.

        :param url: as in :meth:`Device.open`; or another open module of the rack, to share its line. Closing
            that module closes the line; closing this one leaves it open.

        Raise the errors of :meth:`Device.open`, and :class:`~stagewire.errors.OutOfRangeError` for a bay that
        does not exist.
        """
        return cls._open(url, options, bay)


class SingleChannelModule(_Module, Channel):
    """A controller with one channel in a bay of a rack; the device itself is the channel."""


class ModuleDevice(ChannelsBase[C], _Module, Generic[C]):
    """A controller with several channels in a bay of a rack."""


class AxesDevice(AxesBase[X], _Opened, Generic[X]):
    """A controller of axes, whose commands have no frame and whose replies contain only values.

    It expects either commands or lines of text, depending on its mode. Opening it sends nothing. Begin with
    :meth:`low_level`, or with the documented command that switches the mode.
    """

    async def _connect(self) -> None:
        connection = self._at.connection
        assert not isinstance(self._link, Device)  # only modules share a line
        session = await open_session(
            AsyncCommandSession,
            commanded(self.facts),
            self._link,
            connection,
            refuse_prefix_bytes=connection.choices.refuse_prefix_bytes,
        )
        connection.transport = CommandTransport(session)
        await wait_for_timeouts(connection)
        session.on_close.append(self._last_words)

    @property
    def mode(self) -> Mode:
        """The mode of the controller, if the session knows it: ``low_level``, ``high_level``, ``unknown``."""
        return self.session.mode

    @asynccontextmanager
    async def low_level(self, *, timeout: float | None = None) -> AsyncIterator[Self]:
        """Switch the controller to commands within the block, and back to lines of text after it.

        :param timeout: seconds for each of the two commands that switch the mode.

        Raise :class:`~stagewire.errors.UnsupportedError` for a controller without such a command.
        """
        await self._switch("low_level", timeout)
        try:
            yield self
        except BaseException:
            with suppress(StagewireError):  # the line may be lost; the first error matters more
                await self._switch("high_level", timeout)
            raise
        await self._switch("high_level", timeout)

    async def _switch(self, format: str, timeout: float | None) -> None:
        command = switching(commanded(self.facts), format)
        if command is None:
            raise UnsupportedError(
                f"{self._at.name} has no command to switch to its {format} format"
            )
        await self._at.transport.send(command(), CONTROLLER, self._at.seconds(timeout))

    def _last_words(self) -> bytes:
        """Return the stops to send before the link is closed, in the low-level format."""
        stops = self._at.connection.last_words()
        return in_low_level(commanded(self.facts), stops, self.session.mode) if stops else b""

    async def text(self, line: str, *, timeout: float | None = None) -> str:
        """Send a line of text and return the reply, both without line ends.

        Raise :class:`~stagewire.errors.WrongModeError` unless the controller expects text, and
        :class:`~stagewire.errors.ReplyTimeoutError`.
        """
        return await self.session.text(line, self._at.seconds(timeout))

    @property
    def session(self) -> AsyncCommandSession:
        """The session of the device, for messages without a method."""
        transport = self._at.transport
        assert isinstance(transport, CommandTransport)
        return transport.session
