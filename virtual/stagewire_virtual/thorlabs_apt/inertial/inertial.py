"""The common base of inertial channels: counters, status bits, and the actions of their drive."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from stagewire import Frame
from stagewire_apt import messages as m
from stagewire_apt.enumerations import MoveDirection
from stagewire_apt.flags import InertialStatusBits
from stagewire_virtual.thorlabs_apt.channel import Behaviour, Channel, LiveState, handles
from stagewire_virtual.thorlabs_apt.inertial.actuator import Actuator
from stagewire_virtual.thorlabs_apt.inertial.constants import Mechanics
from stagewire_virtual.thorlabs_apt.inertial.drive import Action, InertialDrive
from stagewire_virtual.thorlabs_apt.motor.status import Activity

_DIRECTIONS = {int(MoveDirection.FORWARD): 1, int(MoveDirection.REVERSE): -1}


def wrapped(value: int) -> int:
    """Return a value as a signed counter of 32 bits, which wraps around."""
    return (value + 0x8000_0000) % 0x1_0000_0000 - 0x8000_0000


class Inertial(Behaviour):
    """An inertial channel. ``actuator`` has the true position, which no message reports.

    :param channel: its channel; ``travel`` and ``position`` of its settings are in nm.
    """

    can_stick = True
    mechanics: ClassVar[Mechanics]
    """The mechanics of what it drives."""

    def __init__(self, channel: Channel) -> None:
        super().__init__(channel)
        settings = channel.settings
        self.actuator = Actuator(
            channel.clock, self.mechanics, channel.random, settings.travel, settings.position
        )
        self._drive = InertialDrive(channel.clock, self.actuator, self.obeys_switch, self.lost)
        self._origin = 0  # the steps at which the counter is 0

    # For the kinds of channels

    @property
    def position(self) -> int:
        """The position counter."""
        return wrapped(self.actuator.steps - self._origin)

    def set_position(self, position: int) -> None:
        """Set the position counter; nothing moves, and a move in progress keeps its distance."""
        self._origin = self.actuator.steps - position

    @property
    def enabled(self) -> bool:
        """Whether the channel may move."""
        return self.channel.enabled

    def obeys_switch(self, direction: int) -> bool:
        """Return whether a limit switch ends motion in a direction, 1 or -1."""
        return False

    def lost(self) -> bool:
        """Return whether the closed loop gives up, because it has noticed that the stage is blocked."""
        return False

    def begin(self, action: Action) -> None:
        """Start an action, unless the channel is disabled or its parameters do not permit it."""
        fault = action.fault if self.enabled else "the channel is disabled"
        if fault:
            self.channel.report_fault(action.cause, fault)
        else:
            self._drive.begin(action)

    def direction_of(self, frame: Frame) -> int:
        """Return the direction of a message, 1 or -1; 0 for an invalid one, which is refused."""
        message: Any = frame.message
        told = message.jog_dir if hasattr(message, "jog_dir") else message.direction
        direction = _DIRECTIONS.get(told, 0)
        if not direction:
            self.channel.report_fault(frame, "the direction must be 1 or 2")
        return direction

    def rest(self) -> None:
        """Stop immediately; a motion in progress is reported as stopped."""
        action = self._drive.action
        self._drive.rest()
        if action is not None:
            self.stopped(action.cause)

    def completed(self, cause: Frame) -> None:
        """Report the end of a move or jog (page 403)."""
        self.channel.send(
            m.PzmotMoveCompleted(
                chan_ident=self.channel.ident,
                abs_position=self.position,
                status_bits=self.status_bits,
            ),
            cause,
        )

    def stopped(self, cause: Frame) -> None:
        """Report that the motor was stopped, with the message that the unit has for it."""
        kind: Any = m.MotMoveStoppedStepper
        more = {"enc_count": 0}
        if self.channel.answers("PZMOT_MOVE_STOPPED"):
            kind, more = m.PzmotMoveStopped, {}
        self.channel.send(
            kind(
                chan_ident=self.channel.ident,
                position=self.position,
                status_bits=self.status_bits,
                **more,
            ),
            cause,
        )

    # For the controller

    def power_on(self) -> None:
        """Reset to the power-on state, with a counter of 0 at the present position."""
        self._drive.rest()
        self.set_position(0)

    def enabled_changed(self) -> None:
        """Stop a motion when the channel is disabled."""
        if not self.enabled:
            self.rest()

    def stuck_changed(self) -> None:
        """Block the actuator, or release it."""
        self._drive.block(self.channel.stuck)

    @handles("PZMOT_MOVE_STOP", "MOT_MOVE_STOP")
    def move_stop(self, frame: Frame) -> None:
        """Stop immediately and report it, also at rest."""
        self._drive.rest()
        self.stopped(frame)

    def status(self) -> Mapping[str, int]:
        """Return the present position and status bits (page 405)."""
        return {"position": self.position, "status_bits": self.status_bits}

    @property
    def status_bits(self) -> int:
        """The present status bits."""
        return InertialStatusBits.of(**self._bits())

    def row(self) -> LiveState:
        """Return the counter, the true position and the state."""
        action = self._drive.action
        state = "at rest" if action is None else action.doing.value
        if not self.enabled:
            state = "disabled"
        return LiveState(f"{self.position} steps ({self.actuator.position / 1000:.3f} um)", state)

    def _bits(self) -> dict[str, bool]:
        action, direction = self._drive.action, self.actuator.direction
        doing = Activity.NOTHING if action is None else action.doing
        jogs = doing is Activity.JOGGING
        return {
            "forward_hardware_limit": self.obeys_switch(1) and self.actuator.at_end(1),
            "reverse_hardware_limit": self.obeys_switch(-1) and self.actuator.at_end(-1),
            "moving_forward": direction > 0,
            "moving_reverse": direction < 0,
            "jogging_forward": direction > 0 and jogs,
            "jogging_reverse": direction < 0 and jogs,
            "motor_connected": True,
            "homing": doing is Activity.HOMING,
            "power_ok": True,
            "active": action is not None,
            "channel_enabled": self.enabled,
        }
