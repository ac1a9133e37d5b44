"""An actuator with a strain gauge: its counts, its travel and its first reading.

Also has the parameters of a new piezo channel and its maximum voltage.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Final

from stagewire.errors import BadValueError
from stagewire_apt.enumerations import (
    HubAnalogueInput,
    LutValueType,
    PositionControlMode,
    VoltageLimit,
)
from stagewire_apt.flags import LutOutputMode, OutputMaxVoltsFlags
from stagewire_virtual.clock import SECOND
from stagewire_virtual.errors import BadOptionError
from stagewire_virtual.options import Settings
from stagewire_virtual.thorlabs_apt.channel import Channel

FULL_SCALE: Final = 32767
"""Counts of the maximum voltage and of the whole travel (pages 96 and 97)."""

READING_TIME: Final = SECOND
"""How long the position is read before it becomes zero (page 117 has no value)."""

DEFAULT_TRAVEL: Final = 200
"""20 µm in steps of 100 nm, as in the example of page 118."""

_LARGEST: Final = 0xFFFF  # the largest value of PZ_GET_MAXTRAVEL


def travel_and_share(settings: Settings) -> tuple[int, float]:
    """Return the travel in steps of 100 nm, and the first reading of the strain gauge as a fraction of it.

    Raises :class:`~stagewire_virtual.errors.BadOptionError` for a travel that does not fit into a message,
    and for a position beyond it.
    """
    travel = DEFAULT_TRAVEL if settings.travel is None else settings.travel
    if not 0 <= travel <= _LARGEST:
        raise BadOptionError(
            f"the travel of an actuator must be from 0 to {_LARGEST} steps of 100 nm, not {travel}"
        )
    position = settings.position or 0
    if abs(position) > travel:
        raise BadOptionError(
            f"the position must be from {-travel} to {travel} for a travel of {travel} steps of 100 nm, "
            f"not {position}"
        )
    return travel, position / travel if travel else 0.0


def finite(share: float) -> float:
    """Return a fraction of full scale unchanged.

    Raises :class:`~stagewire.errors.BadValueError` if it is not a finite number.
    """
    if not math.isfinite(share):
        raise BadValueError(f"a signal must be a fraction of full scale, such as 0.5, not {share}")
    return share


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
    "PZ_PPC_NOTCHPARAMS": {
        "filter_no": 3,  # both, and neither is used
        **{
            f"filter{n}_{field}": value for n in (1, 2) for field, value in (("fc", 100), ("q", 10))
        },
        **{f"notch_filter{n}_on": 2 for n in (1, 2)},
    },
    "KPZ_KCUBEMMIPARAMS": {"js_volt_step": 1000, "dir_sense": 1, "disp_brightness": 100},
    "KSG_KCUBETRIGIOCONFIG": {"upper_lim": 100},
    "KPC_KCUBEMMIPARAMS": {
        "js_volt_step": 1000,
        "js_pos_step": 1000,
        "dir_sense": 1,
        "disp_brightness": 100,
    },
    "KPC_KCUBETRIGIOCONFIG": {"upper_lim": FULL_SCALE},
    "KPC_IOSETTINGS": {"voltage_limit": 75, "voltage_range": 75, "analog_input": 3},
}
"""The parameters of a new controller, from the examples of the document if it has one.

Missing values are 0, or the valid value nearest to it.
"""


_LOWEST: Final = -FULL_SCALE - 1
_CT1P_VOLTS: Final = (-10, 140)
"""The range of a CT1P (github RodionovSA/holoeml-experiment, 914c47f, through the vendor's library)."""


def output_range(channel: Channel) -> tuple[float, float]:
    """Return the lowest and the highest output voltage of a channel, in counts.

    A KPC101 has a limit that does not change the scale; it applies to both signs.
    """
    counts = 10 * FULL_SCALE / maximum_volts(channel)  # for each volt
    if channel.answers("KPC_SET_IOSETTINGS"):
        limit = min(channel.parameter("KPC_IOSETTINGS", "voltage_limit") * counts, FULL_SCALE)
        return -limit, limit
    if channel.answers("PZ_SET_PIDCRITERIA"):
        low, high = _CT1P_VOLTS
        return low * counts, high * counts
    return _LOWEST, FULL_SCALE


def maximum_volts(channel: Channel) -> int:
    """Return the maximum output voltage of a channel in steps of 0.1 V: 750, 1000 or 1500.

    SET accepts any voltage up to 150 V (page 121), and GET reports one of three (page 122). The result is the
    highest of these that is not above the value that was set, so that no actuator gets too much, and at least
    75 V. A unit without this setting has 75 V, the safest of the three, as in the example of page 96.
    """
    if channel.answers("PZ_SET_TPZ_IOSETTINGS"):
        return _CUBE_LIMITS[channel.parameter("PZ_TPZ_IOSETTINGS", "voltage_limit")]
    if channel.answers("KPC_SET_IOSETTINGS"):  # 75 or 150, in steps of 1 V
        return 10 * channel.parameter("KPC_IOSETTINGS", "voltage_range")
    if channel.answers("PZ_SET_PIDCRITERIA"):  # a CT1P, which has no setting for it
        return max(LIMITS)
    asked = channel.parameter("PZ_OUTPUTMAXVOLTS", "voltage")
    return max((limit for limit in LIMITS if limit <= asked), default=min(LIMITS))
