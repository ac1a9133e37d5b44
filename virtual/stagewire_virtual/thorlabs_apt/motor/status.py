"""The state of a motor channel: status bits (pages 77 to 80) and counters (pages 28 and 29)."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from enum import Enum

from stagewire_apt.flags import DcStatusBits, StepperStatusBits
from stagewire_virtual.axis import SimulatedAxis
from stagewire_virtual.instrument import Unit


class Activity(Enum):
    """The kind of an action; the value is its name for people."""

    NOTHING = "at rest"
    MOVING = "moving"
    JOGGING = "jogging"
    HOMING = "homing"
    STOPPING = "stopping"


@dataclass(frozen=True, slots=True)
class MotorState:
    """The state that the status bits report.

    :param doing: the kind of the present action, until it is completed after settling.
    :param direction: the direction of motion, 1 forward (CW) or -1 reverse (CCW); 0 at rest.
    :param homed: whether it has been homed since power-on.
    :param limits: limit bits by name.
    :param enabled: whether the channel is enabled.
    :param tracking: whether the position error is within the track window.
    :param settled: whether it has settled at the demanded position.
    :param motion_error: whether an excessive position error has stopped it.
    :param intact: the bits of the DC status that are set because nothing is wrong, by name.
    """

    doing: Activity
    direction: int
    homed: bool
    limits: Mapping[str, bool]
    enabled: bool
    tracking: bool
    settled: bool
    motion_error: bool
    intact: Collection[str] = ()

    @property
    def words(self) -> str:
        """A description for people."""
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

    A jog or a homing run also sets the bits of motion, because some hosts check only these.
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
    """Return the bits of page 77; the motor is connected and its interlock enabled."""
    return StepperStatusBits.of(
        **_motion(state), **state.limits, motor_connected=True, interlock_enabled=True
    )


def _dc(state: MotorState) -> int:
    """Return the bits of pages 79 and 80; the current never reaches its limit.

    Issue 3 has no bits for software limits, but Issue 37 has.
    """
    known = {name: active for name, active in state.limits.items() if name in DcStatusBits.bits}
    return DcStatusBits.of(
        **_motion(state),
        **known,
        **dict.fromkeys(state.intact, True),
        tracking=state.tracking,
        settled=state.settled,
        motion_error=state.motion_error,
        channel_enabled=state.enabled,
    )


def intact_bits(unit: Unit) -> frozenset[str]:
    """Return the bits of the DC status with which a unit reports that nothing is wrong, by name.

    Only an overlay has such bits. A unit reports those of its own table. The bits of a stepper are those of
    its own status, which also has :attr:`motor_connected`.
    """
    if "MOT_GET_STATUSBITS" not in unit.messages:
        return frozenset()
    [layout] = unit.message("MOT_GET_STATUSBITS")["layouts"]
    field = next(field for field in layout["fields"] if field["name"] == "status_bits")
    own = field.get("flags_by_unit", {}).get(unit.name)
    if own is not None:
        bits = unit.registry["flags"][own]["bits"]
        return frozenset({"motor_connected", "power_ok"} & bits.keys())
    stepper = unit.facts["status"] == "stepper"
    return frozenset({"motor_connected"} & field["flags"].keys() if stepper else ())


STATUS_BITS: Mapping[str, Callable[[MotorState], int]] = {"stepper": _stepper, "dc": _dc}
"""``status`` of a unit -> its status bits."""


class Counter:
    """A signed counter of 32 bits that follows an axis and wraps around.

    :param axis: the axis; the counter is 0 at its present position.
    """

    def __init__(self, axis: SimulatedAxis) -> None:
        self._axis = axis
        self.set(0)

    def set(self, value: int) -> None:
        """Set the counter to ``value`` at the present position."""
        self.origin = round(self._axis.place) - value

    @property
    def value(self) -> int:
        """The present value."""
        counts = round(self._axis.place) - self.origin
        return (counts + 0x8000_0000) % 0x1_0000_0000 - 0x8000_0000
