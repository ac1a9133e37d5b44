"""The channel of a PDXC2, in open and in closed loop (programs of the vendor, not in Issue 37)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Final

from stagewire import Frame
from stagewire_apt import messages as m
from stagewire_apt.enumerations import (
    AmplifierOutputMode,
    EnableState,
    JogMode,
    PositionControlMode,
)
from stagewire_apt.flags import Pdxc2StatusBits
from stagewire_virtual.thorlabs_apt.channel import Channel, LiveState, handles, stored
from stagewire_virtual.thorlabs_apt.inertial.constants import STAGE
from stagewire_virtual.thorlabs_apt.inertial.drive import Action
from stagewire_virtual.thorlabs_apt.inertial.inertial import Inertial, wrapped
from stagewire_virtual.thorlabs_apt.motor.status import Activity

_CLOSED = (PositionControlMode.CLOSED_LOOP, PositionControlMode.CLOSED_LOOP_SMOOTH)
_JOG = "PZMOT_PDXC2JOGPARAMS"

_DEFAULTS: Final[Mapping[str, Mapping[str, int]]] = {
    "PZ_POSCONTROLMODE": {"mode": PositionControlMode.OPEN_LOOP},
    "PZMOT_CLOSEDLOOPPARAMS": {
        "ref_speed": 5_000_000,
        "proportional": 1000,
        "integral": 50,
        "differential": 0,
        "acceleration": 50_000_000,
    },
    "PZMOT_PDXC2JOGPARAMS": {
        "jog_mode": JogMode.SINGLE_STEP,
        "open_loop_step_size": 100,
        "open_loop_step_rate": 2000,
        "open_loop_acceleration": 20_000,
        "closed_loop_step_size": 100_000,
        "closed_loop_speed": 5_000_000,
        "closed_loop_acceleration": 50_000_000,
    },
    "PZMOT_AMPOUTPARAMS": {
        "mode": AmplifierOutputMode.BOTH_DIRECTIONS,
        "forward_amplitude": 100,
        "reverse_amplitude": 100,
    },
    "PZMOT_ABNORMALMOVEDETECTION": {"detection": 1},
}
"""Assumptions within the ranges of the registry; the vendor's simulated PDXC2 reports a detection of 1."""

_PDX1: Final[Mapping[str, Any]] = {
    "stage_id": 1,
    "axis_id": 18,
    "part_no_axis": "PDX1",
    "serial_num": 1_234_567,
    "cnts_per_unit": 1_000_000,
    "max_accn": 100_000_000,
    "max_dec": 100_000_000,
    "max_vel": 10_000_000,
}
"""The stage of the simulated PDXC2 of thorlabs_xa 1.9.1.28993 in nm and s; its travel is also 20 mm."""


