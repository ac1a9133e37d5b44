"""An actuator with a strain gauge: how it is counted, how far it goes, and what is read at the beginning.

With what can be set on a piezo channel: the values of a new one, the maximum voltage that follows, and the
status bits by their names, in the table that the registry gives the unit (pages 101 to 104).
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
from stagewire_virtual.instrument import Unit
from stagewire_virtual.options import Settings
from stagewire_virtual.thorlabs_apt.channel import Channel

FULL_SCALE: Final = 32767
"""Counts of the maximum voltage and of the whole travel (pages 96 and 97)."""

READING_TIME: Final = SECOND
"""How long the position is read before it is taken as zero (page 117 has no figure)."""

DEFAULT_TRAVEL: Final = 200
"""20 µm in steps of 100 nm, as in the example of page 118."""

_LARGEST: Final = 0xFFFF  # what PZ_GET_MAXTRAVEL holds


def travel_and_share(settings: Settings) -> tuple[int, float]:
    """Return the travel in steps of 100 nm, and which share of it the strain gauge reads at the beginning.

    Raises :class:`~stagewire_virtual.errors.BadOptionError` for a travel that no message holds, and for a
    position beyond it.
    """
    travel = DEFAULT_TRAVEL if settings.travel is None else settings.travel
    if not 0 <= travel <= _LARGEST:
        raise BadOptionError(
            f"the travel of an actuator is given in steps of 100 nm, from 0 to {_LARGEST}, not {travel}"
        )
    position = settings.position or 0
    if abs(position) > travel:
        raise BadOptionError(
            f"a strain gauge with a travel of {travel} steps of 100 nm reads from {-travel} to {travel}, "
            f"not {position}"
        )
    return travel, position / travel if travel else 0.0


def finite(share: float) -> float:
    """Return a share of full scale as a user told it.

    Raises :class:`~stagewire.errors.BadValueError` for what is not a finite number: no message holds it.
    """
    if not math.isfinite(share):
        raise BadValueError(f"a signal is a share of full scale, such as 0.5, not {share}")
    return share


class StatusBits:
    """The bits that ``PZ_GET_PZSTATUSUPDATE`` of a unit has.

    Tables are printed for the TPZ001 and the BPC series. MPZ601 and TSG001 send the bits of the latter,
    which is the richer one and agrees with the other.
    """

    def __init__(self, unit: Unit) -> None:
        (layout,) = unit.message("PZ_GET_PZSTATUSUPDATE")["layouts"]
        field = next(field for field in layout["fields"] if field["name"] == "status_bits")
        table = field["flags_by_unit"].get(unit.name, field["flag_table"])
        bits = unit.registry["flags"][table]["bits"]
        self._masks: dict[str, int] = {name: bit["mask"] for name, bit in bits.items()}

    def value(self, states: Mapping[str, bool]) -> int:
        """Return the word with the named bits set; a name that the table does not have is left out."""
        return sum(mask for name, mask in self._masks.items() if states.get(name))


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
