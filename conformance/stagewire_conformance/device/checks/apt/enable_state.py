"""The enable state of a channel: changed for a check, and restored after it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from stagewire.errors import StagewireError
from stagewire_apt import messages as m
from stagewire_apt.enumerations import EnableState
from stagewire_conformance.device.causes import EFFECT, SHARED, Cause

if TYPE_CHECKING:
    from stagewire_conformance.device.targets import Target
    from stagewire_conformance.device.trial import Trial

_TRIES: Final = 2
"""The most attempts to restore the state."""

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
