"""A channel is enabled or disabled for a check, and afterwards as it was."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from stagewire.errors import StagewireError
from stagewire_apt import messages as m
from stagewire_apt.enumerations import EnableState

if TYPE_CHECKING:
    from stagewire_conformance.device.targets import Target
    from stagewire_conformance.device.trial import Trial

_TRIES: Final = 2
"""Times that it is put back, where it is not seen to be there."""

ENABLED_SETS: Final = frozenset(
    {"MOD_SET_CHANENABLESTATE", "MOD_REQ_CHANENABLESTATE", "MOD_GET_CHANENABLESTATE"}
)
"""The messages that a place has to claim."""


def enable_state(trial: Trial, place: Target, channel: int) -> int:
    """Ask for the enable state (page 17); the check ends where nothing answers."""
    state: int = trial.reply(m.ModReqChanEnableState(channel), place.address).message.enable_state
    return state


def switch(trial: Trial, place: Target, channel: int, state: int) -> None:
    """Enable or disable a channel until the end of the check; nothing is sent where it is so already.

    The check ends where the controller does not do it.
    """
    if not place.messages >= ENABLED_SETS:
        return
    before = enable_state(trial, place, channel)
    if before == state:
        return
    trial.undo(
        f"enable state of {place.name} channel {channel}",
        lambda: put_back(trial, place, channel, before),
    )
    trial.line.send(m.ModSetChanEnableState(channel, state), place.address)
    now = enable_state(trial, place, channel)
    trial.need(
        now == state,
        f"{place.name} channel {channel}: MOD_SET_CHANENABLESTATE wrote {EnableState(state).name}, and "
        f"MOD_GET_CHANENABLESTATE then said {now}",
    )


def put_back(trial: Trial, place: Target, channel: int, before: int) -> None:
    """Write the enable state that was there, and see that it is there again.

    Raises :class:`~stagewire.errors.StagewireError` with what to do where it is not.
    """
    for _ in range(_TRIES):  # one lost message is not to leave it changed
        trial.line.send(m.ModSetChanEnableState(channel, before), place.address)
        came = trial.line.ask(m.ModReqChanEnableState(channel), place.address)
        if came is not None and came.message.enable_state == before:
            return
    raise StagewireError(
        f"{place.name} channel {channel}: write MOD_SET_CHANENABLESTATE enable_state={before}"
    )
