"""Whether a setting may be changed just now: what the loop that would feel it is doing."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from stagewire_apt import messages as m
from stagewire_apt.enumerations import EnableState, PositionControlMode
from stagewire_conformance.device.checks.apt.settings.care import Care, When

if TYPE_CHECKING:
    from stagewire_conformance.device.checks.apt.settings.sets import Spot
    from stagewire_conformance.device.trial import Trial


_OPEN: Final = (PositionControlMode.OPEN_LOOP, PositionControlMode.OPEN_LOOP_SMOOTH)


def why_not_now(trial: Trial, spot: Spot, care: Care) -> str:
    """Return why a setting is only written back as it is; empty where it may be changed."""
    channel = 1 if spot.channel is None else spot.channel
    match care.when:
        case When.DISABLED:
            request = "MOD_REQ_CHANENABLESTATE"
            if request not in spot.place.messages:
                return "nothing tells whether the channel is disabled"
            enabled = trial.reply(m.ModReqChanEnableState(channel), spot.place.address).message
            if enabled.enable_state != EnableState.DISABLE:
                return "the channel is enabled, and its loop would feel a change"
        case When.OPEN_LOOP:
            request = "PZ_REQ_POSCONTROLMODE"
            if request not in spot.place.messages:
                return "nothing tells whether a loop is closed"
            mode = trial.reply(m.PzReqPosControlMode(channel), spot.place.address).message.mode
            if mode not in _OPEN:
                return "the loop is closed, and would feel a change"
    return ""
