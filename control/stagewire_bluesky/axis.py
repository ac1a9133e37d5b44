"""The axis of a motor: its unit and limits, and motions with a bounded wait for their end."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from contextlib import suppress
from contextvars import ContextVar, copy_context
from math import ceil, log10
from typing import Any, Final, ParamSpec, TypeVar

from event_model import Limits, LimitsRange
from ophyd_async.core import SignalMetadata

from stagewire.devices import COUNTS
from stagewire.errors import (
    LimitError,
    MotionStoppedError,
    MotionTimeoutError,
    MotionUnderWayError,
    ReplyTimeoutError,
    StagewireError,
    TargetNotReachedError,
    UnknownScaleError,
)
from stagewire_bluesky.controller import Reference
from stagewire_bluesky.signals import dropped

POSITION: Final = "position"
"""The quantity of a position."""
TOLERANCES: Final = {"mm": 0.01, "um": 10.0, "deg": 0.1, COUNTS: 500.0}
"""Unit -> how far from its target an axis may be and still count as being there."""

CHECK: Final = 0.5
"""Seconds between two checks whether a motion is still under way."""
ANSWER: Final = 1.0
"""Seconds that the controller has to answer such a check."""
SILENCE: Final = 2.5
"""Seconds without an answer after which a motion fails."""
REST: Final = 2.5
"""Seconds at rest, without a report of the end, after which a motion fails."""
HALT: Final = 10.0
"""Seconds in which a stopped axis must come to rest."""
_SPARE: Final = 10.0
"""Seconds that a motion may take in addition to twice the time at full velocity."""

_P = ParamSpec("_P")
_T = TypeVar("_T")
_STOPS: ContextVar[int] = ContextVar("stops of the axis before a motion was requested")


class MotorAxis:
    """One axis, in the unit of its stage, or in counts if its scale is unknown.

    :param reference: the part with the axis.
    """

    def __init__(self, reference: Reference) -> None:
        reference.require("move_absolute", "motor")
        self.reference = reference
        self.busy = False
        """Whether a motion that was started here may be under way."""
        self._stops = 0  # calls of stop()
        self._stops_before = 0  # those before the last motion was requested
        self._silent = False  # whether the last motion failed because the controller did not answer

    @property
    def stopping(self) -> bool:
        """Whether :meth:`stop` was called since the last motion was requested."""
        return self._stops != self._stops_before

    def request(self, begin: Callable[_P, _T], /, *args: _P.args, **kwargs: _P.kwargs) -> _T:
        """Call a function that starts a task, which moves the axis later unless a stop comes first."""
        context = copy_context()  # the task inherits it
        context.run(_STOPS.set, self._stops)
        return context.run(begin, *args, **kwargs)

    def unit(self) -> str:
        """Return the unit of positions."""
        scales = self.reference.part.scales
        unit: str = scales.unit_of(POSITION)
        try:
            scales.of(POSITION, unit)
        except UnknownScaleError:
            return COUNTS
        return unit

    def travel(self) -> tuple[float, float] | None:
        """Return the ends of the travel; None if they are unknown."""
        travel: tuple[float, float] | None = self.reference.part.travel
        return travel

    def metadata(self, part: Any) -> SignalMetadata:
        """Return the unit, the number of decimals that shows single counts, and the limits."""
        unit = self.unit()
        metadata = SignalMetadata(units=unit, precision=0)
        if unit != COUNTS:
            counts = abs(float(part.scales.of(POSITION, unit).counts_per_unit))
            metadata["precision"] = max(0, ceil(log10(counts)))
        if (travel := self.travel()) is not None:
            low, high = travel
            metadata["limits"] = Limits(control=LimitsRange(low=low, high=high))
        return metadata

    async def read(self, part: Any) -> float:
        """Request the position."""
        if self.unit() == COUNTS:
            return float(await part.position_counts)
        position: float = await part.position
        return position

    def check(self, target: float) -> None:
        """Raise :class:`~stagewire.errors.LimitError` for a target outside the travel, if that is known."""
        travel = self.travel()
        if travel is not None and not travel[0] <= target <= travel[1]:
            low, high = travel
            raise LimitError(
                f"{self.reference.source}: {target:g} {self.unit()} is outside the travel, {low:g} to "
                f"{high:g} {self.unit()}; nothing was sent"
            )

    async def target(self, part: Any, wanted: float | None) -> float:
        """Return the target of the last motion if the axis is there or on its way, or else its position.

        A plan that moves by a distance must not begin at a target that was never reached.
        """
        if wanted is not None and self.busy:
            return wanted
        position = await self.read(part)
        near = wanted is not None and abs(position - wanted) <= TOLERANCES[self.unit()]
        return wanted if wanted is not None and near else position

    async def move(self, part: Any, target: float) -> None:
        """Move to a position, and return when the controller has reported the end of the motion there.

        Raise the errors of ``move_absolute``. In addition, raise
        :class:`~stagewire.errors.ReplyTimeoutError` if the controller falls silent, and
        :class:`~stagewire.errors.MotionTimeoutError` if it is at rest without having reported an end.
        """
        if self.busy:
            raise MotionUnderWayError(
                f"{self.reference.source}: the move to {target:g} was not sent, because another move is "
                "under way; wait for its end or stop it first"
            )
        self.busy, self._silent = True, False
        self._stops_before = _STOPS.get(self._stops)
        try:
            unit = self.unit()
            given = round(target) if unit == COUNTS else target
            timeout = await self._timeout(part, target)
            if self.stopping:
                raise MotionStoppedError(
                    f"{self.reference.source}: stopped before the move was sent"
                )
            await self._ended(part, part.move_absolute(**{unit: given}, timeout=timeout))
        except TargetNotReachedError as error:
            if hasattr(part, "start_motor"):
                error.add_note("A stop disables the motor: enable it with start_motor().")
            raise
        finally:
            self.busy = False

    async def velocity(self, part: Any) -> float | None:
        """Request the velocity of moves, in units of the position per second; None if it is unknown."""
        if not hasattr(part, "get_vel_params"):
            return None
        values = await part.get_vel_params()
        with suppress(UnknownScaleError, AttributeError):
            return float(getattr(values, f"max_velocity_{self.unit()}_per_s"))
        return None

    async def _timeout(self, part: Any, target: float) -> float | None:
        """Return a timeout for a long way; None: the timeout of the controller is enough."""
        velocity = await self.velocity(part)
        if not velocity:
            return None
        way = abs(target - await self.read(part))
        return max(self.reference.controller.motion_timeout, 2 * way / velocity + _SPARE)

    async def _ended(self, part: Any, motion: Any) -> None:
        """Wait for the end of a motion, while the controller is asked whether it still moves."""
        ending = asyncio.ensure_future(motion)
        answered = moved = time.monotonic()
        try:
            while not (await asyncio.wait({ending}, timeout=CHECK))[0]:
                try:
                    moving = await part.is_moving(timeout=ANSWER)
                except ReplyTimeoutError as error:
                    if time.monotonic() - answered > SILENCE:
                        self._silent = True
                        raise ReplyTimeoutError(
                            f"{self.reference.source}: the controller fell silent during a move, which may "
                            f"still be under way: {error}"
                        ) from None
                    continue
                answered = time.monotonic()
                if moving:
                    moved = answered
                elif not ending.done() and answered - moved > REST:
                    await self._give_up(part)
            ending.result()
        finally:
            await dropped(ending)

    async def _give_up(self, part: Any) -> None:
        with suppress(StagewireError):
            await part.stop(timeout=ANSWER)
        raise MotionTimeoutError(
            f"{self.reference.source}: the axis is at rest, but the controller has not reported the end of "
            "its move; a stop was sent"
        )

    async def stop(self) -> None:
        """Stop the axis, unless it is known to be at rest.

        An axis at rest is left alone because a stop also disables the motor of an MS-2000.
        """
        self._stops += 1
        if not self.reference.controller.is_open:  # in mock mode
            return
        part = self.reference.part
        answers = not self._silent
        if answers and not self.busy:
            try:
                if not await part.is_moving(timeout=ANSWER):
                    return
            except ReplyTimeoutError:  # then it may be moving
                answers = False
        await part.stop(timeout=HALT if answers else ANSWER)
