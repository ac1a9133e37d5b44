"""The axis of a motor record: a part of a controller, in the unit of its stage."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from math import ceil, log10
from typing import Any, Final

from stagewire.devices import COUNTS, ParameterKind, Values, status_set
from stagewire.errors import UnknownScaleError, UnsupportedError

_LOW: Final = frozenset({"reverse_hardware_limit", "lower_limit"})
_HIGH: Final = frozenset({"forward_hardware_limit", "upper_limit"})
_ENABLED: Final = "channel_enabled"
_ANSWER: Final = 1.0
"""Seconds that a controller has to answer."""
_FAULTS: Final = ("_error", "_fault", "over_temperature", "commutation_error")
"""Endings of the bits of faults."""


@dataclass(frozen=True, slots=True)
class Reading:
    """The state of an axis.

    :param counts: the position in counts.
    :param position: the same position in the unit of the axis.
    :param moving: whether it moves.
    :param low: whether the limit switch at the lower end is active.
    :param high: whether the one at the upper end is active.
    :param homed: whether it is homed; False if the unit does not report it.
    :param enabled: whether the motor is enabled, as far as is known.
    :param faults: names of the faults that the controller reports, such as ``motion_error``.
    :param values: the status as the library returns it.
    """

    counts: int
    position: float
    moving: bool
    low: bool
    high: bool
    homed: bool
    enabled: bool
    faults: tuple[str, ...]
    values: Values[Any]


class OpenAxis:
    """An axis of a controller that is open.

    :param part: device, bay, channel or axis of the asyncio classes, with ``move_absolute``.
    """

    def __init__(self, part: Any) -> None:
        self.part = part
        unit: str = part.scales.unit_of("position")
        try:
            counts_per_unit = float(part.scales.of("position", unit).counts_per_unit)
        except UnknownScaleError:
            unit, counts_per_unit = COUNTS, 1.0
        self.unit = unit
        """``mm``, ``deg``, ``um`` or ``counts``."""
        self.resolution = 1 / counts_per_unit
        """The length of a count in the unit of the axis; negative if counts fall while positions rise."""
        self._stop_disables = hasattr(type(part), "start_motor")
        self.enabled = True
        """Whether the motor is enabled, as far as is known."""
        status = status_set(type(part))
        assert status is not None  # each motor reports its position with bits
        self._status = getattr(part, status.read)
        [self._bits] = [one for one in status.parameters.values() if one.kind is ParameterKind.BITS]

    @property
    def precision(self) -> int:
        """The number of decimals that shows single counts."""
        return max(0, ceil(-log10(abs(self.resolution))))

    @property
    def travel(self) -> tuple[float, float] | None:
        """The ends of the travel; None if they are unknown."""
        travel: tuple[float, float] | None = self.part.travel
        return travel

    @property
    def can_home(self) -> bool:
        """Whether the controller can home the axis."""
        return hasattr(type(self.part), "home")

    async def read(self, timeout: float) -> Reading:
        """Ask the controller for its state.

        Raise the errors of requests.
        """
        values = await self._status(timeout=timeout)
        moving = self.part.shows_motion(values)
        if moving is None:
            moving = await self.part.is_moving(timeout=timeout)
        names = self._bits.plain(values)
        counts = int(values.message.position)
        if _ENABLED in names:  # such as by another program
            self.enabled = True
        return Reading(
            counts=counts,
            position=counts * self.resolution,
            moving=moving,
            low=not _LOW.isdisjoint(names),
            high=not _HIGH.isdisjoint(names),
            homed="homed" in names,
            enabled=_ENABLED in names if _ENABLED in self._bits.names else self.enabled,
            faults=tuple(name for name in names if name.endswith(_FAULTS)),
            values=values,
        )

    async def move(self, target: float, timeout: float) -> None:
        """Move, and return when the controller has reported the end of the motion at its target."""
        await self.part.move_absolute(
            **{self.unit: round(target) if self.unit == COUNTS else target}, timeout=timeout
        )

    async def home(self, timeout: float) -> None:
        """Home with the settings of the controller, and return at the end."""
        await self.part.home(timeout=timeout)

    async def stop(self, timeout: float) -> None:
        """Stop. This disables the motor of an MS-2000."""
        if self._stop_disables:
            self.enabled = False
        await self.part.stop(timeout=timeout)

    async def enable(self, *, on: bool) -> None:
        """Enable or disable the motor; nothing moves.

        Raise :class:`~stagewire.errors.UnsupportedError` for a unit whose motors are always enabled.
        """
        if not self._stop_disables:
            await (self.part.enable() if on else self.part.disable())
        elif on:
            # A motor of an MS-2000 moves to its last target when it is enabled, so that must be its position.
            reading = await self.read(_ANSWER)
            await self.part.move_absolute(counts=reading.counts, timeout=_ANSWER)
            await self.part.start_motor()
        else:
            await self.part.stop(timeout=_ANSWER)
        self.enabled = on

    async def define(self, position: float) -> None:
        """Give the present position another number; nothing moves."""
        counts = round(position / self.resolution)
        if hasattr(type(self.part), "change_pos_counter"):
            await self.part.change_pos_counter(position=counts)
        else:
            await self.part.write_motor_position(position=counts)

    async def velocity(self) -> float | None:
        """Ask for the velocity of moves in units per second; None if its scale is unknown."""
        if hasattr(type(self.part), "get_vel_params"):
            values = await self.part.get_vel_params()
            return _number(values, f"max_velocity_{self.unit}_per_s")
        values = await self.part.read_maximum_speed()
        return _number(values, f"{self.unit}_per_s")

    async def set_velocity(self, velocity: float) -> None:
        """Set the velocity of moves in units per second."""
        if hasattr(type(self.part), "change_vel_params"):
            await self.part.change_vel_params(**{f"max_velocity_{self.unit}_per_s": velocity})
        else:
            await self.part.write_top_speed(**{f"{self.unit}_per_s": velocity})

    async def acceleration_time(self) -> float | None:
        """Ask for the seconds from rest to the velocity of moves; None if a scale is unknown."""
        if hasattr(type(self.part), "get_vel_params"):
            values = await self.part.get_vel_params()
            velocity = _number(values, f"max_velocity_{self.unit}_per_s")
            acceleration = _number(values, f"acceleration_{self.unit}_per_s2")
            if velocity is None or acceleration is None:
                return None
            return velocity / acceleration if acceleration else 0.0
        milliseconds = _number(await self.part.read_ramp_time(), "ms")
        return None if milliseconds is None else milliseconds / 1000

    async def set_acceleration_time(self, seconds: float) -> None:
        """Set the seconds from rest to the velocity of moves."""
        if hasattr(type(self.part), "change_vel_params"):
            velocity = await self.velocity()
            if not velocity:
                raise UnsupportedError(f"{self.part!r}: its velocity is 0, or its scale is unknown")
            await self.part.change_vel_params(
                **{f"acceleration_{self.unit}_per_s2": velocity / seconds}
            )
        else:
            await self.part.write_ramping_time(ms=round(seconds * 1000))


def _number(values: Values[Any], name: str) -> float | None:
    with suppress(UnknownScaleError, AttributeError):
        return float(getattr(values, name))
    return None
