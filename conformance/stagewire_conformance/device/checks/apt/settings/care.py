"""Limits on how a check may change a setting. A value without an entry is only written back unchanged.

The check of a SET message changes one value at a time and reads it back. The registry does not state which
values are safe to change, so this module does. No change may remove a protection, make anything faster,
stronger or longer, or cause motion or heat:

* velocities, accelerations, slew rates and gains are only lowered, limits only narrowed;
* values that are only stored until a command uses them (the targets of the next moves) may change by more
than two bytes can hold, which also tests their width;
* limit switches are only set to work (makes, breaks), never to be ignored;
* gains and currents of a motor's loop are changed only while the channel is disabled, those of a piezo's loop
and its feedback only in open loop: otherwise the loop would react;
* values that are not in :data:`CARE` are written back as read. They include all values whose change would
move something or affect the connected equipment: analogue inputs that are added to an output, the maximum
voltage (the output scales with it), the use of the BNC connectors and of the feedback of a strain gauge
reader, the actions of buttons, the direction and the switch of homing. They also include the travel of a
stage, which can be reduced but not increased again (page 75).
"""

from __future__ import annotations

import enum
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

from stagewire_conformance.registry import Json


class How(enum.Enum):
    """How a value may be changed."""

    NEAR = "a little up and down"
    LOWER = "a little lower"
    HIGHER = "a little higher"
    WIDE = "a little up and down, and by more than two bytes can hold"
    LISTED = "to each documented value"
    FEWER = "to each documented value below the current one"
    BITS = "one documented bit at a time"


class When(enum.Enum):
    """When a setting may be changed."""

    ALWAYS = "always"
    DISABLED = "while the channel is disabled"
    OPEN_LOOP = "in open loop"


@dataclass(frozen=True)
class Varied:
    """How one value may be changed.

    :param values: for :attr:`How.LISTED`, the only values to write; empty: all documented values.
    :param keep: bits that keep their state, whatever value is written.
    :param floor: the lowest number to write.
    :param common: whether the value applies to all channels and can be set through any of them.
    :param advised: whether the document leaves open that every unit can set the value.
    :param like: another value to which this one may be set equal, if the other one is lower.
    """

    how: How
    values: tuple[int, ...] = ()
    keep: int = 0
    floor: int | None = None
    common: bool = False
    advised: bool = False
    like: str = ""

    def listed(self, facts: Json) -> tuple[int, ...]:
        """Return the documented values that may be written; ``facts`` is the registry entry of the field."""
        return self.values or tuple(sorted(facts.get("enum", {}).values()))


@dataclass(frozen=True)
class Care:
    """How the checks treat a parameter set.

    :param fields: the values that may be changed, by name.
    :param when: when they may be changed.
    :param doubtful: why no rule is broken if a value is not read back; empty if one is.
    :param first_channel: whether the document addresses the first channel only.
    :param zero: values that are always zero according to the document.
    :param only_if: the set is changed only while these values are among the given ones.
    :param ignored: values that are ignored when they are set, and sent as zero.
    """

    fields: Mapping[str, Varied] = field(default_factory=dict)
    when: When = When.ALWAYS
    doubtful: str = ""
    first_channel: bool = False
    zero: tuple[str, ...] = ()
    only_if: Mapping[str, tuple[int, ...]] = field(default_factory=dict)
    ignored: tuple[str, ...] = ()


_NEAR: Final = Varied(How.NEAR)
_LOWER: Final = Varied(How.LOWER, floor=1)
_WIDE: Final = Varied(How.WIDE)
_HIGHER: Final = Varied(How.HIGHER)
_SHARED: Final = Varied(How.LOWER, floor=1, common=True)
_UNUSED: Final = (0x00, 0x01)  # page 141: a port that is not used, or a plain input
_LISTED: Final = Varied(How.LISTED)
_SWITCH: Final = Varied(How.LISTED, values=(2, 3), keep=0x80)  # page 39: makes, breaks; swapped


def _all(varied: Varied, *names: str) -> dict[str, Varied]:
    return dict.fromkeys(names, varied)


_PORTS: Final[Mapping[str, Varied]] = {
    **_all(Varied(How.LISTED, values=_UNUSED), "trig1_mode", "trig2_mode"),
    **_all(_LISTED, "trig1_polarity", "trig2_polarity"),
}
_LIMITED_PORTS: Final[Mapping[str, Varied]] = {
    **_PORTS,
    **_all(_NEAR, "lower_lim", "upper_lim", "smoothing_samples"),
}
_UNUSED_PORTS: Final = {"trig1_mode": _UNUSED, "trig2_mode": _UNUSED}


