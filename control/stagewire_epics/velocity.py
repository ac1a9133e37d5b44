"""The velocity and acceleration of a motor record."""

from __future__ import annotations

from dataclasses import dataclass

from stagewire.devices import COUNTS
from stagewire_epics.axis import OpenAxis
from stagewire_epics.motions import Motions
from stagewire_epics.records import PutRefusedError
from stagewire_epics.state import MotorState


@dataclass(frozen=True, slots=True)
class MotorSettings:
    """Settings of a motor that its controller does not know.

    :param description: text of DESC.
    :param velocity: velocity in units per second, if the controller does not report it in these units.
    :param acceleration_time: seconds from rest to the velocity, if it does not report that.
    :param limits: limits in dial coordinates; None: the travel.
    :param highest_velocity: highest velocity that clients may set; None: that of the controller when it is
        opened.
    """

    description: str = ""
    velocity: float | None = None
    acceleration_time: float | None = None
    limits: tuple[float, float] | None = None
    highest_velocity: float | None = None


class Velocity:
    """Accepts values for VELO and ACCL.

    :param state: the state of the motor.
    :param motions: its motions.
    :param settings: values that the controller does not report.
    """

    def __init__(self, state: MotorState, motions: Motions, settings: MotorSettings) -> None:
        self._state = state
        self._motions = motions
        self._settings = settings
        self._highest = settings.highest_velocity
        self._reported = {"VELO": False, "ACCL": False}

    async def read(self, axis: OpenAxis) -> None:
        """Read and publish the velocity and the acceleration.

        Raise :class:`PutRefusedError` for one that the controller does not report and the settings lack.
        """
        velocity, time = await axis.velocity(), await axis.acceleration_time()
        self._reported = {"VELO": velocity is not None, "ACCL": time is not None}
        velocity = self._settings.velocity if velocity is None else velocity
        time = self._settings.acceleration_time if time is None else time
        found = (("velocity", velocity), ("acceleration_time", time))
        if missing := [name for name, value in found if value is None]:
            stage = " or stage = NAME for its controller" if axis.unit == COUNTS else ""
            raise PutRefusedError(
                f"{self._state.name}: the controller does not report its {' and '.join(missing)} in known "
                f"units; state {' and '.join(f'{name} = NUMBER' for name in missing)} for this motor{stage}"
            )
        if self._highest is None:
            self._highest = velocity
        await self._state.post(VELO=velocity, JVEL=velocity, VMAX=self._highest, ACCL=time)

    async def put_velo(self, velocity: float) -> None:
        """Set the velocity of moves."""
        axis = await self._axis("VELO")
        highest = self._state["VMAX"]
        if not 0 < velocity <= highest:
            raise PutRefusedError(
                f"{self._state.name}.VELO: {velocity:g} {axis.unit}/s is not above 0 and at most "
                f"{highest:g}; the bench can state a higher highest_velocity"
            )
        await axis.set_velocity(velocity)
        if not await axis.velocity():
            await axis.set_velocity(self._state["VELO"])
            raise PutRefusedError(
                f"{self._state.name}.VELO: {velocity:g} {axis.unit}/s is 0 for the controller; choose a "
                "higher one"
            )
        await self.read(axis)

    async def put_accl(self, seconds: float) -> None:
        """Set the seconds from rest to the velocity of moves."""
        axis = await self._axis("ACCL")
        if seconds <= 0:
            raise PutRefusedError(f"{self._state.name}.ACCL: {seconds:g} s is not above 0")
        await axis.set_acceleration_time(seconds)
        if not await axis.acceleration_time():
            await axis.set_acceleration_time(self._state["ACCL"])
            raise PutRefusedError(
                f"{self._state.name}.ACCL: the acceleration of {seconds:g} s is 0 for the controller; choose "
                "a shorter time"
            )
        await self.read(axis)

    async def _axis(self, field: str) -> OpenAxis:
        what = f"{self._state.name}.{field}"
        if not self._reported[field]:
            raise PutRefusedError(
                f"{what} cannot be set: the scale of the controller is unknown; the bench states it"
            )
        await self._motions.at_rest(what)
        assert self._motions.axis is not None  # it is at rest
        return self._motions.axis
