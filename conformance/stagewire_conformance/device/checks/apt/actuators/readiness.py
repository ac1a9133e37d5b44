"""Enable an actuator for a check, and restore the state of all channels of its target afterwards.

A KIM101 or KIM001 has an enable mode for all channels (page 394). Enabling a paddle disables the others.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from stagewire.errors import StagewireError
from stagewire_apt import messages as m
from stagewire_apt.enumerations import ChannelEnableMode, EnableState
from stagewire_conformance.device.checks.apt.enable_state import (
    ENABLED_SETS,
    ENABLING,
    PAUSE,
    enable_state,
    keep_states,
)

if TYPE_CHECKING:
    from stagewire.protocols import FramedMessage
    from stagewire_conformance.device.targets import Target
    from stagewire_conformance.device.trial import Trial

MODE_SETS: Final = frozenset(
    {
        "PZMOT_SET_KCUBECHANENABLEMODE",
        "PZMOT_REQ_KCUBECHANENABLEMODE",
        "PZMOT_GET_KCUBECHANENABLEMODE",
    }
)
"""The messages of the enable mode."""


def has_mode(place: Target) -> bool:
    """Return whether a target has an enable mode."""
    return place.messages >= MODE_SETS


def get_ready(trial: Trial, place: Target, channel: int) -> None:
    """Enable a channel until the end of the check; the check ends if the controller does not."""
    if has_mode(place):
        enabling = place.unit.enabling
        assert enabling is not None  # each unit with the mode has it
        mode = _mode(trial, place)
        if channel.bit_length() not in enabling.channels.get(mode, ()):
            set_mode(trial, place, enabling.value_for((channel.bit_length(),)))
    if place.messages >= ENABLED_SETS:
        enabling = place.unit.enabling
        enabled = enable_state(trial, place, channel) == EnableState.ENABLE
        if not enabled or (enabling is not None and enabling.before_motions):
            set_state(trial, place, channel, EnableState.ENABLE)


def disable(trial: Trial, place: Target, channel: int) -> None:
    """Disable a channel until the end of the check: with the enable mode if there is one."""
    if has_mode(place):
        set_mode(trial, place, ChannelEnableMode.NONE)
    else:
        set_state(trial, place, channel, EnableState.DISABLE)


def interrupt(trial: Trial, place: Target, channel: int) -> None:
    """Disable a channel that ignores its stop, and enable it again when it rests."""
    if has_mode(place):
        again: FramedMessage = m.PzmotSetKcubeChanEnableMode(mode=_mode(trial, place))
    elif place.messages >= ENABLED_SETS:
        again = m.ModSetChanEnableState(channel, EnableState.ENABLE)
    else:
        return
    trial.line.disable_channel(place, channel)
    trial.line.pause(PAUSE)
    trial.line.send(again, place.address)


def _mode(trial: Trial, place: Target) -> int:
    mode: int = trial.reply(m.PzmotReqKcubeChanEnableMode(), place.address).message.mode
    return mode


def set_mode(trial: Trial, place: Target, mode: int) -> None:
    """Set the enable mode until the end of the check."""
    before = _mode(trial, place)
    if before == mode:
        return
    trial.undo(
        f"enable mode of {place.name}",
        lambda: _put_back(trial, place, before),
        rule="pzmot-enable-mode",
    )
    trial.line.send(m.PzmotSetKcubeChanEnableMode(mode=mode), place.address)
    now = _mode(trial, place)
    trial.need(
        now == mode,
        f"{place.name}: PZMOT_SET_KCUBECHANENABLEMODE set the mode {mode}, but "
        f"PZMOT_GET_KCUBECHANENABLEMODE then returned {now}",
        rule="pzmot-enable-mode",
    )


def _put_back(trial: Trial, place: Target, mode: int) -> None:
    trial.line.send(m.PzmotSetKcubeChanEnableMode(mode=mode), place.address)
    if _mode(trial, place) != mode:
        raise StagewireError(f"{place.name}: send PZMOT_SET_KCUBECHANENABLEMODE with mode={mode}")


def set_state(trial: Trial, place: Target, channel: int, state: EnableState) -> None:
    """Set the enable state of a channel, and restore the states of all channels at the end of the check.

    The check ends if the states could not be restored, because enabling a channel disables the others.
    """
    keep_states(trial, place)
    trial.line.send(m.ModSetChanEnableState(channel, state), place.address)
    trial.line.pause(PAUSE)
    now = enable_state(trial, place, channel)
    trial.need(
        now == state,
        f"{place.name} channel {channel}: MOD_SET_CHANENABLESTATE set {state.name}, but "
        f"MOD_GET_CHANENABLESTATE then returned {now}",
        rule="channel-enable",
        cause=ENABLING,
    )
