"""How far a check may change a setting: what is not named here is only written back as it is.

A SET is checked by changing one value after the other and reading it back. Which values may be changed for
that, and in which direction, no registry says; it is a matter of safety. The rule: no change takes a
protection away, makes anything faster, stronger or longer than it was, or lets something move or warm up. So

* velocities, accelerations, slew rates and gains only become lower, limits only narrower;
* what is only stored until it is asked for (the targets of the next moves) may differ by more than two bytes
  hold, so that its width is seen, too;
* switches of limits are only set to work (makes, breaks), never to be ignored;
* gains and currents of a motor's loop are changed only while the channel is disabled, those of a piezo's loop
  and the ways of its feedback only in open loop: elsewhere the loop would feel it;
* what names no value in :data:`CARE` is written as it was read. So are those whose change would by itself
  move something or take hold of what is connected: analogue inputs that are added to an output, the maximum
  voltage (an output keeps its share of it), what the BNC connectors and the feedback of a strain gauge reader
  are used for, what a button does, in which direction and at which switch a stage homes; and the travel of a
  stage, which can be narrowed but not widened again (page 75).
"""

from __future__ import annotations

import enum
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

from stagewire_conformance.registry import Json


class How(enum.Enum):
    """In which way a value may be changed."""

    NEAR = "a little up and down"
    LOWER = "a little lower"
    HIGHER = "a little higher"
    WIDE = "a little up and down, and by more than two bytes hold"
    LISTED = "to each documented value"
    FEWER = "to each documented value below the present one"
    BITS = "one documented bit at a time"


class When(enum.Enum):
    """When a setting may be changed at all."""

    ALWAYS = "always"
    DISABLED = "while the channel is disabled"
    OPEN_LOOP = "in open loop"


@dataclass(frozen=True)
class Varied:
    """How one value may be changed.

    :param values: of :attr:`How.LISTED` the only ones; empty: all that the document has.
    :param keep: bits that stay as they are, whatever value is written.
    :param floor: the lowest number that is written.
    :param common: a controller has it once for all channels, and takes it by any of them.
    :param advised: the document does not say that the value can be set on every unit.
    :param like: another value that it may be set equal to, if that one is lower.
    """

    how: How
    values: tuple[int, ...] = ()
    keep: int = 0
    floor: int | None = None
    common: bool = False
    advised: bool = False
    like: str = ""

    def listed(self, facts: Json) -> tuple[int, ...]:
        """Return the documented values that may be written; ``facts`` are those of the field."""
        return self.values or tuple(sorted(facts.get("enum", {}).values()))


@dataclass(frozen=True)
class Care:
    """How a parameter set is treated.

    :param fields: what may be changed, by name.
    :param when: it may be.
    :param doubtful: why a value that is not read back breaks no rule; empty: it breaks one.
    :param first_channel: the document addresses the first channel only.
    :param zero: values that are always zero, as the document says.
    :param ignored: values that mean nothing when they are set, and are sent as zero.
    """

    fields: Mapping[str, Varied] = field(default_factory=dict)
    when: When = When.ALWAYS
    doubtful: str = ""
    first_channel: bool = False
    zero: tuple[str, ...] = ()
    ignored: tuple[str, ...] = ()


_NEAR: Final = Varied(How.NEAR)
_LOWER: Final = Varied(How.LOWER, floor=1)
_WIDE: Final = Varied(How.WIDE)
_HIGHER: Final = Varied(How.HIGHER)
_LISTED: Final = Varied(How.LISTED)
_SWITCH: Final = Varied(How.LISTED, values=(2, 3), keep=0x80)  # page 39: makes, breaks; swapped


def _all(varied: Varied, *names: str) -> dict[str, Varied]:
    return dict.fromkeys(names, varied)


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
        doubtful="PZ_REQ_OUTPUTLUT names no sample, and page 107 does not say which one is told",
    ),
    "PZ_OUTPUTLUTPARAMS": Care(
        {
            # what all units have, and both together; triggers are not those of the TPZ001 (page 108)
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
    "PZ_TPZ_SLEWRATES": Care(_all(_LOWER, "slew_open", "slew_closed")),  # page 123: 0 is no limit
    "PZ_IOSETTINGS": Care(
        {
            "amp_current_lim": Varied(How.FEWER),
            "amp_lp_filter": Varied(How.LISTED, common=True),
        },
        when=When.OPEN_LOOP,
        first_channel=True,  # page 119
    ),
    "PZ_TSG_IOSETTINGS": Care({"display_mode": _LISTED, "force_calib": _NEAR}),
}
"""The treatment of each parameter set by its name in the registry."""
