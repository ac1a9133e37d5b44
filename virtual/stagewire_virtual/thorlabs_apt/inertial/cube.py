"""The channels of KIM101, KIM001 and TIM101, which only count steps (Issue 37, pages 370 to 406)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Final

from stagewire import Frame
from stagewire_apt import messages as m
from stagewire_apt.enumerations import (
    ChannelEnableMode,
    EnableState,
    FeedbackSignalMode,
    InertialHardLimit,
    JogMode,
)
from stagewire_virtual.thorlabs_apt.channel import Channel, handles, live, stored
from stagewire_virtual.thorlabs_apt.inertial.constants import (
    ACTUATOR,
    REFERENCE_VOLTS,
)
from stagewire_virtual.thorlabs_apt.inertial.drive import Action
from stagewire_virtual.thorlabs_apt.inertial.inertial import Inertial
from stagewire_virtual.thorlabs_apt.motor.status import Activity

_ENABLED: Final[Mapping[int, tuple[int, ...]]] = {
    ChannelEnableMode.NONE: (),
    ChannelEnableMode.CHANNEL_1: (1,),
    ChannelEnableMode.CHANNEL_2: (2,),
    ChannelEnableMode.CHANNEL_3: (3,),
    ChannelEnableMode.CHANNEL_4: (4,),
    ChannelEnableMode.CHANNELS_1_AND_2: (1, 2),
    ChannelEnableMode.CHANNELS_3_AND_4: (3, 4),
}
"""Enable mode -> the numbers of the enabled channels (page 394)."""

_JOG: Final = {"jog_mode": JogMode.SINGLE_STEP, "jog_step_rate": 500, "jog_step_accn": 100_000}

_DEFAULTS: Final[Mapping[str, Mapping[str, int]]] = {
    "PZMOT_DRIVEOPPARAMS": {"max_voltage": 110, "step_rate": 500, "step_accn": 100_000},
    "PZMOT_TIMJOGPARAMS": {**_JOG, "jog_step_size": 250},
    "PZMOT_TIMPOTPARAMS": {"max_step_rate": 500},
    "PZMOT_KCUBEJOGPARAMS": {**_JOG, "jog_step_size_fwd": 250, "jog_step_size_rev": 250},
    "PZMOT_KCUBEMMIPARAMS": {"js_max_step_rate": 500, "disp_brightness": 60},
    "PZMOT_CONVERSIONFACTOR": {"factor": 100},
}
"""Drive and jog parameters from the examples of pages 374, 376 and 397.

