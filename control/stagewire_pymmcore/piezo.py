"""Piezo stages in closed loop. Positions are in µm."""

from __future__ import annotations

import time
from typing import Any, Final

from pymmcore_plus.experimental.unicore import StageDevice

from stagewire.errors import LimitError, MotionTimeoutError, NotReadyError, UnsupportedError
from stagewire_apt.devices.values import PzStatusUpdate

ARRIVAL: Final = 5.0
"""Seconds until the measured position must be at the target."""
_UPDATE: Final = 1.0
"""Seconds until the next status update; a controller sends ten a second."""
_FULL: Final = 32767
"""Counts of the whole travel."""


class PiezoStage(StageDevice):
    """A piezo in closed loop, such as a focus piezo on a TPZ001 or BPC301.

    The position is the measured one, from status updates. The control mode is not switched: a controller in
    open loop refuses positions. A piezo cannot home, and has no motion to stop.

    :param part: an open piezo controller, or a channel or bay of one.
    :param controller: the controller of a channel or bay; the default is the part itself.
    :param tolerance: distance in µm from the target within which it counts as reached.

    Raise :class:`TypeError` for any other part.
    """

    def __init__(self, part: Any, controller: Any = None, *, tolerance: float = 0.1) -> None:
        super().__init__()
        if not hasattr(part, "set_output_pos"):
            raise TypeError(
                f"{part!r} cannot be a piezo stage; expected a piezo, such as TPZ001.open(…)"
            )
        self._part = part
        self._updates = part if hasattr(part, "start_updates") else controller
        if self._updates is None:
            raise TypeError(f"{part!r} sends no updates itself: state its controller")
        self._tolerance = tolerance
        self._origin = 0.0
        self._target: float | None = None
        self._deadline = 0.0

    def set_position_um(self, val: float) -> None:
        """Set the position; :meth:`busy` is true until it is measured.

        Raise :class:`~stagewire.errors.LimitError`, and :class:`~stagewire.errors.NotReadyError` in open
        loop.
        """
        target = val + self._origin
        high = float(self._part.scales.of("piezo_position", "um").from_counts(_FULL))
        if not 0 <= target <= high:
            raise LimitError(
                f"{self._part!r}: {target:g} µm is outside the travel, 0 to {high:g} µm; nothing was sent"
            )
        mode = self._part.get_pos_control_mode().mode
        name = getattr(mode, "name", None) or str(mode)
        if "CLOSED" not in name.split("_"):
            raise NotReadyError(
                f"{self._part!r}: {target:g} µm was not sent: the control mode is {name}, not closed loop",
                (f"the control mode is {name}",),
            )
        self._part.set_output_pos(um=target)
        self._target, self._deadline = target, time.monotonic() + ARRIVAL

    def get_position_um(self) -> float:
        """Return the measured position, from the next status update."""
        return self._measured() - self._origin

    def busy(self) -> bool:
        """Return whether the target is not measured yet.

        Raise :class:`~stagewire.errors.MotionTimeoutError` if it is not in time, until the next one is set.
        """
        if self._target is None:
            return False
        position = self._measured()
        if abs(position - self._target) <= self._tolerance:
            self._target = None
            return False
        if time.monotonic() > self._deadline:
            raise MotionTimeoutError(
                f"{self._part!r}: {self._target:g} µm was not reported within {ARRIVAL:g} s; the controller "
                f"reports {position:g} µm"
            )
        return True

    def home(self) -> None:
        """Raise :class:`~stagewire.errors.UnsupportedError`."""
        raise UnsupportedError(f"{self._part!r}: a piezo cannot home")

    def stop(self) -> None:
        """Do nothing: a piezo settles within milliseconds and cannot be stopped."""

    def set_origin(self) -> None:
        """Call the present position 0; nothing moves."""
        self.set_adapter_origin_um(0.0)

    def set_adapter_origin_um(self, newZUm: float) -> None:
        """Give the present position another number; nothing moves."""
        self._origin = self._measured() - newZUm

    def _measured(self) -> float:
        with self._part.subscribe(PzStatusUpdate) as updates:
            self._updates.start_updates()
            return float(updates.get(timeout=_UPDATE).position_um)
