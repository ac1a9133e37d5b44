"""Setting positions, offsets, directions and limits of a motor record; nothing moves."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from stagewire_epics.axis import Reading
from stagewire_epics.motions import Motions
from stagewire_epics.records import PutRefusedError
from stagewire_epics.state import MotorState


class Calibration:
    """Accepts values for the fields that change coordinates and limits.

    :param state: the state of the motor.
    :param motions: its motions.
    """

    def __init__(self, state: MotorState, motions: Motions) -> None:
        self._state = state
        self._motions = motions

    @property
    def setting(self) -> bool:
        """Whether targets set the position instead of moving to it."""
        return bool(self._state["SET"])

    def restore(self, values: Mapping[str, Any]) -> None:
        """Take over saved values of fields, before the controller is open.

        Raise :class:`PutRefusedError` for an unusable value.
        """
        state, place = self._state, self._state.coordinates
        for field, value in values.items():
            state.records[field].value = state.records[field].checked(value)
        place.offset, place.negative = state["OFF"], bool(state["DIR"])
        if state["DLLM"] > state["DHLM"]:
            raise PutRefusedError(
                f"{state.name}: DLLM {state['DLLM']:g} is above DHLM {state['DHLM']:g}"
            )
        place.low, place.high = state["DLLM"], state["DHLM"]

    async def set_user(self, user: float) -> None:
        """Give the present position another user coordinate. Nothing moves."""
        reading, place = await self._at_rest("VAL"), self._state.coordinates
        if self._state["FOFF"]:
            await self.set_dial(place.dial(user))
            return
        place.offset = user - place.sign * reading.position
        await self._state.post_coordinates()
        await self._state.post_target(reading.position)

    async def set_dial(self, dial: float) -> None:
        """Give the present position another dial coordinate, in the controller. Nothing moves."""
        reading, place = await self._at_rest("DVAL"), self._state.coordinates
        user = place.user(reading.position)
        assert self._motions.axis is not None
        await self._motions.axis.define(dial)
        if not self._state["FOFF"]:
            place.offset = user - place.sign * dial
        reading = await self._motions.poll()
        await self._state.post_coordinates()
        await self._state.post_target(reading.position)

    async def put_set(self, choice: int) -> None:
        """Choose whether targets move the axis or set its position."""
        await self._at_rest("SET")
        await self._state.post(SET=choice)

    async def put_foff(self, choice: int) -> None:
        """Choose whether setting a position changes OFF or the controller."""
        await self._state.post(FOFF=choice)

    async def put_off(self, offset: float) -> None:
        """Set the user coordinate of the dial position 0."""
        await self._at_rest("OFF")
        self._state.coordinates.offset = offset
        await self._state.post_coordinates()

    async def put_dir(self, choice: int) -> None:
        """Choose the direction of user coordinates."""
        reading, place = await self._at_rest("DIR"), self._state.coordinates
        user = place.user(reading.position)
        place.negative = bool(choice)
        if not self._state["FOFF"]:
            place.offset = user - place.sign * reading.position
        await self._state.post_coordinates()

    async def put_hlm(self, user: float) -> None:
        """Set the upper limit in user coordinates."""
        await self._limit(
            "HLM", self._state.coordinates.dial(user), upper=not self._state.coordinates.negative
        )

    async def put_llm(self, user: float) -> None:
        """Set the lower limit in user coordinates."""
        await self._limit(
            "LLM", self._state.coordinates.dial(user), upper=self._state.coordinates.negative
        )

    async def put_dhlm(self, dial: float) -> None:
        """Set the upper limit in dial coordinates."""
        await self._limit("DHLM", dial, upper=True)

    async def put_dllm(self, dial: float) -> None:
        """Set the lower limit in dial coordinates."""
        await self._limit("DLLM", dial, upper=False)

    async def _limit(self, name: str, dial: float, *, upper: bool) -> None:
        place = self._state.coordinates
        low, high = (place.low, dial) if upper else (dial, place.high)
        place.set_limits(f"{self._state.name}.{name}", low, high)
        await self._state.post_coordinates()

    async def put_twv(self, distance: float) -> None:
        """Set the distance of TWF and TWR."""
        await self._state.post(TWV=distance)

    async def put_hlsv(self, choice: int) -> None:
        """Set the severity while a limit switch is active."""
        await self._state.post(HLSV=choice)

    async def _at_rest(self, name: str) -> Reading:
        return await self._motions.at_rest(f"{self._state.name}.{name}")