The conversion factor is that of the vendor's simulated controllers (thorlabs_xa 1.9.1.28993).
"""

_SWITCHES: Final = {InertialHardLimit.MAKES, InertialHardLimit.BREAKS}
_MODE: Final = "PZMOT_KCUBECHANENABLEMODE"


class InertialCube(Inertial):
    """A channel of a KIM101, KIM001 or TIM101.

    Decisions where the document is silent:

    * A new KIM101 or KIM001 has the enable mode NONE. Channels of a new TIM101 are disabled, because page 370
      requires MOD_SET_CHANENABLESTATE first. A KIM101 has both: a channel moves if neither disables it.
    * A moving channel that is disabled stops immediately and reports it.
    * Channels that are enabled move independently of each other.
    * A move that replaces another begins at rest. The replaced one is not completed.
    * Steps are proportional to the drive voltage. They are those of
      :data:`~stagewire_virtual.thorlabs_apt.inertial.constants.ACTUATOR` at 110 V.
    * The limit switches of page 381 are at the ends of the travel. They stop a channel whose inputs are in
      the mode LIMSWITCH (page 398) and whose switch makes or breaks on contact.
    * The joystick, the trigger ports and the buttons are not simulated.

    :param channel: its channel.
    """

    mechanics = ACTUATOR

    def __init__(self, channel: Channel) -> None:
        super().__init__(channel)
        self._number = channel.ident.bit_length()
        self._has_mode = channel.answers(f"PZMOT_SET_{_MODE.removeprefix('PZMOT_')}")
        channel.enabled = self._has_mode

    @classmethod
    def defaults(cls, channel: Channel) -> Mapping[str, Mapping[str, Any]]:
        """Return the parameters of a new controller: set -> field -> value."""
        if channel.answers("PZMOT_SET_KCUBECHANENABLEMODE"):
            return _DEFAULTS
        return {**_DEFAULTS, "MOD_CHANENABLESTATE": {"enable_state": EnableState.DISABLE}}

    @property
    def enabled(self) -> bool:
        """Whether the channel may move: it is enabled, and the enable mode includes it (page 394)."""
        mode = self.channel.parameter(_MODE, "mode")
        return self.channel.enabled and (not self._has_mode or self._number in _ENABLED[mode])

    def refusal(self, frame: Frame) -> str | None:
        """Refuse the enable modes of channels that a KIM001 does not have (page 394)."""
        match frame.message:
            case m.PzmotSetKcubeChanEnableMode(mode=mode):
                last = max(_ENABLED[mode], default=0)
                if last > self.channel.unit.facts["channels"]:
                    return f"it has no channel {last}"
        return None

    def obeys_switch(self, direction: int) -> bool:
        """Return whether the switch at an end of the travel is used (pages 381 and 398)."""
        ask = self.channel.parameter
        if ask("PZMOT_KCUBEFEEDBACKSIGPARAMS", "fb_signal_mode") != FeedbackSignalMode.LIMSWITCH:
            return False
        switch = "fwd_hard_limit" if direction > 0 else "rev_hard_limit"
        return ask("PZMOT_LIMSWITCHPARAMS", switch) in _SWITCHES

    @stored(_MODE)
    def mode_was_set(self, frame: Frame) -> None:
        """Stop a channel that is no longer enabled."""
        self.enabled_changed()

    @live("PZMOT_POSCOUNTERS")
    def counter(self) -> dict[str, int]:
        """Return the position counter (page 372)."""
        return {"position": self.position}

    @stored("PZMOT_POSCOUNTERS")
    def counter_was_set(self, frame: Frame) -> None:
        """Set the position counter (page 372)."""
        self.set_position(self.channel.parameter("PZMOT_POSCOUNTERS", "position"))

    # Moves

    @handles("PZMOT_MOVE_ABSOLUTE")
    def move_absolute(self, frame: Frame) -> None:
        """Move to the position of the message, or to the stored one (page 401)."""
        match frame.message:
            case m.PzmotMoveAbsolute(abs_position=target):
                pass
            case _:
                target = self.channel.parameter("PZMOT_KCUBEMOVEABSOLUTEPARAMS", "abs_distance")
        self._move(frame, target - self.position)

    @handles("PZMOT_MOVE_RELATIVE")
    def move_relative(self, frame: Frame) -> None:
        """Move by the distance of the message, or by the stored one (page 400)."""
        match frame.message:
            case m.PzmotMoveRelative(rel_distance=distance):
                pass
            case _:
                distance = self.channel.parameter("PZMOT_KCUBEMOVERELATIVEPARAMS", "rel_distance")
        self._move(frame, distance)

    @handles("PZMOT_MOVE_VELOCITY")
    def move_velocity(self, frame: Frame) -> None:
        """Move in a direction until the motor is stopped."""
        if direction := self.direction_of(frame):
            self._move(frame, direction * math.inf)

    @handles("PZMOT_MOVE_JOG")
    def move_jog(self, frame: Frame) -> None:
        """Jog by the step of the direction, or until the motor is stopped (pages 376, 396 and 404)."""
        direction = self.direction_of(frame)
        if not direction:
            return
        name, size = "PZMOT_TIMJOGPARAMS", "jog_step_size"
        if self._has_mode:
            name = "PZMOT_KCUBEJOGPARAMS"
            size = "jog_step_size_fwd" if direction > 0 else "jog_step_size_rev"
        ask = self.channel.parameter
        single = ask(name, "jog_mode") == JogMode.SINGLE_STEP
        distance = direction * (ask(name, size) if single else math.inf)
        self._begin(frame, Activity.JOGGING, distance, name, "jog_step_rate", "jog_step_accn")

    def _move(self, frame: Frame, distance: float) -> None:
        name = "PZMOT_DRIVEOPPARAMS"
        self._begin(frame, Activity.MOVING, distance, name, "step_rate", "step_accn")

    def _begin(
        self,
        frame: Frame,
        doing: Activity,
        distance: float,
        name: str,
        rate: str,
        acceleration: str,
    ) -> None:
        """Start an action with the rate and the acceleration of a parameter set."""
        ask = self.channel.parameter
        action = Action(
            doing,
            frame,
            distance,
            rate=ask(name, rate),
            acceleration=ask(name, acceleration),
            complete=self.completed,
            amplitude=ask("PZMOT_DRIVEOPPARAMS", "max_voltage") / REFERENCE_VOLTS,
        )
        self.begin(action)
