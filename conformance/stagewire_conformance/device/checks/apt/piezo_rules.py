"""The rules of Issue 37 that findings about piezo controllers and strain gauge readers name."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

FIELDS: Final[Mapping[str, str]] = {
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
}
"""Field, or message and field -> the rule about its values."""

MESSAGES: Final[Mapping[str, str]] = {
    "PZ_GET_PPC_PIDCONSTS": "ppc-pid-ranges",
    "PZ_GET_PPC_NOTCHPARAMS": "ppc-notch-filters",
}
"""Message -> the rule about the values of all its other fields."""

SETS: Final[Mapping[str, str]] = {
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
