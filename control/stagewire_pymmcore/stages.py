"""Stages with one and with two axes. Positions are in µm."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

from pymmcore_plus.experimental.unicore import StageDevice, XYStageDevice

from stagewire.errors import StagewireError
from stagewire_pymmcore.axis import AxisInUm


class Stage(StageDevice):
    """A stage with one axis, such as a focus drive.

    ``core.setPosition`` starts a motion, and ``core.waitForDevice`` waits for its end at the target; a motion
    that fails raises its error there. Setting an origin moves nothing: it is kept here and not in the
    controller, so the travel stays known.

    :param part: an open motor, such as ``KDC101.open(…)`` or ``rack.bay(1)``. The device does not close it.

    Raise :class:`TypeError` and :class:`~stagewire.errors.UnsupportedError` for a part that is not a linear
    motor, and :class:`~stagewire.errors.UnknownScaleError` without a scale.
    """

    def __init__(self, part: Any) -> None:
        super().__init__()
        self._axis = AxisInUm(part)
        self._origin = 0.0

    def set_position_um(self, val: float) -> None:
        """Start a motion. Raise :class:`~stagewire.errors.LimitError` and the errors of motions."""
        self._axis.check(val + self._origin)
        self._axis.move(val + self._origin)

    def get_position_um(self) -> float:
        """Ask the controller for the position."""
        return self._axis.position - self._origin

    def busy(self) -> bool:
        """Return whether a motion is under way; raise the error of one that has failed."""
        return self._axis.busy()

    def home(self) -> None:
        """Start homing."""
        self._axis.home()

    def stop(self) -> None:
        """Stop."""
        self._axis.stop()

    def set_origin(self) -> None:
        """Call the present position 0; nothing moves."""
        self.set_adapter_origin_um(0.0)

    def set_adapter_origin_um(self, newZUm: float) -> None:
        """Give the present position another number; nothing moves."""
        self._origin = self._axis.position - newZUm

    def shutdown(self) -> None:
        """Stop a motion that is under way, when the device is unloaded."""
        _stop_busy([self._axis])


class XYStage(XYStageDevice):
    """A stage with two axes, which move together.

    If a target is outside the travel of one axis, neither moves. If one axis fails, the other is stopped.

    :param x: an open motor; it may be on the same controller as ``y``.
    :param y: the other one.
    """

    def __init__(self, x: Any, y: Any) -> None:
        super().__init__()
        self._axes = (AxisInUm(x), AxisInUm(y))
        self._origin = (0.0, 0.0)

    def set_position_um(self, x: float, y: float) -> None:
        """Start a motion of both axes."""
        targets = (x + self._origin[0], y + self._origin[1])
        for axis, target in zip(self._axes, targets, strict=True):
            axis.check(target)
        moves = zip(self._axes, targets, strict=True)
        self._begin([partial(axis.move, target) for axis, target in moves])

    def get_position_um(self) -> tuple[float, float]:
        """Ask the controllers for the position."""
        x, y = self._axes
        return x.position - self._origin[0], y.position - self._origin[1]

    def busy(self) -> bool:
        """Return whether an axis moves; raise the error of a motion that has failed."""
        try:
            states = [axis.busy() for axis in self._axes]  # asks both
            return any(states)
        except StagewireError:
            _stop_busy(self._axes)
            raise

    def home(self) -> None:
        """Start homing of both axes."""
        self._begin([axis.home for axis in self._axes])

    def stop(self) -> None:
        """Stop both axes, even if one cannot be stopped."""
        try:
            self._axes[0].stop()
        finally:
            self._axes[1].stop()

    def set_origin_x(self) -> None:
        """Call the present position of X 0; nothing moves."""
        self._origin = (self._axes[0].position, self._origin[1])

    def set_origin_y(self) -> None:
        """Call the present position of Y 0; nothing moves."""
        self._origin = (self._origin[0], self._axes[1].position)

    def set_adapter_origin_um(self, x: float, y: float) -> None:
        """Give the present position another number; nothing moves."""
        self._origin = (self._axes[0].position - x, self._axes[1].position - y)

    def shutdown(self) -> None:
        """Stop motions that are under way, when the device is unloaded."""
        _stop_busy(self._axes)

    def _begin(self, starts: Sequence[Callable[[], None]]) -> None:
        starts[0]()
        try:
            starts[1]()
        except StagewireError:
            self._axes[0].stop()
            raise


def _stop_busy(axes: Sequence[AxisInUm]) -> None:
    for axis in axes:
        try:
            if axis.busy():
                axis.stop()
        except StagewireError:  # it has failed, and says so when it is used
            continue
