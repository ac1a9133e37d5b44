"""The rules of Issue 37 that findings about fields and parameter sets name, besides those of Issue 3."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

FIELDS: Final[Mapping[str, str]] = {
    "MOT_GET_KCUBEMMIPARAMS.js_mode": "wheel-modes",
    "MOT_GET_KCUBEMMIPARAMS.dir_sense": "wheel-directions",
    "MOT_GET_KCUBEMMIPARAMS.disp_brightness": "panel-brightness-range",
    "MOT_GET_KCUBEMMIPARAMS.disp_timeout": "panel-timeout-range",
    "MOT_GET_KCUBEMMIPARAMS.disp_dim_level": "panel-dim-range",
    "trig1_polarity": "trigger-polarities",
    "trig2_polarity": "trigger-polarities",
    "MOT_GET_KCUBEPOSTRIGPARAMS.pulse_width": "trigger-pulse-width-range",
    "loop_mode": "stepper-loop-modes",
    "MOT_GET_POWERPARAMS.rest_factor": "phase-power-range",
    "MOT_GET_POWERPARAMS.move_factor": "phase-power-range",
    "bow_index": "bow-index-range",
    "MOT_GET_JOYSTICKPARAMS.dir_sense": "joystick-directions",
    "mmi_lock": "panel-lock-states",
    "trig_in_mode": "bbd-trigger-input-modes",
    "trig_in_source": "bbd-trigger-sources",
    "trig_in_polarity": "bbd-trigger-polarities",
    "trig_out_polarity": "bbd-trigger-polarities",
    "MOT_GET_MOTTRIGIOCONFIG.pulse_width": "bbd-pulse-width-range",
    "MOT_GET_IOCONFIG.mode": "connector-modes",
    "MOT_GET_IOCONFIG.out_source": "connector-sources",
    "MOT_GET_AUXIOCONFIG.mode": "aux-modes",
    "sys_var": "monitor-variables",
    "MOT_GET_POSTRIGENSTATE.state": "position-trigger-states",
    "MOT_GET_LCDDISPLAYPARAMS.disp_brightness": "front-panel-brightness-range",
    "MOT_GET_LCDDISPLAYPARAMS.disp_dim_level": "front-panel-brightness-range",
    "MOT_GET_LCDMOVEPARAMS.jog_stop_mode": "front-panel-stop-modes",
    "transit_time": "flipper-transit-range",
    "dig_io1_oper_mode": "flipper-connector-modes",
    "dig_io2_oper_mode": "flipper-connector-modes",
    "dig_io1_sig_mode": "flipper-signal-modes",
    "dig_io2_sig_mode": "flipper-signal-modes",
    "dig_io1_pulse_width": "flipper-pulse-range",
    "dig_io2_pulse_width": "flipper-pulse-range",
    "control_src": "ppc-io-sources",
    "monitor_op_sig": "ppc-io-monitor",
    "monitor_op_bw": "ppc-io-monitor",
    "feedback_src": "ppc-io-feedback",
    "fp_brightness": "ppc-io-brightness",
    "criterion": "ct1p-criterion",
    "KPZ_GET_KCUBEMMIPARAMS.disp_brightness": "kpz-display-brightness",
    "KPZ_GET_KCUBEMMIPARAMS.disp_timeout": "kpz-display-timeout",
    "KPZ_GET_KCUBEMMIPARAMS.disp_dim_level": "kpz-display-dim-level",
    "KSG_GET_KCUBEMMIPARAMS.disp_intensity": "ksg-display",
    "KSG_GET_KCUBEMMIPARAMS.disp_timeout": "ksg-display-timeout",
    "KSG_GET_KCUBEMMIPARAMS.disp_dim_level": "ksg-display-dim-level",
    "KSG_GET_KCUBETRIGIOCONFIG.lower_lim": "ksg-trigger-limits",
    "KSG_GET_KCUBETRIGIOCONFIG.upper_lim": "ksg-trigger-limits",
    "circ_dia_mode": "nanotrak-diameter-modes",
    "PZ_GET_NTFEEDBACKSRC.feedback_src": "nanotrak-input-values",
    "KNA101.lv_out_range": "kna101-output-fixed",
    "KNA101.lv_out_route": "kna101-output-fixed",
    "QUAD_GET_DISPLAYSETTINGS.disp_intensity": "quad-display-intensity",
    "TEC_GET_DISPSETTINGS.disp_intensity": "tec-display-intensity",
    "trig1_sum_min": "quad-trigger-percent",
    "trig1_sum_max": "quad-trigger-percent",
    "trig1_diff_threshold": "quad-trigger-percent",
    "trig2_sum_min": "quad-trigger-percent",
    "trig2_sum_max": "quad-trigger-percent",
    "trig2_diff_threshold": "quad-trigger-percent",
    "PZMOT_GET_DRIVEOPPARAMS.max_voltage": "pzmot-voltage-range",
    "PZMOT_GET_DRIVEOPPARAMS.step_rate": "pzmot-rate-ranges",
    "PZMOT_GET_DRIVEOPPARAMS.step_accn": "pzmot-rate-ranges",
    "jog_step_rate": "pzmot-rate-ranges",
    "jog_step_accn": "pzmot-rate-ranges",
    "PZMOT_GET_TIMJOGPARAMS.jog_step_size": "pzmot-jog-size-range",
    "jog_step_size_fwd": "pzmot-jog-size-range",
    "jog_step_size_rev": "pzmot-jog-size-range",
    "PZMOT_GET_TIMPOTPARAMS.max_step_rate": "pzmot-pot-rate-range",
    "home_offset_dist": "pzmot-home-offset-range",
    "js_max_step_rate": "pzmot-joystick-rate-range",
    "PZMOT_GET_KCUBEMMIPARAMS.disp_brightness": "pzmot-brightness-range",
    "POL_GET_PARAMS.velocity": "pol-global-settings",
    "POL_GET_PARAMS.home_position": "pol-home-range",
    "jog_step1": "pol-step-range",
    "jog_step2": "pol-step-range",
    "jog_step3": "pol-step-range",
}
"""Field, or message or unit and field -> the rule about its values."""

MESSAGES: Final[Mapping[str, str]] = {
    "MOT_GET_KCUBEKSTLOOPPARAMS": "stepper-loop-ranges",
    "PZ_GET_PPC_PIDCONSTS": "ppc-pid-ranges",
    "PZ_GET_PPC_NOTCHPARAMS": "ppc-notch-filters",
    "QUAD_GET_LOOPPARAMS": "quad-gain-range",
    "QUAD_GET_LOOPPARAMS2": "quad-loopparams2-ranges",
    "TEC_GET_LOOPPARAMS": "tec-gain-ranges",
}
"""Message -> the rule about the values of all its other fields."""

SETS: Final[Mapping[str, str]] = {
    "MOT_SET_KCUBEMMIPARAMS": "panel-parameters",
    "MOT_SET_KCUBETRIGIOCONFIG": "trigger-port-configuration",
    "MOT_SET_KCUBEPOSTRIGPARAMS": "position-trigger-parameters",
    "MOT_SET_KCUBEKSTLOOPPARAMS": "stepper-loop-parameters",
    "MOT_SET_POWERPARAMS": "phase-power",
    "MOT_SET_BOWINDEX": "bow-index",
    "MOT_SET_JOYSTICKPARAMS": "joystick-parameters",
    "MOT_SET_TRIGGER": "trigger-mode",
    "MOD_SET_DIGOUTPUTS": "digital-outputs-bits-set",
    "MOT_SET_MOTTRIGIOCONFIG": "bbd-trigger-configuration",
    "MOT_SET_IOCONFIG": "connector-configuration",
    "MOT_SET_AUXIOCONFIG": "aux-configuration",
    "MOT_SET_ANALOGMONITORCONFIG": "monitor-configuration",
    "MOT_SET_POSTRIGENSTATE": "position-trigger-armed",
    "MOT_SET_LCDDISPLAYPARAMS": "front-panel-display",
    "MOT_SET_LCDMOVEPARAMS": "front-panel-moves",
    "MOT_SET_MFF_OPERPARAMS": "flipper-parameters",
    "PZ_SET_PPC_PIDCONSTS": "ppc-pid-constants",
    "PZ_SET_PPC_NOTCHPARAMS": "ppc-notch-filters",
    "PZ_SET_PPC_IOSETTINGS": "ppc-io-settings",
    "PZ_SET_PIDCRITERIA": "ct1p-criterion",
    "KPZ_SET_KCUBEMMIPARAMS": "kpz-panel",
    "KPZ_SET_KCUBETRIGIOCONFIG": "kpz-trigger-ports",
    "KSG_SET_KCUBEMMIPARAMS": "ksg-display",
    "KSG_SET_KCUBETRIGIOCONFIG": "ksg-trigger-ports",
}
"""SET message -> the rule that it sets its parameters."""

SUB_MESSAGES: Final[Mapping[str, str]] = {
    "inertial": "pzmot-reply-sub-message",
    "laser": "laser-sub-message-returned",
    "quad": "quad-reply-sub-message",
    "tec": "tec-reply-sub-message",
}
"""Chapter -> the rule that a reply has the sub-message of its request."""

ONCE: Final[Mapping[str, str]] = {
    "PZ_GET_NTSTATUSUPDATE": "nanotrak-status-each-request",
    "LA_GET_STATUSUPDATE": "laser-status-each-request",
    "LD_GET_STATUSUPDATE": "laser-status-each-request",
}
"""Message -> the rule that a request is answered once."""

OF_REPLIES: Final = tuple(dict.fromkeys((*SUB_MESSAGES.values(), *ONCE.values())))
"""The rules about replies, each once."""

OF_CONNECTORS: Final = (
    "connector-configuration",
    "aux-configuration",
    "connector-modes",
    "connector-sources",
    "aux-modes",
)
"""The rules about settings of which a request selects one connector."""

_READ_ONLY: Final = ("pzmot-home-offset-range",)
"""The rules about values that no message of a simulated unit sets."""

OF_VALUES: Final = tuple(dict.fromkeys((*FIELDS.values(), *MESSAGES.values())))
"""The rules about values, each once."""

OF_SETTINGS: Final = tuple(
    rule
    for rule in dict.fromkeys((*OF_VALUES, *SETS.values()))
    if rule not in (*OF_CONNECTORS, *_READ_ONLY)
)
"""The rules about parameter sets that are read back, and about their values."""
