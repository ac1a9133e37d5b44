"""Motors: they move, fly, and report their position, in the unit of their stage."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Final

from ophyd_async.core import (
    AsyncStatus,
    CalculatableTimeout,
    FlyMotorInfo,
    MovableLogic,
    SignalR,
    SignalRW,
    StandardFlyable,
    StandardMovable,
    StandardReadable,
    TimeoutCalculator,
    WatchableAsyncStatus,
)
from ophyd_async.core import StandardReadableFormat as Format

from stagewire.errors import MotionStoppedError, StagewireError
from stagewire_bluesky.axis import MotorAxis
from stagewire_bluesky.controller import Reference
from stagewire_bluesky.flying import Flight, FlightLogic
from stagewire_bluesky.parameters import Parameters, child_name
from stagewire_bluesky.signals import PartBackend, SetpointBackend, put

DEFAULT_PARAMETERS: Final = ("vel_params", "maximum_speed", "ramp_time")
"""The sets of parameters in the configuration of a motor, as far as its controller has them."""


@dataclass
class MotorLogic(MovableLogic[float], FlightLogic):
    """Moves a motor, and flies it.

    :param axis: the axis.
    :param acceleration_time: seconds to the velocity of a flight; None: from the velocity parameters.
    """

    axis: MotorAxis
    acceleration_time: float | None = None
    flight: Flight | None = field(default=None, init=False)
    preparing: bool = field(default=False, init=False)

    async def check_move(self, new_position: float) -> None:
        """Raise :class:`~stagewire.errors.LimitError` for a target outside the known travel."""
        if self.axis.reference.controller.is_open:  # without a port, in mock mode, nothing is known
            self.axis.check(new_position)

    async def move(self, new_position: float, timeout: TimeoutCalculator) -> None:
        """Move, and return when the controller has reported the end of the motion at its target.

        A motion that was stopped by :meth:`stop` counts as cancelled, as bluesky expects, so that a plan can
        be paused. Any other stop raises :class:`~stagewire.errors.MotionStoppedError`.
        """
        try:
            await put(self.setpoint, new_position, timeout())
        except MotionStoppedError:
            if self.axis.stopping:
                raise asyncio.CancelledError from None
            raise

    async def stop(self) -> None:
        """Stop, unless the motor is at rest, and restore the velocity after a flight."""
        try:
            await self.axis.stop()
        finally:
            with suppress(StagewireError):
                await self._land()


class Motor(StandardMovable[float], StandardFlyable[FlyMotorInfo, Flight], StandardReadable):
    """A motor, with positions in the unit of its stage, or in counts if the scale is unknown.

    ``set`` is done when the controller has reported the end of the motion, and the position is at the target.
    It fails within 5 seconds if the motion is refused or stopped, ends elsewhere, or cannot be followed any
    longer. ``read`` asks the controller; it never returns an earlier position.

    :param reference: a controller with one motor, or a channel, bay or axis.
    :param parameters: sets of parameters in the configuration, such as ``("vel_params", "home_params")``.
        The default is the velocity parameters, or the maximum speed and ramp time of an MS-2000.
    :param acceleration_time: seconds from rest to the velocity of a flight. Required to fly a stage whose
        scale of the acceleration is unknown.

    Raise :class:`TypeError` for a part that has no motor, or not these parameters.
    """

    vel_params: Parameters
    """The velocity parameters, unless other sets were chosen or the controller has none."""

    def __init__(
        self,
        reference: Reference,
        name: str = "",
        *,
        parameters: Sequence[str] | None = None,
        acceleration_time: float | None = None,
    ) -> None:
        self.reference = reference
        self._axis = MotorAxis(reference)
        self._acceleration_time = acceleration_time
        self._position = PartBackend(
            reference, float, self._axis.read, metadata=self._axis.metadata
        )
        with self.add_children_as_readables(Format.HINTED_UNCACHED_SIGNAL):
            self.readback: SignalR[float] = SignalR(self._position)
        with self.add_children_as_readables():
            for set_name in self._sets(reference, parameters):
                setattr(self, child_name(set_name), Parameters(reference, set_name))
        self.setpoint: SignalRW[float] = SignalRW(
            SetpointBackend(reference, float, self._axis.target, self._move, self._axis.metadata),
            timeout=None,
        )
        super().__init__(name=name)

    @staticmethod
    def _sets(reference: Reference, chosen: Sequence[str] | None) -> Sequence[str]:
        if chosen is not None:
            return chosen
        return [
            name
            for name in DEFAULT_PARAMETERS
            if any(hasattr(reference.kind, prefix + name) for prefix in ("get_", "read_"))
        ]

    def set(
        self, new_position: float, timeout: CalculatableTimeout = "CALCULATE_TIMEOUT"
    ) -> WatchableAsyncStatus[float]:
        """Move to a position, unless a stop comes before the motion begins."""
        return self._axis.request(super().set, new_position, timeout)

    def prepare(self, value: FlyMotorInfo) -> AsyncStatus[None]:
        """Move to the start of a flight, and set its velocity."""
        return self._axis.request(super().prepare, value)

    def kickoff(self) -> AsyncStatus[None]:
        """Begin a flight."""
        return self._axis.request(super().kickoff)

    async def pause(self) -> None:
        """Stop a flight while a plan is paused; it then fails, and must be prepared again.

        bluesky itself stops motors that were set, and no others.
        """
        if self._logic.preparing or self._logic.flight is not None:
            await self.stop(success=True)  # type: ignore[no-untyped-call]

    def resume(self) -> None:
        """Do nothing: the plan repeats what was interrupted."""

    async def _move(self, part: Any, target: float) -> None:
        """Move, and publish the final position before the move is done."""
        await self._axis.move(part, target)
        await self._position.refresh()

    @cached_property
    def _logic(self) -> MotorLogic:
        return MotorLogic(
            setpoint=self.setpoint,
            readback=self.readback,
            axis=self._axis,
            acceleration_time=self._acceleration_time,
        )

    @cached_property
    def movable_logic(self) -> MotorLogic:
        """The logic that moves the motor."""
        return self._logic

    @cached_property
    def flyable_logic(self) -> MotorLogic:
        """The logic that flies the motor."""
        return self._logic
