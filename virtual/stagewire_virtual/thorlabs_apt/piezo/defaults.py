"""What a new piezo controller is set to, and what is the hardware's own and cannot be set."""

from __future__ import annotations

from collections.abc import Mapping

from stagewire_apt.enumerations import (
    HubAnalogueInput,
    LutValueType,
    PositionControlMode,
    VoltageLimit,
)
from stagewire_apt.flags import LutOutputMode
from stagewire_virtual.clock import SECOND
from stagewire_virtual.thorlabs_apt.piezo.volts import LIMITS

__all__ = [
    "AMPLIFIER_TIME",
    "DEFAULTS",
    "FULL_SCALE",
    "READING_TIME",
    "SLEW_DIVISOR",
    "SMOOTH_TIME",
]

FULL_SCALE = 32767
"""Counts of the maximum voltage and of the whole travel (pages 96 and 97)."""

AMPLIFIER_TIME = SECOND // 200
"""From zero to the maximum voltage where no slew rate is set: 5 ms. The document has no figure."""

SMOOTH_TIME = SECOND
"""From zero to full scale when a smooth mode opens or closes the loop; "over a longer period" (page 94)."""

READING_TIME = SECOND
"""How long the position is read at zero volts before it is taken as zero (page 117 has no figure)."""

SLEW_DIVISOR = 19000
"""Slew rates are value × maximum volts / 19000 in V/ms (page 123)."""

DEFAULTS: Mapping[str, Mapping[str, int]] = {
    "PZ_POSCONTROLMODE": {"mode": PositionControlMode.OPEN_LOOP},
    "PZ_OUTPUTVOLTS": {"voltage": 0},
    "PZ_OUTPUTPOS": {"position_sw": 0},
    "PZ_INPUTVOLTSSRC": {"volt_src": 0},
    "PZ_PICONSTS": {"prop_const": 100, "int_const": 15},  # page 100
    "PZ_OUTPUTLUTPARAMS": {
        "mode": LutOutputMode.outputlut_continuous,
        "cycle_length": 0,
        "num_cycles": 1,
        "delay_time": 1,
        "pre_cycle_rest": 0,
        "post_cycle_rest": 0,
        "op_trig_start": 0,
        "op_trig_width": 1,
        "trig_repeat_cycle": 0,
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
"""Values of a new controller, from the examples of the document where it has one."""
