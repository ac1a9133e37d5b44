"""Motions of an axis: one at a time, the newest wins, and a missing end is noticed within seconds."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Awaitable, Callable
from contextlib import suppress
from typing import Any, Final, Protocol

from stagewire.errors import (
    MotionStoppedError,
    MotionTimeoutError,
    ReplyTimeoutError,
    SessionClosedError,
    StagewireError,
    TransportError,
)
from stagewire_epics.axis import OpenAxis, Reading
from stagewire_epics.records import PutRefusedError

POLL: Final = 0.1
"""Seconds between two readings during a motion."""
ANSWER: Final = 1.0
"""Seconds that a controller has to answer."""
SILENCE: Final = 2.5
"""Seconds without an answer after which a motion fails."""
REST: Final = 2.5
"""Seconds at rest, without a report of the end, after which a motion fails."""
DAY: Final = 86400.0
"""Seconds for the longest motion; the two above end a motion that cannot be followed."""


class Motion:
    """A motion that a client asked for.

    :param what: name of the motion, for errors.
    :param call: carries it out on an axis.
    :param target: its target in dial coordinates; None: unknown.
    :param endless: whether a stop is its normal end, as for a jog.
    """

    def __init__(
        self,
        what: str,
        call: Callable[[OpenAxis], Awaitable[None]],
        target: float | None = None,
        *,
        endless: bool = False,
    ) -> None:
        self.what = what
        self.call = call
        self.target = target
        self.endless = endless
        self.failure: StagewireError | None = None
        """Why it must not begin, or not continue."""
        self.interrupted = False
        """Whether it was stopped, or must not begin, until it may continue."""
        self.ended: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        """Its end for the client that asked for it."""

    def check(self) -> None:
        """Raise an error if the motion must not begin. Call it immediately before its frame is sent."""
        if self.failure is not None or self.interrupted:
            raise self.failure or MotionStoppedError(f"{self.what} waits for the end of a pause")

    def failed(self, error: StagewireError | None) -> StagewireError | None:
        """Return the error with which it ended; None for a normal end."""
        return None if self.endless and isinstance(error, MotionStoppedError) else error

    def answer(self, error: StagewireError | None) -> None:
        """Answer the client."""
        if not self.ended.done():
            if error is None:
                self.ended.set_result(None)
            else:
                self.ended.set_exception(error)
                self.ended.exception()  # a client that is gone does not ask for it


class Observer(Protocol):
    """Publishes the events of motions."""

    async def begun(self, motion: Motion) -> None:
        """Publish that a motion begins."""

    async def read(self, reading: Reading) -> None:
        """Publish the state of the axis."""

    async def silent(self, error: StagewireError) -> None:
        """Publish that the controller does not answer."""

    async def ended(self, motion: Motion, error: StagewireError | None) -> None:
        """Publish the end of a motion, and answer its client."""


class Motions:
    """The motions of an axis that may not be there yet.

    :param observer: publishes the events.
    """

    def __init__(self, observer: Observer) -> None:
        self._observer = observer
        self.axis: OpenAxis | None = None
        """The axis; None: the controller is not connected."""
        self.wanted: Motion | None = None
        """The motion that was asked for and has not ended."""
        self.paused = False
        """Whether motions wait."""
        self._polling = asyncio.Lock()
        self.held = False
        """Whether a motor that a stop has disabled, as on an MS-2000, stays so until a client enables it.
        Otherwise it is enabled before the next motion: after a pause, a jog and a newer target.
        """
        self.closed = False
        """Whether no motion may begin, because the IOC ends."""
        self._runner: asyncio.Task[None] | None = None
        self._silent = False

    @property
    def running(self) -> bool:
        """Whether a motion is carried out now, or the axis comes to rest after it."""
        return self._runner is not None

    def start(self, motion: Motion) -> None:
        """Start a motion. The one under way is stopped first, and its client gets an error.

        Raise :class:`PutRefusedError` when the IOC ends.
        """
        if self.closed:
            raise PutRefusedError(f"{motion.what} was refused: the IOC ends")
        former, self.wanted = self.wanted, motion
        if former is not None:
            former.failure = MotionStoppedError(
                f"{former.what} was replaced by a newer one, {motion.what}"
            )
            former.answer(former.failure)
        self.resume()

    def resume(self) -> None:
        """Begin or continue the waiting motion, unless motions are paused."""
        if self._runner is None and self.wanted is not None and not self.paused:
            self._runner = asyncio.create_task(self._run())

    async def stop(self, why: str, *, hold: bool = True) -> None:
        """Stop the axis, and fail the motion that was asked for.

        An axis that the controller reports at rest is left alone, because a stop disables the motor of an
        MS-2000.
        """
        motion, self.held = self.wanted, hold
        if motion is not None:
            motion.failure = MotionStoppedError(f"{motion.what} was stopped: {why}")
        if self._runner is None and motion is not None:  # it waits for the end of a pause
            self.wanted = None
            await self._observer.ended(motion, motion.failed(motion.failure))
        await self.halt()

    async def pause(self) -> None:
        """Stop the axis; its motion continues after :meth:`resume`."""
        self.paused = True
        if self.wanted is not None:
            self.wanted.interrupted = True
        await self.halt()

    async def halt(self) -> None:
        """Send a stop, unless the controller reports that the axis is at rest."""
        if self.axis is None:
            return
        if self._runner is None and not self._silent:
            with suppress(ReplyTimeoutError):  # then it may be moving
                if not (await self.axis.read(ANSWER)).moving:
                    return
        with suppress(ReplyTimeoutError):  # it was sent
            await self.axis.stop(ANSWER)

    async def end(self, error: StagewireError) -> None:
        """Fail the motion that was asked for, because the controller is lost or the IOC ends."""
        self.axis = None
        if self._runner is not None:
            if self.wanted is not None:  # otherwise the end of the motion is being published
                self._runner.cancel()
            with suppress(asyncio.CancelledError):
                await self._runner
        if (motion := self.wanted) is not None:
            self.wanted = None
            await self._observer.ended(motion, error)

    async def poll(self) -> Reading:
        """Read the state and publish it. Raise the errors of requests."""
        async with self._polling:  # readings are published in their order
            return await self._poll()

    async def _poll(self) -> Reading:
        try:
            if self.axis is None:
                raise SessionClosedError("the controller is lost")
            reading = await self.axis.read(ANSWER)
        except StagewireError as error:
            self._silent = True
            await self._observer.silent(error)
            raise
        self._silent = False
        await self._observer.read(reading)
        return reading

    async def at_rest(self, what: str) -> Reading:
        """Return the state of an axis at rest.

        Raise :class:`PutRefusedError` for what was put if the axis moves or its controller is lost.
        """
        if self.axis is None:
            raise PutRefusedError(f"{what} was refused: the controller is not connected")
        if self.wanted is not None or self.running or (reading := await self.poll()).moving:
            raise PutRefusedError(
                f"{what} was refused: the axis moves; put STOP, or wait for DMOV = 1"
            )
        return reading

    async def _run(self) -> None:
        """Carry out motions until none is wanted."""
        try:
            while (motion := self.wanted) is not None and not self.paused:
                motion.interrupted = False
                error = motion.failed(motion.failure or await self._carried_out(motion))
                if self.wanted is not motion:
                    continue
                if (
                    motion.interrupted
                    and isinstance(error, MotionStoppedError)
                    and not motion.failure
                ):
                    continue
                self.wanted = None
                await self._observer.ended(motion, error and (motion.failure or error))
        finally:
            self._runner = None

    async def _carried_out(self, motion: Motion) -> StagewireError | None:
        """Carry out a motion, and return the error with which it ended."""
        ended: StagewireError | None = None
        try:
            await self._observer.begun(motion)
            if self.axis is not None and not self.axis.enabled and not self.held:
                await self.axis.enable(on=True)
            await self._followed(motion)
        except (TransportError, SessionClosedError, ReplyTimeoutError) as error:
            return error
        except StagewireError as error:
            ended = motion.failed(error)
        try:
            await self.poll()  # the final position
        except StagewireError as error:
            return ended or error
        return ended

    async def _followed(self, motion: Motion) -> None:
        """Await the end of a motion, and read the state of the axis meanwhile."""
        if (axis := self.axis) is None:
            raise SessionClosedError("the controller is lost")
        ending = asyncio.ensure_future(motion.call(axis))
        answered = moved = time.monotonic()
        halting: asyncio.Task[None] | None = None
        try:
            while not (await asyncio.wait({ending}, timeout=POLL))[0]:
                if halting is None and (motion.failure or motion.interrupted):
                    halting = asyncio.create_task(self.halt())
                try:
                    reading = await self.poll()
                except ReplyTimeoutError as error:
                    if time.monotonic() - answered > SILENCE:
                        raise ReplyTimeoutError(
                            f"{motion.what}: the controller fell silent during a motion, which may still be "
                            f"under way: {error}"
                        ) from None
                    continue
                answered = time.monotonic()
                if reading.moving:
                    moved = answered
                elif answered - moved > REST and not ending.done():
                    with suppress(StagewireError):
                        await axis.stop(ANSWER)
                    raise MotionTimeoutError(
                        f"{motion.what}: the axis is at rest, but the controller has not reported the end of "
                        "the motion; a stop was sent"
                    )
            ending.result()
        finally:
            if halting is not None:
                await asyncio.gather(halting, return_exceptions=True)
            await _dropped(ending)


async def _dropped(task: asyncio.Future[Any]) -> None:
    task.cancel()
    with suppress(asyncio.CancelledError, StagewireError):
        await task
