"""Shutters on a solenoid controller."""

from __future__ import annotations

import time
from contextlib import suppress
from typing import Any, Final

from pymmcore_plus.experimental.unicore import ShutterDevice

from stagewire.errors import MotionTimeoutError, NotReadyError, StagewireError

ARRIVAL: Final = 2.0
"""Seconds until the controller must report the state that was set."""
_PAUSE: Final = 0.02


class Shutter(ShutterDevice):
    """A shutter on a TSC001 or KSC101. It is open while the solenoid is on.

    It is closed when the device is unloaded. Nothing opens it but ``core.setShutterOpen`` and, in an
    acquisition, the automatic shutter of the core.

    :param part: the open controller.

    Raise :class:`TypeError` for any other part.
    """

    def __init__(self, part: Any) -> None:
        super().__init__()
        if not hasattr(part, "set_sol_state"):
            raise TypeError(f"{part!r} cannot be a shutter; expected one, such as TSC001.open(…)")
        self._part = part

    def get_open(self) -> bool:
        """Ask the controller whether the shutter is open."""
        return getattr(self._part.get_sol_state().state, "name", "") == "SOLENOID_ON"

    def set_open(self, open: bool) -> None:
        """Open or close it, and return when the controller reports it.

        Raise :class:`~stagewire.errors.NotReadyError` in any mode but the manual one, and
        :class:`~stagewire.errors.MotionTimeoutError` if an interlock keeps it closed.
        """
        wanted = "open" if open else "closed"
        if open:  # closing depends on nothing
            mode = self._part.get_sol_operating_mode().operating_mode
            name = getattr(mode, "name", None) or str(mode)
            if name != "SOLENOID_MANUAL":
                raise NotReadyError(
                    f"{self._part!r}: not opened: the operating mode is {name}, not SOLENOID_MANUAL",
                    (f"the operating mode is {name}",),
                )
        self._part.set_sol_state(state="SOLENOID_ON" if open else "SOLENOID_OFF")
        deadline = time.monotonic() + ARRIVAL
        while self.get_open() is not open:
            if time.monotonic() > deadline:
                raise MotionTimeoutError(
                    f"{self._part!r}: the controller does not report {wanted} within {ARRIVAL:g} s; check "
                    "its interlock"
                )
            time.sleep(_PAUSE)

    def shutdown(self) -> None:
        """Close the shutter."""
        with suppress(StagewireError):  # the line may be lost
            self.set_open(False)
