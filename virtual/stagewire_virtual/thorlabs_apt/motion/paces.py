"""How fast a motor moves, by its parameters."""

from __future__ import annotations

from stagewire_apt.enumerations import ProfileMode
from stagewire_virtual.thorlabs_apt.channel import Channel
from stagewire_virtual.thorlabs_apt.motion.scales import Scales
from stagewire_virtual.thorlabs_apt.motion.ways import Pace

__all__ = ["Paces"]


class Paces:
    """The paces of a channel, each by the parameters of this instant.

    Start velocities are not heeded: they are "currently always zero" (pages 30 and 32).

    :param channel: whose parameters count.
    :param scales: what they are in counts.
    """

    def __init__(self, channel: Channel, scales: Scales) -> None:
        self._channel = channel
        self._scales = scales

    @property
    def move(self) -> Pace:
        """Of moves, by MOT_VELPARAMS (page 30); also of those at constant velocity.

        For these page 48 names MOT_SET_MOVEVELPARAMS, which has neither an id nor a layout.
        """
        return self._pace("MOT_VELPARAMS", "max_velocity", "acceleration")

    @property
    def jog(self) -> Pace:
        """Of jogs, by MOT_JOGPARAMS (page 32)."""
        return self._pace("MOT_JOGPARAMS", "jog_max_velocity", "jog_acceleration")

    @property
    def home(self) -> Pace:
        """Of homing, by MOT_HOMEPARAMS (page 37), which has no acceleration: that of the moves."""
        velocity = self._channel.parameter("MOT_HOMEPARAMS", "home_velocity")
        return Pace(velocity * self._scales.velocity, self.move.acceleration)

    def _pace(self, set_name: str, velocity: str, acceleration: str) -> Pace:
        parameter = self._channel.parameter
        jerk = None
        if parameter("MOT_PMDPROFILEMODEPARAMS", "mode") == ProfileMode.S_CURVE:
            jerk = parameter("MOT_PMDPROFILEMODEPARAMS", "jerk") * self._scales.jerk
        return Pace(
            parameter(set_name, velocity) * self._scales.velocity,
            parameter(set_name, acceleration) * self._scales.acceleration,
            jerk,
        )
