"""Sessions for asyncio: requests to controllers and their replies, as awaitable calls.

:mod:`stagewire._sessions.loop_driver` explains how tasks share a link.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from stagewire._framings.header.frame import Frame
from stagewire._framings.header.message import FramedMessage
from stagewire._framings.header.protocol import FramedProtocol
from stagewire._framings.slots.command import Command, Reply, SetupCommand
from stagewire._framings.slots.protocol import CommandProtocol
from stagewire._links.link import AsyncLink
from stagewire._sessions.awaiting import AsyncSession
from stagewire._sessions.commands import CommandCore
from stagewire._sessions.exchange import Exchange
from stagewire._sessions.framed import FramedCore
from stagewire._sessions.loop_driver import async_clock_of
from stagewire._sessions.options import Ends, SessionOptions
from stagewire._sessions.recording import Recording

if TYPE_CHECKING:
    from stagewire._sessions.command_exchanges import Mode


class AsyncFramedSession(AsyncSession[FramedCore]):
    """A conversation with the controllers of one line, whose messages have frames.

    :param protocol: the protocol of the line.
    :param link: the link, open and not started; the session owns it from now on.
    :param options: timeouts and pauses.
    :param log: a file for a capture of all bytes; existing contents are replaced.
    :param unit: the name of the unit, for the capture.

    Raises :class:`~stagewire.errors.TransportError` for a log that cannot be written.
    """

    def __init__(
        self,
        protocol: FramedProtocol,
        link: AsyncLink,
        *,
        options: SessionOptions | None = None,
        log: str | Path | None = None,
        unit: str | None = None,
    ) -> None:
        core = FramedCore(protocol, options=options)
        self.options = core.options
        recording = None if log is None else Recording(log, protocol, async_clock_of(link), unit)
        super().__init__(core, link, recording=recording)

    async def ask(
        self,
        message: FramedMessage,
        replies: tuple[type[FramedMessage], ...],
        dest: int,
        timeout: float | None = None,
    ) -> Frame:
        """Send a request and return the frame of its reply.

        :param replies: the classes of its possible replies.
        :param timeout: seconds; None: ``reply_timeout`` of the options.

        Raises :class:`~stagewire.errors.ReplyTimeoutError`, :class:`~stagewire.errors.TransportLostError` and
        :class:`~stagewire.errors.SessionClosedError`.
        """
        seconds = self.options.reply_timeout if timeout is None else timeout
        core = self._core
        frame: Frame = await self.perform(
            lambda now: core.ask(message, replies, dest, seconds, now)
        )
        return frame

    async def send(self, message: FramedMessage, dest: int, timeout: float | None = None) -> None:
        """Send a message that has no reply, and return when its bytes were handed to the link.

        Raises the errors of :meth:`ask`. A :class:`~stagewire.errors.ReplyTimeoutError` means that earlier
        exchanges delayed it too long.
        """
        seconds = self.options.reply_timeout if timeout is None else timeout
        core = self._core
        await self.start(lambda now: core.send(message, dest, seconds, now))

    async def begin(
        self,
        message: FramedMessage,
        ends: Ends,
        dest: int,
        timeout: float | None = None,
        on_done: Callable[[Exchange], object] | None = None,
    ) -> Exchange:
        """Begin a motion, and return when its command was handed to the link; :meth:`wait` waits for its end.

        :param ends: the classes of the messages that report its end.
        :param timeout: seconds until the end; None: ``motion_timeout`` of the options.
        :param on_done: called once at its end; must not call a session.

        Raises :class:`~stagewire.errors.MotionUnderWayError` if another motion may be in progress, and the
        errors of :meth:`ask`.
        """
        seconds = self.options.motion_timeout if timeout is None else timeout
        core = self._core
        return await self.start(lambda now: core.begin(message, ends, dest, seconds, now), on_done)

    async def halt(
        self,
        message: FramedMessage,
        ends: Ends | None,
        dest: int,
        timeout: float | None = None,
    ) -> Frame | None:
        """Stop a motion, before everything else that waits, and return the frame that reports the stop.

        :param ends: the classes of the messages that report the stop; None: there are none, and this returns
            when the stop was handed to the link.
        :param timeout: seconds; None: ``reply_timeout`` of the options.

        Raises the errors of :meth:`ask`.
        """
        seconds = self.options.reply_timeout if timeout is None else timeout
        core = self._core
        if ends is None:
            await self.start(lambda now: core.halt(message, None, dest, seconds, now), is_stop=True)
            return None
        frame: Frame = await self.perform(
            lambda now: core.halt(message, ends, dest, seconds, now), is_stop=True
        )
        return frame

    def settled(self, dest: int, channel: int | None) -> None:
        """Note that no motion is in progress there any more, as a status shows."""
        with self._lock:
            self._core.settled(dest, channel)

    def keep_alive(
        self, message: FramedMessage | None, addresses: tuple[int, ...], period: float = 0.5
    ) -> None:
        """Send a keep-alive message to each address every ``period`` seconds, whatever else happens.

        :param message: the keep-alive message; None: stop sending to these addresses, or to all if none are
            given.
        """
        with self._lock:
            self._core.keep_alive(message, addresses, period)
        self._reschedule()

    def tell(self, source: int, **context: str) -> None:
        """Set the context that selects layouts of messages from ``source``; see :meth:`.Framer.tell`."""
        with self._lock:
            self._core.tell(source, **context)


class AsyncCommandSession(AsyncSession[CommandCore]):
    """A conversation with the single controller of a line, whose replies have no frame.

    :param protocol: the protocol of the line.
    :param link: the link, open and not started; the session owns it from now on.
    :param options: timeouts and pauses.
    :param refuse_prefix_bytes: refuse values whose bytes a controller might take for a setup command; see
        :meth:`.CommandFrame.encode`.
    :param log: a file for a capture of all bytes; existing contents are replaced.
    :param unit: the name of the unit, for the capture.

    Raises :class:`~stagewire.errors.TransportError` for a log that cannot be written.
    """

    def __init__(
        self,
        protocol: CommandProtocol,
        link: AsyncLink,
        *,
        options: SessionOptions | None = None,
        refuse_prefix_bytes: bool = False,
        log: str | Path | None = None,
        unit: str | None = None,
    ) -> None:
        core = CommandCore(protocol, options=options, refuse_prefix_bytes=refuse_prefix_bytes)
        self.options = core.options
        recording = None if log is None else Recording(log, protocol, async_clock_of(link), unit)
        super().__init__(core, link, recording=recording)

    @property
    def mode(self) -> Mode:
        """The mode of the controller, as far as this session has set it."""
        return self._core.mode

    async def ask(self, message: Command, axis: int, timeout: float | None = None) -> Reply:
        """Send a command and return its reply.

        :param timeout: seconds; None: ``reply_timeout`` of the options.

        Raises :class:`~stagewire.errors.WrongModeError` unless the controller accepts commands,
        :class:`~stagewire.errors.ReplyTimeoutError`, :class:`~stagewire.errors.TransportLostError` and
        :class:`~stagewire.errors.SessionClosedError`.
        """
        seconds = self.options.reply_timeout if timeout is None else timeout
        core = self._core
        reply: Reply = await self.perform(lambda now: core.ask(message, axis, seconds, now))
        return reply

    async def send(
        self,
        message: Command | SetupCommand,
        axis: int | None = None,
        timeout: float | None = None,
    ) -> None:
        """Send a command that has no reply, and return when its bytes were handed to the link.

        :param axis: None for a setup command, which is for the whole controller and valid in any mode.

        Raises the errors of :meth:`ask`. A :class:`~stagewire.errors.ReplyTimeoutError` means that earlier
        exchanges delayed it too long.
        """
        seconds = self.options.reply_timeout if timeout is None else timeout
        core = self._core
        await self.start(lambda now: core.send(message, axis, seconds, now))

    async def halt(self, message: Command, axis: int, timeout: float | None = None) -> None:
        """Send a stop, before everything else, even while a reply is awaited.

        Raises the errors of :meth:`ask`.
        """
        seconds = self.options.reply_timeout if timeout is None else timeout
        core = self._core
        await self.start(lambda now: core.halt(message, axis, seconds, now), is_stop=True)

    async def text(self, line: str, timeout: float | None = None) -> str:
        """Send a line of text and return the line of the reply. Both are without line ends.

        Raises the errors of :meth:`ask`, but :class:`~stagewire.errors.WrongModeError` unless the controller
        accepts text.
        """
        seconds = self.options.reply_timeout if timeout is None else timeout
        core = self._core
        answer: str = await self.perform(lambda now: core.text(line, seconds, now))
        return answer
