"""An axis in µm, and the motion that was started on it."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import suppress
from typing import Any, Final

from stagewire.errors import (
    LimitError,
    MotionTimeoutError,
    ReplyTimeoutError,
    StagewireError,
    UnsupportedError,
)

UM: Final = {"mm": 1000.0, "um": 1.0}
"""Unit of a position -> µm."""
CHECK: Final = 0.5
"""Seconds between two checks whether the controller still answers and moves."""
ANSWER: Final = 1.0
"""Seconds that it has to answer."""
PATIENCE: Final = 2.5
"""Seconds without an answer, or at rest without a reported end, after which a motion fails."""


class AxisInUm:
    """An axis of an open controller.

    :param part: device, bay, channel or axis with ``move_absolute``.

    Raise :class:`TypeError` for any other part, and :class:`~stagewire.errors.UnsupportedError` for a part
    whose positions are not lengths.
    """

    def __init__(self, part: Any) -> None:
        if not hasattr(part, "start_move_absolute"):
            raise TypeError(f"{part!r} cannot be a stage; expected a motor, such as rack.bay(1)")
        unit = part.scales.unit_of("position")
        part.scales.of("position", unit)  # raises an error for an unknown scale
        if unit not in UM:
            raise UnsupportedError(f"{part!r} is in {unit}, and stages of pymmcore are in µm")
        self.part = part
        self._unit = unit
        self._stop_disables = hasattr(part, "start_motor")
        self._disabled = False
        self._motion: Any = None
        self._failure: StagewireError | None = None
        self._answered = self._moved = self._checked = 0.0

    @property
    def position(self) -> float:
        """The position in µm; asks the controller."""
        return float(self.part.position) * UM[self._unit]

    def check(self, target: float) -> None:
        """Raise :class:`~stagewire.errors.LimitError` for a target outside the travel, if that is known."""
        ends = self.part.travel
        if ends is not None:
            low, high = (end * UM[self._unit] for end in ends)
            if not low - 1e-6 <= target <= high + 1e-6:
                raise LimitError(
                    f"{self.part!r}: {target:g} µm is outside the travel, {low:g} to {high:g} µm; nothing "
                    "was sent"
                )

    def move(self, target: float) -> None:
        """Start a motion to a position in µm, after a stop of the one that is under way."""
        value = target / UM[self._unit]
        self._begin(lambda: self.part.start_move_absolute(**{self._unit: value}))

    def home(self) -> None:
        """Start homing."""
        if not hasattr(self.part, "start_home"):
            raise UnsupportedError(f"{self.part!r} cannot home")
        self._begin(self.part.start_home)

    def stop(self) -> None:
        """Stop; a motion that was under way then has failed.

        A stop disables the motor of an MS-2000. So its axis is left alone if it says that it is at rest, and
        its motor is enabled before the next motion.
        """
        if self._stop_disables:
            with suppress(ReplyTimeoutError):  # then it may be moving
                if not self.part.is_moving(timeout=ANSWER):
                    return
            self._disabled = True
        self.part.stop()

    def _begin(self, start: Callable[[], Any]) -> None:
        if self._motion is not None and not self._motion.done:
            self.stop()
            with suppress(StagewireError):
                self._motion.wait(PATIENCE)
        self._motion, self._failure = None, None
        if (
            self._disabled
        ):  # enabling moves an axis to its last target, so that must be its position
            here = self.part.read_motor_position_and_status().message.position
            self.part.move_absolute(counts=int(here), timeout=ANSWER)
            self.part.start_motor()
            self._disabled = False
        self._motion = start()
        self._answered = self._moved = self._checked = time.monotonic()

    def busy(self) -> bool:
        """Return whether the motion is under way.

        Raise the error of a motion that has failed, until the next one begins. So nothing that waits for the
        axis continues at a wrong position.
        """
        if self._failure is not None:
            raise self._failure
        if self._motion is None:
            return False
        try:
            self._motion.wait(0.001)
        except MotionTimeoutError as error:
            if not self._motion.done:
                return self._still_moves()
            self._failure = error
        except StagewireError as error:
            self._failure = error
        if self._failure is not None:
            self._motion = None
            raise self._failure
        self._motion = None
        return False

    def _still_moves(self) -> bool:
        now = time.monotonic()
        if now - self._checked < CHECK:
            return True
        self._checked = now
        try:
            moving = self.part.is_moving(timeout=ANSWER)
        except ReplyTimeoutError as error:
            if now - self._answered > PATIENCE:
                self._fail(
                    ReplyTimeoutError(
                        f"{self.part!r}: the controller fell silent during a motion, which may still be "
                        f"under way: {error}"
                    )
                )
            return True
        except StagewireError as error:
            self._fail(error)
        self._answered = now
        if moving:
            self._moved = now
        elif now - self._moved > PATIENCE:
            with suppress(StagewireError):
                self.part.stop(timeout=ANSWER)
            self._fail(
                MotionTimeoutError(
                    f"{self.part!r}: the axis is at rest, but the controller has not reported the end of its "
                    "motion; a stop was sent"
                )
            )
        return True

    def _fail(self, error: StagewireError) -> None:
        self._motion, self._failure = None, error
        raise error