class OricChannel(Inertial):
    """The channel of a PDXC2 with its stage.

    Decisions, because no document describes the PDXC2:

    * A new channel is disabled and in open loop, because the vendor's serial example enables it and sets the
      loop first.
    * The position is a number of steps in open loop. In closed loop it is the distance from the index in nm,
      or from the position at power-on before homing.
    * MOT_MOVE_HOME moves to the index in the middle of the travel, in both modes, with the speed of
      PZMOT_CLOSEDLOOPPARAMS. Afterwards both positions are 0.
    * The stored move in open loop is relative. Its rate and acceleration are those of jogs in open loop,
      because no other set has them. The stored move in closed loop is absolute.
    * The amplitudes of PZMOT_AMPOUTPARAMS scale the steps in open loop. The gains have no effect.
    * A closed loop stops at the ends of the travel with the bit of a limit. In open loop the drive steps on.
    * A closed loop whose stage is blocked stops after half a second with the bits ``abnormal_movement`` and
      ``error``, if PZMOT_ABNORMALMOVEDETECTION is not 0. The next move clears them.
    * The trigger input and the analog connectors are not simulated.

    :param channel: its channel.
    """

    mechanics = STAGE

    def __init__(self, channel: Channel) -> None:
        super().__init__(channel)
        channel.enabled = False
        self._reset()

    @classmethod
    def defaults(cls, channel: Channel) -> Mapping[str, Mapping[str, Any]]:
        """Return the parameters of a new controller: set -> field -> value."""
        travel = channel.settings.travel
        half = (cls.mechanics.travel if travel is None else travel) // 2
        return {
            **_DEFAULTS,
            "MOD_CHANENABLESTATE": {"enable_state": EnableState.DISABLE},
            "MOT_PMDSTAGEAXISPARAMS": {
                **_PDX1,
                "min_pos": -half,
                "max_pos": half,
            },
        }

    def power_on(self) -> None:
        """Reset to the power-on state: not homed, with positions of 0."""
        super().power_on()
        self._reset()

    def _reset(self) -> None:
        self._zero = self.actuator.position
        self._homed = self._abnormal = False

    @property
    def closed(self) -> bool:
        """Whether the loop is closed."""
        return self.channel.parameter("PZ_POSCONTROLMODE", "mode") in _CLOSED

    @property
    def position(self) -> int:
        """The position: steps in open loop, nm in closed loop."""
        if self.closed:
            return wrapped(round(self.actuator.position - self._zero))
        return super().position

    def obeys_switch(self, direction: int) -> bool:
        """Return whether motion ends at an end of the travel: only in closed loop."""
        return self.closed

    def lost(self) -> bool:
        """Report an abnormal movement, if its detection is on."""
        self._abnormal = bool(self.channel.parameter("PZMOT_ABNORMALMOVEDETECTION", "detection"))
        return self._abnormal

    def begin(self, action: Action) -> None:
        """Start an action, and clear the error of the previous one."""
        if self.enabled:
            self._abnormal = False
        super().begin(action)

    @stored("PZ_POSCONTROLMODE")
    def loop_was_set(self, frame: Frame) -> None:
        """Stop a motion of the other loop."""
        action = self._drive.action
        if action is not None and (action.amplitude is None) is not self.closed:
            self.rest()

    @handles("MOT_MOVE_HOME")
    def move_home(self, frame: Frame) -> None:
        """Move to the index."""
        self._homed = False
        self.begin(self._slide(frame, Activity.HOMING, self.actuator.travel / 2, self._found_home))

    def _found_home(self, cause: Frame) -> None:
        self._homed = True
        self._zero = self.actuator.position
        self.set_position(0)
        self.channel.send(m.MotMoveHomed(self.channel.ident), cause)

    @handles("PZMOT_MOVE_START")
    def move_start(self, frame: Frame) -> None:
        """Start the stored move of the present loop."""
        ask = self.channel.parameter
        if self.closed:
            place = self._zero + ask("PZMOT_CLOSEMOVEPARAMS", "position")
            self.begin(self._slide(frame, Activity.MOVING, place, self.completed))
        else:
            steps = ask("PZMOT_OPENMOVEPARAMS", "step_size")
            self.begin(self._steps(frame, Activity.MOVING, steps))

    @handles("PZMOT_MOVE_JOG")
    def move_jog(self, frame: Frame) -> None:
        """Jog by the step of the present loop, or until it is stopped."""
        direction = self.direction_of(frame)
        if not direction:
            return
        ask = self.channel.parameter
        loop = "closed_loop" if self.closed else "open_loop"
        single = ask(_JOG, "jog_mode") == JogMode.SINGLE_STEP
        distance = direction * (ask(_JOG, f"{loop}_step_size") if single else math.inf)
        if not self.closed:
            self.begin(self._steps(frame, Activity.JOGGING, distance))
            return
        rate, acceleration = ask(_JOG, "closed_loop_speed"), ask(_JOG, "closed_loop_acceleration")
        self.begin(
            Action(
                Activity.JOGGING,
                frame,
                distance,
                rate,
                acceleration,
                self.completed,
                amplitude=None,
            )
        )

    def _steps(self, frame: Frame, doing: Activity, distance: float) -> Action:
        """Return an action in open loop."""
        ask = self.channel.parameter
        way = "forward_amplitude" if distance > 0 else "reverse_amplitude"
        return Action(
            doing,
            frame,
            distance,
            rate=ask(_JOG, "open_loop_step_rate"),
            acceleration=ask(_JOG, "open_loop_acceleration"),
            complete=self.completed,
            amplitude=ask("PZMOT_AMPOUTPARAMS", way) / 100,
        )

    def _slide(self, frame: Frame, doing: Activity, place: float, complete: Any) -> Action:
        """Return an action in closed loop to a place in nm from the lower end of the travel."""
        ask = self.channel.parameter
        return Action(
            doing,
            frame,
            place - self.actuator.position,
            rate=ask("PZMOT_CLOSEDLOOPPARAMS", "ref_speed"),
            acceleration=ask("PZMOT_CLOSEDLOOPPARAMS", "acceleration"),
            complete=complete,
            amplitude=None,
        )

    @property
    def status_bits(self) -> int:
        """The present status bits."""
        return Pdxc2StatusBits.of(
            **self._bits(),
            homed=self._homed,
            closed_loop=self.closed,
            abnormal_movement=self._abnormal,
            error=self._abnormal,
        )

    def row(self) -> LiveState:
        """Return the position and the state."""
        position, state = super().row()
        if self.closed:
            position = f"{self.position / 1000:.3f} um"
        return LiveState(position, "abnormal movement" if self._abnormal else state)
