"""Fly scans: a motor passes through a range at constant velocity."""

from __future__ import annotations

import asyncio
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from ophyd_async.core import AsyncStatus, FlyableLogic, FlyMotorInfo, SignalRW

from stagewire.devices import COUNTS
from stagewire.errors import MotionStoppedError, StagewireError, UnknownScaleError
from stagewire_bluesky.axis import MotorAxis
from stagewire_bluesky.signals import put


@dataclass
class Flight:
    """A flight that was prepared.

    :param target: where the motor comes to rest after it.
    :param run_up: seconds until the velocity is constant.
    :param velocity: velocity before, which is restored at the end; None in mock mode.
    :param status: the motion, once it has begun.
    """

    target: float
    run_up: float
    velocity: float | None
    status: AsyncStatus[Any] | None = None


class FlightLogic(FlyableLogic[FlyMotorInfo, Flight]):
    """Prepares a flight, starts it and waits for its end.

    ``prepare`` moves to the start of the run-up at the present velocity, and then sets the velocity of the
    flight. ``complete`` restores the velocity. So does a stop.

    :param axis: the axis.
    :param setpoint: signal that moves it.
    :param acceleration_time: seconds to the velocity of a flight; None: from the velocity parameters, if the
        scale of the acceleration is known.
    """

    axis: MotorAxis
    setpoint: SignalRW[float]
    acceleration_time: float | None
    flight: Flight | None
    preparing: bool

    async def on_prepare(self, value: FlyMotorInfo) -> Flight:
        """Check the flight, move to its start and set its velocity."""
        self.preparing = True
        try:
            self.flight = await self._prepared(value)
        finally:
            self.preparing = False
        return self.flight

    async def on_kickoff(self, ctx: Flight) -> Flight:
        """Start the motion, and return when its velocity is constant.

        Raise :class:`~stagewire.errors.MotionStoppedError` if a stop has restored the velocity.
        """
        if ctx is not self.flight:
            raise MotionStoppedError(
                f"{self.axis.reference.source}: the flight was stopped before its start; prepare it again"
            )
        ctx.status = AsyncStatus(put(self.setpoint, ctx.target, None))
        await asyncio.wait({ctx.status.task}, timeout=ctx.run_up)
        if ctx.status.done:
            await ctx.status  # raises the error of a motion that was refused
        return ctx

    async def on_complete(self, ctx: Flight) -> None:
        """Wait until the motor has come to rest, and restore its velocity."""
        assert ctx.status is not None  # StandardFlyable checks the order
        try:
            await ctx.status
        except BaseException:
            with suppress(StagewireError):  # the line may be lost
                await self._land()
            raise
        await self._land()

    async def on_stage(self) -> None:
        """Leave the motor alone, unless it is in a flight."""
        await self.on_unstage()

    async def on_unstage(self) -> None:
        """Stop a flight that was not completed."""
        if self.flight is not None:
            await self.stop()

    async def _prepared(self, value: FlyMotorInfo) -> Flight:
        if not self.axis.reference.controller.is_open:  # in mock mode
            await put(self.setpoint, value.start_position, None)
            return Flight(value.end_position, 0.0, None)
        part = self.axis.reference.part
        before = await self.axis.velocity(part)
        if before is None:
            raise UnknownScaleError(
                f"{self.axis.reference.source} cannot fly: its velocity cannot be set in units per second"
            )
        run_up = await self._run_up(value.speed)
        target = value.ramp_down_end_pos(run_up)
        start = value.ramp_up_start_pos(run_up)
        self.axis.check(start)
        self.axis.check(target)
        await self._set_velocity(value.speed)  # refused before anything moves
        await self._set_velocity(before)
        await put(self.setpoint, start, None)
        await self._set_velocity(value.speed)
        return Flight(target, run_up, before)

    async def _land(self) -> None:
        """Restore the velocity."""
        flight, self.flight = self.flight, None
        if flight is not None and flight.velocity is not None:
            await self._set_velocity(flight.velocity)

    async def _run_up(self, speed: float) -> float:
        if self.acceleration_time is not None:
            return self.acceleration_time
        unit = self.axis.unit()
        values = await self.axis.reference.part.get_vel_params()
        try:
            return speed / float(getattr(values, f"acceleration_{unit}_per_s2"))
        except (UnknownScaleError, ZeroDivisionError):
            raise UnknownScaleError(
                f"{self.axis.reference.source} cannot fly: the scale of its acceleration is unknown; create "
                "the motor with acceleration_time=SECONDS"
            ) from None

    async def _set_velocity(self, velocity: float) -> None:
        unit = self.axis.unit()
        assert unit != COUNTS  # otherwise the velocity is unknown
        part = self.axis.reference.part
        await part.change_vel_params(**{f"max_velocity_{unit}_per_s": velocity})
