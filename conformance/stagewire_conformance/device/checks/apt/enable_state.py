"""The enable state of a channel: changed for a check, and restored after it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from stagewire.errors import StagewireError
from stagewire_apt import messages as m
from stagewire_apt.enumerations import EnableState
from stagewire_conformance.device.causes import EFFECT, SHARED, Cause
from stagewire_conformance.device.trial import EnoughError

if TYPE_CHECKING:
    from stagewire_conformance.device.targets import Target
    from stagewire_conformance.device.trial import Trial

_TRIES: Final = 2
"""The most attempts to restore the state."""

PAUSE: Final = 0.2
"""Seconds after a change of the enable state; the registry names a driver that waits as long for a paddle."""

ENABLED_SETS: Final = frozenset(
    {"MOD_SET_CHANENABLESTATE", "MOD_REQ_CHANENABLESTATE", "MOD_GET_CHANENABLESTATE"}
)
"""The messages that a target must claim."""

CONFUSING: Final = Cause("MOD_SET_CHANENABLESTATE", SHARED)
"""The defect that the enable state of another bay or channel is also set, or returned."""

ENABLING: Final = (Cause("MOD_SET_CHANENABLESTATE", EFFECT),)
"""The defect that the enable state cannot be set."""


def enable_state(trial: Trial, place: Target, channel: int) -> int:
    """Return the enable state (page 17); end the check if there is no reply."""
    state: int = trial.reply(m.ModReqChanEnableState(channel), place.address).message.enable_state
    return state


def switch(trial: Trial, place: Target, channel: int, state: int) -> None:
    """Enable or disable a channel until the end of the check. Send nothing if it is already in that state.

    The check ends if the controller does not change the state.
    """
    if not place.messages >= ENABLED_SETS:
        return
    before = enable_state(trial, place, channel)
    if before == state:
        return
    trial.undo(
        f"enable state of {place.name} channel {channel}",
        lambda: put_back(trial, place, channel, before),
        because=lambda: ENABLING,
    )
    trial.line.send(m.ModSetChanEnableState(channel, state), place.address)
    now = enable_state(trial, place, channel)
    trial.need(
        now == state,
        f"{place.name} channel {channel}: MOD_SET_CHANENABLESTATE set "
        f"{EnableState(state).name}, but MOD_GET_CHANENABLESTATE then returned {now}",
        rule="channel-enable",
        cause=ENABLING,
    )


def put_back(trial: Trial, place: Target, channel: int, before: int) -> None:
    """Write the previous enable state, and check that it is in effect.

    Raise :class:`~stagewire.errors.StagewireError`, which says what to do, if it is not. A channel that was
    disabled because it did not stop is not enabled again.
    """
    if before == EnableState.ENABLE and f"{place.name} channel {channel}" in trial.line.disabled:
        raise StagewireError("it was disabled because it ignored its stops")
    for _ in range(_TRIES):  # a lost message must not leave the state changed
        trial.line.send(m.ModSetChanEnableState(channel, before), place.address)
        came = trial.line.ask(m.ModReqChanEnableState(channel), place.address)
        if came is not None and came.message.enable_state == before:
            return
    raise StagewireError(
        f"{place.name} channel {channel}: send MOD_SET_CHANENABLESTATE with enable_state={before}"
    )


def disables_others(place: Target) -> bool:
    """Return whether enabling one channel of a target disables its other channels, as on an MPC320."""
    enabling = place.unit.enabling
    return enabling is not None and enabling.disables_others and not enabling.channels


def keep_states(trial: Trial, place: Target) -> None:
    """Restore the enable states of all channels of a target at the end of the check.

    The check ends if the states could not be restored, because enabling a channel disables the others.
    """
    before = {each: enable_state(trial, place, each) for each in place.channels}
    enabled = [each for each, was in before.items() if was == EnableState.ENABLE]
    if disables_others(place) and len(enabled) > 1:
        trial.inconclusive(
            f"{place.name}: the channels {', '.join(map(str, enabled))} are enabled, and may not all be "
            "enabled again; enable at most one of them before the run"
        )
        raise EnoughError
    trial.undo(
        f"enable states of {place.name}",
        lambda: _put_all_back(trial, place, before),
        because=lambda: (*ENABLING, CONFUSING),
    )


def _put_all_back(trial: Trial, place: Target, before: dict[int, int]) -> None:
    """Write the states that have changed: those of disabled channels first."""
    for state in (EnableState.DISABLE, EnableState.ENABLE):
        for channel, was in before.items():
            if was == state != enable_state(trial, place, channel):
                trial.line.send(m.ModSetChanEnableState(channel, state), place.address)
                trial.line.pause(PAUSE)
    now = {each: enable_state(trial, place, each) for each in place.channels}
    if now != before:
        wanted = ", ".join(f"{each}: {EnableState(was).name}" for each, was in before.items())
        raise StagewireError(f"{place.name}: set these enable states: {wanted}")
