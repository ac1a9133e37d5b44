"""The stage on a motor channel: counters, travel and status (pages 28, 29, 75 to 81)."""

from __future__ import annotations

import struct
from collections.abc import Mapping
from typing import Any, Final

from stagewire import Frame, FramedMessage
from stagewire_apt import messages as m
from stagewire_virtual.axis import SimulatedAxis
from stagewire_virtual.thorlabs_apt.channel import (
    Behaviour,
    Channel,
    LiveState,
    amends,
    handles,
    live,
    stored,
)
from stagewire_virtual.thorlabs_apt.motor.defaults import (
    is_brushless,
    is_endless,
    motor_defaults,
    starting_place,
    travel_of,
)
from stagewire_virtual.thorlabs_apt.motor.drive import Drive
from stagewire_virtual.thorlabs_apt.motor.moves import Scales
from stagewire_virtual.thorlabs_apt.motor.status import (
    STATUS_BITS,
    Activity,
    Counter,
    MotorState,
    intact_bits,
)
from stagewire_virtual.thorlabs_apt.motor.travel import active_limits, index_run, soft_limits

_SCALES: Final = 6 + 50
"""The offset of the reserved bytes in the frame of MOT_GET_PMDSTAGEAXISPARAMS."""
_FASTEST: Final = 0x7FFF
"""The highest velocity that fits into a DC status."""


class StageChannel(Behaviour):
    """A channel with a stage.

    :param channel: its channel.
    """

    can_stick = True

    def __init__(self, channel: Channel) -> None:
        super().__init__(channel)
        self._kind: str = channel.unit.facts["status"]
        self._intact = intact_bits(channel.unit)
        self._scales = Scales(channel.settings.stage, channel.unit.name)
        travel = travel_of(channel, self._scales)
        place = starting_place(channel, travel)
        below = index_run(travel) if is_brushless(channel) else 0
        endless = is_endless(channel)
        self._axis = SimulatedAxis(channel.clock, travel, place, below=below, endless=endless)
        self._drive = Drive(
            channel, self._axis, lambda: soft_limits(channel, self._position.origin)
        )
        self._reset()

    @classmethod
    def defaults(cls, channel: Channel) -> Mapping[str, Mapping[str, Any]]:
        """Return the parameters of a new controller: set -> field -> value."""
        return motor_defaults(channel)

    def power_on(self) -> None:
        """Reset to the power-on state: not homed, with counters of 0 at the present position."""
        self._drive.rest()
        self._reset()

    def _reset(self) -> None:
        self._drive.motion_error = False
        self._homed = False
        self._position = Counter(self._axis)
        self._encoder = Counter(self._axis)

    def stuck_changed(self) -> None:
        """Block the stage, or release it."""
        self._drive.hold(self.channel.stuck)

    # Counters and the stage

    @live("MOT_POSCOUNTER")
    def position(self) -> dict[str, int]:
        """Return the position counter (page 28)."""
        return {"position": self._position.value}

    @stored("MOT_POSCOUNTER")
    def position_was_set(self, frame: Frame) -> None:
        """Set the counter; nothing moves, and a move in progress keeps its physical target."""
        self._position.set(self.channel.parameter("MOT_POSCOUNTER", "position"))

    @live("MOT_ENCCOUNTER")
    def encoder_count(self) -> dict[str, int]:
        """Return the encoder counter (page 29)."""
        return {"encoder_count": self._encoder.value}

    @stored("MOT_ENCCOUNTER")
    def encoder_count_was_set(self, frame: Frame) -> None:
        """Set the counter."""
        self._encoder.set(self.channel.parameter("MOT_ENCCOUNTER", "encoder_count"))

    @handles("MOT_SET_PMDSTAGEAXISPARAMS")
    def shorten_travel(self, frame: Frame) -> None:
        """Raise the minimum or lower the maximum position; nothing else can be set (page 75)."""
        stage = self.channel.parameters["MOT_PMDSTAGEAXISPARAMS"]
        match frame.message:
            case m.MotSetPmdStageAxisParams(min_pos=minimum, max_pos=maximum):
                minimum, maximum = max(minimum, stage["min_pos"]), min(maximum, stage["max_pos"])
                if minimum <= maximum:
                    stage.update(min_pos=minimum, max_pos=maximum)
                else:
                    self.channel.report_fault(frame, "the minimum would be above the maximum")

    @amends("MOT_GET_PMDSTAGEAXISPARAMS")
    def with_scales(self, message: FramedMessage) -> FramedMessage:
        """Fill the reserved bytes with the scales of the stage, if it has one.

        The document reserves them. The vendor's XA software reads a gear ratio, microsteps, and the scales of
        positions, velocities and accelerations as floats there (TLMC_StageAxisParams of thorlabs_xa
        1.9.1.28993), and cannot convert positions if they are 0.
        """
        scales = self._scales
        if not scales.counts_per_mm:
            return message
        counts = float(scales.counts_per_mm)
        raw = message.pack(0, 0)
        floats = (counts, counts / scales.velocity, counts / scales.acceleration)
        data = struct.pack("<HH3f", 1, 1, *floats)
        return type(message).unpack(raw[:_SCALES] + data + raw[_SCALES + len(data) :])

    # Status

    @live("MOT_STATUSBITS")
    def status_bits(self) -> dict[str, int]:
        """Return the status bits, which are those of the DC status on every motor (page 81)."""
        return self._bits("dc")

    def status(self) -> Mapping[str, int]:
        """Return the present fields of the status message (pages 77 and 79)."""
        position = self._position.value
        if self._kind == "stepper":
            return {"position": position, "enc_count": self._encoder.value, **self._bits("stepper")}
        velocity = round(self._axis.velocity / self._scales.status_velocity)
        velocity = min(max(velocity, -_FASTEST), _FASTEST)
        return {"position": position, "velocity": velocity, **self._bits("dc")}

    def row(self) -> LiveState:
        """Return the position, in mm or degrees if the scale is known or else in counts, and the state."""
        counts = self._position.value
        stage, scale = self.channel.settings.stage, self._scales.counts_per_mm
        unit = "deg" if stage is not None and stage.rotary else "mm"
        position = f"{float(counts / scale):.4f} {unit}" if scale else f"{counts} counts"
        return LiveState(position, self._state().words)

    def _bits(self, table: str) -> dict[str, int]:
        return {"status_bits": STATUS_BITS[table](self._state())}

    def _state(self) -> MotorState:
        action, drive = self._drive.action, self._drive
        return MotorState(
            doing=Activity.NOTHING if action is None else action.doing,
            direction=self._axis.direction * self.channel.clockwise,
            homed=self._homed,
            limits=active_limits(self.channel, self._axis, self._position.value),
            enabled=self.channel.enabled,
            tracking=self.channel.enabled and drive.tracking,
            settled=self.channel.enabled and drive.settled,
            motion_error=drive.motion_error,
            intact=self._intact,
        )
