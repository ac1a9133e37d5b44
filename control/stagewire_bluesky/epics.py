"""A motor record of EPICS as a device of ophyd-async that checks position and alarm after each move.

Needs the extra ``bluesky-epics``. This module is imported only by programs that use EPICS.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator, Awaitable
from contextlib import asynccontextmanager, suppress
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Final, TypeVar

from bluesky.protocols import Reading
from ophyd_async.core import DEFAULT_TIMEOUT, SignalR, TimeoutCalculator
from ophyd_async.epics.motor import Motor, MotorFlyableMovableLogic

from stagewire.errors import ReplyTimeoutError
from stagewire_bluesky.axis import ANSWER, CHECK, SILENCE
from stagewire_bluesky.checking import Arrival, Check, silent
from stagewire_bluesky.signals import dropped

_T = TypeVar("_T")
_INVALID: Final = 3


class CheckedMotor(Motor):
    """A :class:`ophyd_async.epics.motor.Motor` whose moves fail unless they end at their target.

    After each move it reads RBV and its alarm. During a move it asks the IOC for DMOV, so that an IOC that
    was killed or does not answer is noticed. ``set`` fails within 5 seconds if the move is refused or
    stopped, ends elsewhere, or the IOC or its controller is lost. ``read`` asks the IOC, and fails if the
    position is not known.

    :param prefix: name of the motor record, such as ``LAB:x`` or ``pva://LAB:x``.
    :param tolerance: how far from its target a move may end, in the unit of the record; None: the larger of
        RDBD and 0.01 mm, 10 µm, 0.1 degrees or 500 counts, the tolerance of native devices.
    :param tolerated: the worst alarm severity with which a move passes: 0 for none, 1 for MINOR, 2 for MAJOR.
    """

    def __init__(
        self, prefix: str, name: str = "", *, tolerance: float | None = None, tolerated: int = 0
    ) -> None:
        self._check = Check(tolerance, tolerated)
        super().__init__(prefix, name)

    @cached_property
    def _logic(self) -> CheckedLogic:
        return CheckedLogic(
            readback=self.user_readback,
            setpoint=self.user_setpoint,
            motor_stop=self.motor_stop,
            low_limit_travel=self.low_limit_travel,
            high_limit_travel=self.high_limit_travel,
            dial_low_limit_travel=self.dial_low_limit_travel,
            dial_high_limit_travel=self.dial_high_limit_travel,
            velocity=self.velocity,
            acceleration_time=self.acceleration_time,
            motor_done_move=self.motor_done_move,
            max_velocity=self.max_velocity,
            motor_egu=self.motor_egu,
            deadband=self.deadband,
            check=self._check,
        )

    @cached_property
    def movable_logic(self) -> CheckedLogic:
        """The logic that moves the motor."""
        return self._logic

    @cached_property
    def flyable_logic(self) -> CheckedLogic:
        """The logic that flies the motor."""
        return self._logic

    async def read(self) -> dict[str, Reading[Any]]:
        """Ask the IOC for the position, and for what else the device reads."""
        fresh = await self._logic.read()
        return {**await super().read(), **fresh}


@dataclass
class CheckedLogic(MotorFlyableMovableLogic):
    """Moves and flies a motor record, and checks the end of each move.

    :param deadband: RDBD.
    :param check: the conditions for the end of a move.
    """

    deadband: SignalR[float]
    check: Check
    _moves: int = field(default=0, init=False)

    async def get_units_precision(self) -> tuple[str | None, int | None]:
        """Return the unit and the precision; fail soon if the IOC does not answer."""
        return await self._within(SILENCE, super().get_units_precision())

    async def check_move(self, new_position: float) -> None:
        """Raise an error of ophyd-async for a target outside the limits."""
        await self._within(SILENCE, super().check_move(new_position))

    async def move(self, new_position: float, timeout: TimeoutCalculator) -> None:
        """Move, ask the IOC for its state meanwhile, and check where the move ended.

        Raise :class:`~stagewire_bluesky.checking.MoveFailedError`, and
        :class:`~stagewire.errors.ReplyTimeoutError` if the IOC does not answer.
        """
        async with self._connection() as lost:
            putting = asyncio.ensure_future(self.setpoint.set(new_position, timeout=timeout()))
            self._moves += 1
            try:
                await self._followed(putting, lost, new_position)
                arrival = await self._arrival()
            finally:
                self._moves -= 1
                if not putting.done():
                    await dropped(putting)
        self.check.reached(self.readback.name, new_position, arrival)

    async def stop(self) -> None:
        """Put STOP, unless no move was begun here and the record says that it does not move.

        Raise :class:`~stagewire.errors.ReplyTimeoutError` if STOP could not be sent.
        """
        if not self._moves:
            with suppress(Exception):  # then it may be moving
                if await self._within(ANSWER, self.motor_done_move.get_value(cached=False)):
                    return
        await self._within(ANSWER, self.motor_stop.set(1, timeout=DEFAULT_TIMEOUT))

    async def read(self) -> dict[str, Reading[Any]]:
        """Ask for the position.

        Raise :class:`~stagewire_bluesky.checking.MoveFailedError` if it is not known.
        """
        reading = self.readback.read(cached=False)
        found: dict[str, Reading[Any]] = await self._within(SILENCE, reading)
        self.check.valid(self.readback.name, _arrival(found[self.readback.name]))
        return found

    @asynccontextmanager
    async def _connection(self) -> AsyncIterator[asyncio.Future[None]]:
        """Yield a future that is done when an IOC of pvAccess disconnects.

        p4p sends a put that is under way again when the IOC is back, so it must be cancelled before.
        """
        lost: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        scheme, _, name = self.motor_done_move.source.partition("://")
        if scheme != "pva":  # puts by Channel Access fail then
            yield lost
            return
        from ophyd_async.epics.core._p4p import context  # the connection of the put
        from p4p.client.raw import Disconnected

        here = asyncio.Event()

        async def changed(value: Any) -> None:
            if not isinstance(value, Disconnected):
                here.set()
            elif here.is_set() and not lost.done():
                lost.set_result(None)

        monitor = context().monitor(name, changed, notify_disconnect=True)
        try:
            await self._within(SILENCE, here.wait())
            yield lost
        finally:
            monitor.close()

    async def _followed(
        self, putting: asyncio.Future[None], lost: asyncio.Future[None], target: float
    ) -> None:
        """Wait for the end of a put, while the IOC is asked whether it is there."""
        name, answered = self.readback.name, time.monotonic()
        while True:
            await asyncio.wait({putting, lost}, timeout=CHECK, return_when=asyncio.FIRST_COMPLETED)
            if putting.done():
                break
            if lost.done():
                raise self.check.failed(name, target, None, "the IOC disconnected")
            try:
                await self._within(ANSWER, self.motor_done_move.get_value(cached=False))
            except Exception:
                if time.monotonic() - answered > SILENCE:
                    raise ReplyTimeoutError(silent(name, target)) from None
            else:
                answered = time.monotonic()
        # ophyd-async drops the errors of aioca, which are false; then only the check finds the failure.
        error = putting.exception()
        if isinstance(error, TimeoutError):
            raise error
        if error is not None:
            arrival = None
            with suppress(Exception):
                arrival = await self._arrival()
            raise self.check.failed(name, target, arrival, str(error)) from None

    async def _arrival(self) -> Arrival:
        async def ask() -> Arrival:
            reading, unit, deadband, done = await asyncio.gather(
                self.readback.read(cached=False),
                self.motor_egu.get_value(cached=False),
                self.deadband.get_value(cached=False),
                self.motor_done_move.get_value(cached=False),
            )
            return _arrival(reading[self.readback.name], unit, deadband, not done)

        return await self._within(ANSWER, ask())

    async def _within(self, seconds: float, asking: Awaitable[_T]) -> _T:
        """Return an answer of the IOC; raise ReplyTimeoutError if there is none."""
        try:
            async with asyncio.timeout(seconds):
                return await asking
        except TimeoutError as error:
            raise ReplyTimeoutError(
                f"{self.readback.name}: the IOC did not answer within {seconds:g} s"
            ) from error
        except Exception as error:
            if error:
                raise
            # The errors of aioca are false, and would be lost in bluesky.
            raise ReplyTimeoutError(f"{self.readback.name}: no answer: {error}") from None


def _arrival(
    reading: Reading[float], unit: str = "", deadband: float = 0.0, moving: bool = False
) -> Arrival:
    severity = reading.get("alarm_severity", 0)  # ophyd-async has -1 for INVALID
    return Arrival(
        reading["value"], severity if severity >= 0 else _INVALID, unit, deadband, moving
    )
