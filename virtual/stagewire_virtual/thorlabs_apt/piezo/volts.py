"""The maximum output voltage, of which all voltages and slew rates are shares (pages 96, 115 and 121)."""

from __future__ import annotations

from stagewire_apt.enumerations import VoltageLimit
from stagewire_apt.flags import OutputMaxVoltsFlags
from stagewire_virtual.thorlabs_apt.channel import Channel

__all__ = ["LIMITS", "maximum_volts"]

LIMITS = {
    750: OutputMaxVoltsFlags.voltagelimit_75v,
    1000: OutputMaxVoltsFlags.voltagelimit_100v,
    1500: OutputMaxVoltsFlags.voltagelimit_150v,
}
"""The three maximum voltages in steps of 0.1 V, each with its flag (page 122)."""

_CUBE_LIMITS: dict[int, int] = dict(zip(VoltageLimit, LIMITS, strict=True))


def maximum_volts(channel: Channel) -> int:
    """Return the maximum output voltage of a channel in steps of 0.1 V: 750, 1000 or 1500.

    A set may ask for any voltage up to 150 V (page 121), a get reports one of three (page 122): it is the
    highest of them that is not above what was asked, so that no actuator gets more than it was set for, and
    75 V for less than that. A unit without a setting has 75 V, as the example of page 96 and the safest of
    the three.
    """
    if channel.answers("PZ_SET_TPZ_IOSETTINGS"):
        limit = channel.parameter("PZ_TPZ_IOSETTINGS", "voltage_limit")
        return _CUBE_LIMITS.get(limit, min(LIMITS))
    asked = channel.parameter("PZ_OUTPUTMAXVOLTS", "voltage")
    return max((limit for limit in LIMITS if limit <= asked), default=min(LIMITS))
