"""The position loop of a piezo channel: its time constants and its position sensor.

Units with ``PZ_SET_PICONSTS`` have one loop with two constants. Precision piezo controllers have
``PZ_SET_PPC_PIDCONSTS`` (Issue 37, page 208), and the CT1P has two groups of them (page 411).
"""

from __future__ import annotations

import math
from typing import Final

from stagewire_virtual.clock import SECOND
from stagewire_virtual.thorlabs_apt.channel import Channel

_CONSTANTS: Final = "PZ_PPC_PIDCONSTS"
_CRITERIA: Final = "PZ_PIDCRITERIA"
_SETTINGS: Final = "PZ_PPC_IOSETTINGS"
_NOTCHES: Final = "PZ_PPC_NOTCHPARAMS"
_NORMAL: Final = (
    0  # no enumerations: packages of earlier issues have neither them nor these messages
)
_NEAR: Final = 1
_STRAIN_GAUGE: Final = 1
_FILTERS: Final = {1: "filter1", 2: "filter2"}


class Loop:
    """The position loop of a channel.

    The constants of a group are in the parameters of the channel while ``PZ_SET_PIDCRITERIA`` selects it.

    :param channel: its channel.
    """

    def __init__(self, channel: Channel) -> None:
        self._channel = channel
        self.sensor = _STRAIN_GAUGE
        """The position sensor of the actuator, as in ``feedback_src``: 1 for a strain gauge, 2 for a
        capacitive sensor. A loop has feedback if ``PZ_SET_PPC_IOSETTINGS`` selects this sensor."""
        self.reset()

    def reset(self) -> None:
        """Take all constants and filters from the parameters, which were restored."""
        constants = dict(self._channel.parameters.get(_CONSTANTS, {}))
        self._groups = {_NORMAL: constants, _NEAR: dict(constants)}
        self._notches = dict(self._channel.parameters.get(_NOTCHES, {}))

    @property
    def sensor_is_selected(self) -> bool:
        """Whether the settings select the sensor of the actuator; always true on units without a choice."""
        return self._channel.parameter(_SETTINGS, "feedback_src", self.sensor) == self.sensor

    @property
    def settling(self) -> float:
        """The time constant in nanoseconds; infinite if the constants are 0 (page 100)."""
        return self._time_constant(_NORMAL)

    @property
    def near_settling(self) -> float:
        """The time constant within :attr:`window`, in nanoseconds."""
        return self._time_constant(_NEAR)

    @property
    def window(self) -> int:
        """The distance from the target, in counts, within which the second group applies; 0 for never."""
        return self._channel.parameter(_CRITERIA, "target_error_window")

    def constants_were_set(self) -> None:
        """Keep the constants as those of the selected group."""
        self._groups[self._selected] = dict(self._channel.parameters[_CONSTANTS])

    def group_was_selected(self) -> None:
        """Show the constants of the selected group."""
        self._channel.parameters[_CONSTANTS].update(self._groups[self._selected])

    def notches_were_set(self) -> None:
        """Keep the settings of a notch filter that the message does not address (page 210)."""
        values = self._channel.parameters[_NOTCHES]
        for number, name in _FILTERS.items():
            if not values["filter_no"] & number:
                kept = {field: value for field, value in self._notches.items() if name in field}
                values.update(kept)
        self._notches = dict(values)

    @property
    def _selected(self) -> int:
        return self._channel.parameter(_CRITERIA, "index")

    def _time_constant(self, group: int) -> float:
        if self._groups[group]:
            constants = self._groups[group]
            gain = constants["pid_consts_p"] + constants["pid_consts_i"]
        else:
            ask = self._channel.parameter
            gain = ask("PZ_PICONSTS", "prop_const") + ask("PZ_PICONSTS", "int_const")
        return SECOND / gain if gain else math.inf
