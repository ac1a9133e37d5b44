"""Virtual controllers of Issue 37 with settings as in a laboratory, so that each value can be changed."""

from __future__ import annotations

from typing import Any

from apt_runs import Bench, bench

_PULSES = {
    "start_pos_fwd": 10_000, "interval_fwd": 500, "num_pulses_fwd": 20, "start_pos_rev": 90_000,
    "interval_rev": 600, "num_pulses_rev": 30, "pulse_width": 50_000, "num_cycles": 40,
}  # fmt: skip
_VALUES: dict[str, dict[str, int]] = {
    "MOT_SET_KCUBEMMIPARAMS": {
        "js_mode": 1, "js_max_vel": 439_804, "js_accn": 1_374, "dir_sense": 1, "preset_pos1": 10_000,
        "preset_pos2": 20_000, "disp_brightness": 60, "disp_timeout": 10, "disp_dim_level": 2,
        "preset_pos3": 30_000, "js_sensitivity": 1_000,
    },
    "MOT_SET_KCUBEPOSTRIGPARAMS": _PULSES,
    "MOT_SET_KCUBEKSTLOOPPARAMS": {
        "loop_mode": 1, "prop": 20_000, "integral": 1_000, "diff": 100, "pid_clip": 100_000,
        "pid_tol": 200, "encoder_const": 0,
    },
    "MOT_SET_POWERPARAMS": {"rest_factor": 30, "move_factor": 100},
    "MOT_SET_JOYSTICKPARAMS": {
        "js_gear_low_max_vel": 134_218, "js_gear_high_max_vel": 1_342_177, "js_gear_low_accn": 1_374,
        "js_gear_high_accn": 13_744, "dir_sense": 1,
    },
    "MOT_SET_LCDDISPLAYPARAMS": {
        "js_sensitivity": 1_000, "disp_brightness": 60, "disp_time_out": 10, "disp_dim_level": 5,
    },
    "MOT_SET_LCDMOVEPARAMS": {
        "channel": 1, "js_mode": 1, "jog_step_size": 2_000, "accn": 1_374, "max_vel": 134_218,
        "jog_stop_mode": 2, "preset_pos": 1_000, "preset_pos2": 2_000, "preset_pos3": 3_000,
    },
    "MOT_SET_MOTTRIGIOCONFIG": {
        "channel": 1, "trig_in_mode": 0, "trig_in_polarity": 1, "trig_in_source": 1,
        "trig_out_mode": 0x0A, "trig_out_polarity": 1, **_PULSES,
    },
    "MOT_SET_POSTRIGENSTATE": {"state": 2},
}  # fmt: skip


def laboratory(unit: str) -> Bench:
    """Return a unit without a fault, in its state before a run."""
    on = bench(unit)
    link, protocol = on.link, on.declared.framed
    for place in on.declared.places:
        for name in sorted(place.listed & _VALUES.keys()):
            values: dict[str, Any] = dict(_VALUES[name])
            if "chan_ident" in protocol.message_class(name).layout.fields:
                values["chan_ident"] = 1
            message = protocol.build(name, values)
            link.write(message.pack(place.address, protocol.host))
    link.read(0.2)
    return on
