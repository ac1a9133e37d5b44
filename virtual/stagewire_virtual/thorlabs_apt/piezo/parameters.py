"""What can be set on a piezo channel: the values of a new one, and the maximum voltage that follows."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from stagewire_apt.enumerations import (
    HubAnalogueInput,
    LutValueType,
    PositionControlMode,
    VoltageLimit,
)
from stagewire_apt.flags import LutOutputMode, OutputMaxVoltsFlags
from stagewire_virtual.thorlabs_apt.channel import Channel

__all__ = ["DEFAULTS", "LIMITS", "maximum_volts"]

LIMITS: Final[Mapping[int, int]] = {
    750: OutputMaxVoltsFlags.voltagelimit_75v,
    1000: OutputMaxVoltsFlags.voltagelimit_100v,
    1500: OutputMaxVoltsFlags.voltagelimit_150v,
}
"""The three maximum voltages in steps of 0.1 V, each with its flag (page 122)."""

_CUBE_LIMITS: Final[Mapping[int, int]] = dict(zip(VoltageLimit, LIMITS, strict=True))

DEFAULTS: Final[Mapping[str, Mapping[str, int]]] = {
    "PZ_POSCONTROLMODE": {"mode": PositionControlMode.OPEN_LOOP},
    "PZ_PICONSTS": {"prop_const": 100, "int_const": 15},  # page 100
    "PZ_OUTPUTLUTPARAMS": {
        "mode": LutOutputMode.outputlut_continuous,
        "op_trig_width": 1,
    },
    "PZ_TPZ_SLEWRATES": {"slew_open": 1266, "slew_closed": 1266},  # page 123: 10 V/ms of 150 V
    "PZ_OUTPUTMAXVOLTS": {"voltage": min(LIMITS)},
    "PZ_TPZ_DISPSETTINGS": {"disp_intensity": 255},
    "PZ_TPZ_IOSETTINGS": {
        "voltage_limit": VoltageLimit.VOLTAGELIMIT_75V,
        "hub_analog_input": HubAnalogueInput.HUB_ANALOGUEIN_A,
    },
    "PZ_LUTVALUETYPE": {"lut_type": LutValueType.VOLTAGE},
}
"""Values of a new controller, from the examples of the document where it has one.

What is not named is 0, or the nearest to it that the document allows.
"""


def maximum_volts(channel: Channel) -> int:
    """Return the maximum output voltage of a channel in steps of 0.1 V: 750, 1000 or 1500.

    A set may ask for any voltage up to 150 V (page 121), a get reports one of three (page 122): it is the
    highest of them that is not above what was asked, so that no actuator gets more than it was set for, and
    75 V for less than that. A unit without a setting has 75 V, as the example of page 96 and the safest of
    the three.
    """
    if channel.answers("PZ_SET_TPZ_IOSETTINGS"):
        return _CUBE_LIMITS[channel.parameter("PZ_TPZ_IOSETTINGS", "voltage_limit")]
    asked = channel.parameter("PZ_OUTPUTMAXVOLTS", "voltage")
    return max((limit for limit in LIMITS if limit <= asked), default=min(LIMITS))
