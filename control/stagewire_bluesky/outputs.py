"""Outputs that can be set and read back: piezo actuators and shutters."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final, Generic, Literal

from event_model import Limits, LimitsRange
from ophyd_async.core import (
    MovableLogic,
    SignalDatatypeT,
    SignalMetadata,
    SignalR,
    SignalRW,
    StandardMovable,
    StandardReadable,
    StrictEnum,
    TimeoutCalculator,
)
from ophyd_async.core import StandardReadableFormat as Format

from stagewire.errors import (
    LimitError,
    MotionTimeoutError,
    NotReadyError,
    ReplyTimeoutError,
    UnknownScaleError,
)
from stagewire_apt.devices.values import PzStatusUpdate
from stagewire_bluesky.controller import Reference
from stagewire_bluesky.signals import PartBackend, SetpointBackend, put, readable

_PAUSE: Final = 0.05
"""Seconds between two requests for a value that was set."""
_UPDATE: Final = 1.0
"""Seconds in which the next status update must arrive; they are sent ten times a second."""
ARRIVAL: Final = 4.0
"""Seconds in which an output must report the value that was set."""
FULL: Final = 32767
"""Counts of the full output of a piezo controller."""


@dataclass
class OutputLogic(MovableLogic[SignalDatatypeT], Generic[SignalDatatypeT]):
    """Sets an output.

    :param check: raises an error for a value that would be refused.
    """

    check: Callable[[SignalDatatypeT], None] | None = None

    async def check_move(self, new_position: SignalDatatypeT) -> None:
        """Raise :class:`~stagewire.errors.LimitError` for a value outside the limits."""
        if self.check is not None:
            self.check(new_position)

    async def move(self, new_position: SignalDatatypeT, timeout: TimeoutCalculator) -> None:
        """Set the output, and return when the controller reports the value."""
        await put(self.setpoint, new_position, timeout())


async def _arrived(
    what: str, read: Callable[[], Awaitable[Any]], there: Callable[[Any], bool], wanted: object
) -> None:
    """Wait until a value is reported.

    Raise :class:`~stagewire.errors.MotionTimeoutError` if it is not reported in time.
    """
    deadline = time.monotonic() + ARRIVAL
    while not there(value := await read()):
        if time.monotonic() > deadline:
            raise MotionTimeoutError(
                f"{what}: {wanted} was not reported within {ARRIVAL:g} s; the controller reports {value}"
            )
        await asyncio.sleep(_PAUSE)


class Piezo(StandardMovable[float], StandardReadable):
    """A piezo actuator: in volts in open loop, in µm in closed loop.

    The readback is the output that the controller measures, from its next status update; a request would
    return the value that was set. The updates are switched on by the first reading. ``set`` is done when the
    readback is there. It is refused while the controller is in the other mode: no device switches the mode.
    An output cannot be stopped: after ``stop``, it keeps the last value that was set.

    :param reference: a piezo controller, or a channel or bay of one.
    :param loop: ``open`` or ``closed``.
    :param tolerance: how far from the value that was set the reported one may be, in V or µm.
    """

    def __init__(
        self,
        reference: Reference,
        name: str = "",
        *,
        loop: Literal["open", "closed"] = "open",
        tolerance: float = 0.1,
    ) -> None:
        if loop not in ("open", "closed"):
            raise ValueError(f"loop must be 'open' or 'closed', not {loop!r}")
        self._loop_mode = loop
        self._unit, self._what = ("V", "output_volts") if loop == "open" else ("um", "output_pos")
        self._keyword = "volts" if loop == "open" else "um"
        self._measured = "op_voltage_volts" if loop == "open" else "position_um"
        reference.require(f"set_{self._what}", f"piezo in {loop} loop")
        self.reference = reference
        self._tolerance = tolerance
        self._output = PartBackend(reference, float, self._read, metadata=self._metadata)
        with self.add_children_as_readables(Format.HINTED_UNCACHED_SIGNAL):
            self.readback: SignalR[float] = SignalR(self._output)
        with self.add_children_as_readables(Format.CONFIG_SIGNAL):
            self.control_mode: SignalR[str] = readable(reference, str, self._mode)
        self.setpoint: SignalRW[float] = SignalRW(
            SetpointBackend(reference, float, self._target, self._write, self._metadata),
            timeout=None,
        )
        super().__init__(name=name)

    @cached_property
    def movable_logic(self) -> OutputLogic[float]:
        """The logic that sets the output."""
        return OutputLogic(self.setpoint, self.readback, self._check)

    async def _read(self, part: Any) -> float:
        async with part.subscribe(PzStatusUpdate) as updates:
            await self._updates().start_updates()
            try:
                status = await updates.get(timeout=_UPDATE)
            except ReplyTimeoutError:
                raise ReplyTimeoutError(
                    f"{self.reference.source}: no status update arrived within {_UPDATE:g} s; check that the "
                    "controller is on and connected"
                ) from None
        return float(getattr(status, self._measured))

    def _updates(self) -> Any:
        """Return the part that sends updates: this one, or the controller of a channel."""
        part = self.reference.part
        return part if hasattr(part, "start_updates") else self.reference.controller.device

    async def _target(self, part: Any, wanted: float | None) -> float:
        return await self._read(part) if wanted is None else wanted

    async def _mode(self, part: Any) -> str:
        mode = (await part.get_pos_control_mode()).mode
        return getattr(mode, "name", None) or str(mode)

    async def _write(self, part: Any, value: float) -> None:
        mode = await self._mode(part)
        if self._loop_mode.upper() not in mode.split("_"):
            raise NotReadyError(
                f"{self.reference.source}: {value:g} {self._unit} was not sent: the controller is in the "
                f"mode {mode}, and this device is for {self._loop_mode} loop",
                (f"the control mode is {mode}",),
            )
        await getattr(part, f"set_{self._what}")(**{self._keyword: value})
        await _arrived(
            self.reference.source,
            lambda: self._read(part),
            lambda read: abs(read - value) <= self._tolerance,
            f"{value:g} {self._unit}",
        )
        await self._output.refresh()

    def _highest(self) -> float | None:
        scales = self.reference.part.scales
        quantity = "output_volts" if self._unit == "V" else "piezo_position"
        try:
            return float(scales.of(quantity, self._unit).from_counts(FULL))
        except UnknownScaleError:
            return None

    def _metadata(self, part: Any) -> SignalMetadata:
        metadata = SignalMetadata(units=self._unit, precision=3)
        if (high := self._highest()) is not None:
            metadata["limits"] = Limits(control=LimitsRange(low=0.0, high=high))
        return metadata

    def _check(self, value: float) -> None:
        if not self.reference.controller.is_open:  # in mock mode
            return
        high = self._highest()
        if value < 0 or (high is not None and value > high):
            shown = "unknown" if high is None else f"{high:g} {self._unit}"
            raise LimitError(
                f"{self.reference.source}: {value:g} {self._unit} is outside the range, 0 to {shown}; "
                "nothing was sent"
            )


class ShutterState(StrictEnum):
    """The states of a shutter."""

    OPEN = "Open"
    CLOSED = "Closed"


class Shutter(StandardMovable[ShutterState], StandardReadable):
    """A shutter on a solenoid controller (TSC001, KSC101). It is open while the solenoid is on.

    ``set`` is done when the controller reports the state. It fails in any operating mode but the manual one,
    and if the interlock keeps the shutter closed.

    :param reference: the controller.
    """

    def __init__(self, reference: Reference, name: str = "") -> None:
        reference.require("set_sol_state", "shutter")
        self.reference = reference
        self._output = PartBackend(reference, ShutterState, self._read)
        with self.add_children_as_readables(Format.HINTED_UNCACHED_SIGNAL):
            self.readback: SignalR[ShutterState] = SignalR(self._output)
        with self.add_children_as_readables(Format.CONFIG_SIGNAL):
            self.operating_mode: SignalR[str] = readable(reference, str, self._mode)
        self.setpoint: SignalRW[ShutterState] = SignalRW(
            PartBackend(reference, ShutterState, self._read, self._write), timeout=None
        )
        super().__init__(name=name)

    @cached_property
    def movable_logic(self) -> OutputLogic[ShutterState]:
        """The logic that opens and closes the shutter."""
        return OutputLogic(self.setpoint, self.readback)

    async def _read(self, part: Any) -> ShutterState:
        state = (await part.get_sol_state()).state
        if getattr(state, "name", "") == "SOLENOID_ON":
            return ShutterState.OPEN
        return ShutterState.CLOSED

    async def _mode(self, part: Any) -> str:
        mode = (await part.get_sol_operating_mode()).operating_mode
        return getattr(mode, "name", None) or str(mode)

    async def _write(self, part: Any, value: ShutterState) -> None:
        value = ShutterState(value)
        mode = await self._mode(part)
        if mode != "SOLENOID_MANUAL":
            raise NotReadyError(
                f"{self.reference.source}: {value.value} was not sent: the operating mode is {mode}, not "
                "SOLENOID_MANUAL",
                (f"the operating mode is {mode}",),
            )
        is_open = value is ShutterState.OPEN
        await part.set_sol_state(state="SOLENOID_ON" if is_open else "SOLENOID_OFF")
        await _arrived(
            self.reference.source,
            lambda: self._read(part),
            lambda state: state is value,
            value.value,
        )
        await self._output.refresh()