CARE: Final[Mapping[str, Care]] = {
    "MOT_VELPARAMS": Care(_all(_LOWER, "acceleration", "max_velocity"), zero=("min_velocity",)),
    "MOT_JOGPARAMS": Care(
        {
            **_all(_LISTED, "jog_mode", "jog_stop_mode"),
            **_all(_LOWER, "jog_step_size", "jog_acceleration", "jog_max_velocity"),
        },
        zero=("jog_min_velocity",),
    ),
    "MOT_GENMOVEPARAMS": Care(_all(_NEAR, "backlash_distance")),
    "MOT_MOVERELPARAMS": Care(_all(_WIDE, "relative_distance")),
    "MOT_MOVEABSPARAMS": Care(_all(_WIDE, "absolute_position")),
    "MOT_HOMEPARAMS": Care(
        {"home_velocity": _LOWER, "offset_distance": Varied(How.NEAR, advised=True)}  # page 37
    ),
    "MOT_LIMSWITCHPARAMS": Care(
        {
            **_all(_SWITCH, "cw_hard_limit", "ccw_hard_limit", "software_limit_mode"),
            "cw_soft_limit": _LOWER,
            "ccw_soft_limit": _HIGHER,
        }
    ),
    "MOT_DCPIDPARAMS": Care(
        _all(
            _LOWER, "proportional", "integral", "differential", "integral_limit", "filter_control"
        ),
        when=When.DISABLED,
    ),
    "MOT_AVMODES": Care(_all(Varied(How.BITS), "mode_bits")),
    "MOT_POTPARAMS": Care(
        {
            **_all(_LOWER, "vel1", "vel3", "vel4"),
            "vel2": Varied(How.LOWER, floor=1, like="vel1"),  # page 56: they may be equal
        }
    ),
    "MOT_BUTTONPARAMS": Care({**_all(_NEAR, "position1", "position2"), "time_out": _HIGHER}),
    "MOT_SOL_CYCLEPARAMS": Care(
        {**_all(_HIGHER, "on_time", "off_time"), "num_cycles": Varied(How.NEAR, floor=1)}
    ),
    "MOT_PMDPOSITIONLOOPPARAMS": Care(
        {
            **_all(_LOWER, "proportional", "integral", "integral_limit", "differential"),
            **_all(_LOWER, "kout_pos", "kvff_pos", "kaff_pos", "pos_err_lim"),
            "kd_time_pos": _NEAR,
        },
        when=When.DISABLED,
    ),
    "MOT_PMDMOTOROUTPUTPARAMS": Care(
        {**_all(_LOWER, "cont_current_lim", "energy_lim", "motor_lim"), "motor_bias": _NEAR},
        when=When.DISABLED,
    ),
    "MOT_PMDTRACKSETTLEPARAMS": Care(_all(_HIGHER, "time", "settle_window", "track_window")),
    "MOT_PMDPROFILEMODEPARAMS": Care({"mode": _LISTED, "jerk": _LOWER}),
    "MOT_PMDCURRENTLOOPPARAMS": Care(
        _all(_LOWER, "kp_current", "ki_current", "i_lim_current", "i_dead_band", "kff"),
        when=When.DISABLED,
    ),
    "MOT_PMDSETTLEDCURRENTLOOPPARAMS": Care(
        {
            **_all(_LOWER, "kp_settled", "ki_settled", "i_lim_settled"),
            **_all(_LOWER, "i_dead_band_settled", "kff_settled"),
        },
        when=When.DISABLED,
    ),
    "PZ_PICONSTS": Care(_all(_LOWER, "prop_const", "int_const"), when=When.OPEN_LOOP),
    "PZ_OUTPUTLUT": Care(
        _all(_NEAR, "output"),
        doubtful="PZ_REQ_OUTPUTLUT does not select a sample, and page 107 does not state which one "
        "is returned",
    ),
    "PZ_OUTPUTLUTPARAMS": Care(
        {
            # the modes of all units, and both together; the triggers of the TPZ001 differ (page 108)
            "mode": Varied(How.LISTED, values=(0x01, 0x02, 0x03)),
            "num_cycles": Varied(How.WIDE, floor=1),
            "delay_time": Varied(How.NEAR, floor=1),
            **_all(_NEAR, "pre_cycle_rest", "post_cycle_rest", "op_trig_width"),
            "trig_repeat_cycle": _NEAR,
        }
    ),
    "PZ_OUTPUTMAXVOLTS": Care(ignored=("flags",)),  # page 121
    "PZ_TPZ_DISPSETTINGS": Care(_all(_NEAR, "disp_intensity")),
    "PZ_TPZ_IOSETTINGS": Care(_all(_LISTED, "hub_analog_input"), when=When.OPEN_LOOP),
    "PZ_TPZ_SLEWRATES": Care(
        _all(_LOWER, "slew_open", "slew_closed")
    ),  # page 123: 0 removes the limit
    "PZ_IOSETTINGS": Care(
        {
            "amp_current_lim": Varied(How.FEWER),
            "amp_lp_filter": Varied(How.LISTED, common=True),
        },
        when=When.OPEN_LOOP,
        first_channel=True,  # page 119
    ),
    "PZ_TSG_IOSETTINGS": Care({"display_mode": _LISTED, "force_calib": _NEAR}),
    # Issue 37: piezo controllers. Wheels and ports keep what they do; the monitor output may be in use.
    "PZ_PPC_PIDCONSTS": Care(
        {
            **_all(_LOWER, "pid_consts_p", "pid_consts_i", "pid_consts_d", "pid_consts_dfc"),
            "pid_deriv_filter_on": _LISTED,
        },
        when=When.OPEN_LOOP,
    ),
    "PZ_PPC_NOTCHPARAMS": Care(
        {
            **_all(_NEAR, "filter1_fc", "filter1_q", "filter2_fc", "filter2_q"),
            **_all(_LISTED, "notch_filter1_on", "notch_filter2_on"),
        },
        when=When.OPEN_LOOP,
        only_if={"filter_no": (3,)},  # the message addresses both filters
    ),
    "PZ_PPC_IOSETTINGS": Care(_all(_LISTED, "fp_brightness"), when=When.OPEN_LOOP),
    "PZ_PIDCRITERIA": Care(_all(_NEAR, "target_error_window"), when=When.OPEN_LOOP),
    "PZMOT_DRIVEOPPARAMS": Care(_all(_LOWER, "max_voltage", "step_rate", "step_accn")),
    "PZMOT_TIMJOGPARAMS": Care(_all(_LOWER, "jog_step_size", "jog_step_rate", "jog_step_accn")),
    "PZMOT_TIMPOTPARAMS": Care(_all(_LOWER, "max_step_rate")),
    "PZMOT_TIMBUTTONPARAMS": Care(_all(_NEAR, "position1", "position2")),
    "PZMOT_KCUBEJOGPARAMS": Care(
        {
            **_all(_LISTED, "jog_mode"),
            **_all(_LOWER, "jog_step_size_fwd", "jog_step_size_rev"),
            **_all(_LOWER, "jog_step_rate", "jog_step_accn"),
        }
    ),
    "PZMOT_LIMSWITCHPARAMS": Care(_all(_LISTED, "fwd_hard_limit", "rev_hard_limit")),
    "PZMOT_KCUBEMOVERELATIVEPARAMS": Care(_all(_WIDE, "rel_distance")),
    "PZMOT_KCUBEMOVEABSOLUTEPARAMS": Care(_all(_WIDE, "abs_distance")),
    "PZMOT_OPENMOVEPARAMS": Care(_all(_NEAR, "step_size")),
    "PZMOT_CLOSEMOVEPARAMS": Care(_all(_NEAR, "position")),
    "PZMOT_CLOSEDLOOPPARAMS": Care(_all(_LOWER, "ref_speed", "acceleration")),
    "PZMOT_AMPOUTPARAMS": Care(_all(_LOWER, "forward_amplitude", "reverse_amplitude")),
    "POL_PARAMS": Care(
        {
            "velocity": _LOWER,
            **_all(_HIGHER, "home_position", "jog_step1", "jog_step2", "jog_step3"),
        }
    ),
    "KPZ_KCUBEMMIPARAMS": Care(
        {
            **_all(_LOWER, "js_volt_step", "disp_brightness", "disp_dim_level"),
            **_all(_NEAR, "preset_volt1", "preset_volt2", "disp_timeout"),
        }
    ),
    "KPC_KCUBEMMIPARAMS": Care(
        {
            **_all(_LOWER, "js_volt_step", "js_pos_step", "disp_brightness", "disp_dim_level"),
            **_all(_NEAR, "preset_volt1", "preset_volt2", "preset_pos1", "preset_pos2"),
            "disp_timeout": _NEAR,
        }
    ),
    "KSG_KCUBEMMIPARAMS": Care(
        {**_all(_LOWER, "disp_intensity", "disp_dim_level"), "disp_timeout": _NEAR}
    ),
    "KPZ_KCUBETRIGIOCONFIG": Care(_PORTS, only_if=_UNUSED_PORTS),
    "KSG_KCUBETRIGIOCONFIG": Care(_LIMITED_PORTS, only_if=_UNUSED_PORTS),
    "KPC_KCUBETRIGIOCONFIG": Care(_LIMITED_PORTS, only_if=_UNUSED_PORTS),
    "KPC_IOSETTINGS": Care(_all(_NEAR, "force_sense")),
    # Issue 37: motors. The display and the joystick of a BBD30x belong to all its channels. Ports that output
    # something keep their settings, because a change could reach the connected equipment.
    "MOT_KCUBEMMIPARAMS": Care(
        {
            **_all(_LOWER, "js_max_vel", "js_accn", "disp_brightness", "disp_dim_level"),
            **_all(_NEAR, "preset_pos1", "preset_pos2", "disp_timeout"),
            "preset_pos3": Varied(How.NEAR, advised=True),  # page 138: only on the BBD30x
            "js_sensitivity": Varied(How.LOWER, floor=1, advised=True),
        }
    ),
    "MOT_KCUBETRIGIOCONFIG": Care(_PORTS, only_if=_UNUSED_PORTS),
    "MOT_KCUBEPOSTRIGPARAMS": Care(
        {
            **_all(_WIDE, "start_pos_fwd", "start_pos_rev"),
            **_all(Varied(How.NEAR, floor=1), "interval_fwd", "interval_rev"),
            **_all(Varied(How.NEAR, floor=1), "num_pulses_fwd", "num_pulses_rev", "num_cycles"),
            "pulse_width": _HIGHER,
        }
    ),
    "MOT_KCUBEKSTLOOPPARAMS": Care(
        _all(_NEAR, "prop", "integral", "diff", "pid_clip", "pid_tol"),
        only_if={"loop_mode": (1,)},  # open loop, which does not use them
    ),
    "MOT_BOWINDEX": Care(_all(_NEAR, "bow_index")),
    "MOT_JOYSTICKPARAMS": Care(
        _all(
            _SHARED,
            *("js_gear_low_max_vel", "js_gear_high_max_vel"),
            *("js_gear_low_accn", "js_gear_high_accn"),
        )
    ),
    "MOT_IOCONFIG": Care(_all(_LISTED, "out_source"), only_if={"mode": (0,)}),  # an input
    "MOT_MOTTRIGIOCONFIG": Care(
        {
            **_all(_WIDE, "start_pos_fwd", "start_pos_rev"),
            **_all(Varied(How.NEAR, floor=1), "interval_fwd", "interval_rev"),
            **_all(Varied(How.NEAR, floor=1), "num_pulses_fwd", "num_pulses_rev", "num_cycles"),
            "pulse_width": _HIGHER,
        },
        only_if={"trig_out_mode": (0x00, 0x0A)},  # no pulses
    ),
    "MOT_LCDDISPLAYPARAMS": Care(
        {
            **_all(_SHARED, "js_sensitivity", "disp_brightness", "disp_dim_level"),
            "disp_time_out": Varied(How.NEAR, floor=1, common=True),
        }
    ),
    "MOT_LCDMOVEPARAMS": Care(
        {
            **_all(_SHARED, "jog_step_size", "accn", "max_vel"),
            "preset_pos": Varied(How.NEAR, common=True),
            **_all(Varied(How.NEAR, common=True, advised=True), "preset_pos2", "preset_pos3"),
        }
    ),
    "MOT_MFF_OPERPARAMS": Care(
        {
            "transit_time": _HIGHER,
            "transit_time_adc": _LOWER,  # fewer counts are a longer time (page 182)
            **_all(_NEAR, "dig_io1_pulse_width", "dig_io2_pulse_width"),
        }
    ),
}
"""The treatment of each parameter set, by its name in the registry."""
