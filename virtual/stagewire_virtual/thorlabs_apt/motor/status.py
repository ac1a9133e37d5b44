"""What a motor channel says of itself at this instant.

Status bits (pages 77 to 80), the position counter and the encoder counter (pages 28 and 29).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import Enum

from stagewire_apt.flags import DcStatusBits, StepperStatusBits
from stagewire_virtual.axis import SimulatedAxis


class Activity(Enum):
    """What a motor is told to do; the value is what people read."""

    NOTHING = "at rest"
    MOVING = "moving"
    JOGGING = "jogging"
    HOMING = "homing"
    STOPPING = "stopping"


@dataclass(frozen=True, slots=True)
class MotorState:
    """What the status bits say.

    :param doing: until it is completed, which is after the axis has settled.
    :param direction: of its motion, 1 forward (CW) and -1 reverse (CCW); 0 at rest.
    :param homed: whether it has been homed since it was switched on.
    :param limits: limit bits by name.
    :param enabled: whether the channel is.
    :param tracking: whether the position error is within the track window.
    :param settled: whether it has settled at the demanded position.
    :param motion_error: whether an excessive position error has stopped it.
    """

    doing: Activity
    direction: int
    homed: bool
    limits: Mapping[str, bool]
    enabled: bool
    tracking: bool
    settled: bool
    motion_error: bool

    @property
    def words(self) -> str:
        """What it does, for people."""
        if not self.enabled:
            return "disabled"
        if self.motion_error:
            return "motion error"
        if self.doing is Activity.NOTHING:
            return "homed" if self.homed else self.doing.value
        towards = {1: " forward", -1: " reverse"}.get(self.direction, "")
        return f"{self.doing.value}{towards}"


def _motion(state: MotorState) -> dict[str, bool]:
    """Return the bits that steppers and DC servos share.

    A jog or a homing run is a motion, too: hosts that ask for the bits of a motion only must not take it
    for rest.
    """
    forward, reverse = state.direction > 0, state.direction < 0
    jogging = state.doing is Activity.JOGGING
    return {
        "moving_forward": forward,
        "moving_reverse": reverse,
        "jogging_forward": forward and jogging,
        "jogging_reverse": reverse and jogging,
        "homing": state.doing is Activity.HOMING,
        "homed": state.homed,
    }


def _stepper(state: MotorState) -> int:
    """Return the bits of page 77; a motor is connected, and nothing holds its interlock open."""
    return StepperStatusBits.of(
        **_motion(state), **state.limits, motor_connected=True, interlock_enabled=True
    )


def _dc(state: MotorState) -> int:
    """Return the bits of pages 79 and 80; the current never reaches its limit."""
    return DcStatusBits.of(
        **_motion(state),
        forward_hardware_limit=state.limits["forward_hardware_limit"],
        reverse_hardware_limit=state.limits["reverse_hardware_limit"],
        tracking=state.tracking,
        settled=state.settled,
        motion_error=state.motion_error,
        channel_enabled=state.enabled,
    )


STATUS_BITS: Mapping[str, Callable[[MotorState], int]] = {"stepper": _stepper, "dc": _dc}
"""``status`` of a unit -> its status bits."""


class Counter:
    """Counts from where it was last set, in 32 bits with a sign, and goes round beyond them.

    :param axis: whose places it counts; it is 0 where the stage stands.
    """

    def __init__(self, axis: SimulatedAxis) -> None:
        self._axis = axis
        self.set(0)

    def set(self, value: int) -> None:
        """Let it show ``value`` at the place of this instant."""
        self.origin = round(self._axis.place) - value

    @property
    def value(self) -> int:
        """What it shows at this instant."""
        counts = round(self._axis.place) - self.origin
        return (counts + 0x8000_0000) % 0x1_0000_0000 - 0x8000_0000
