"""``enable``: a channel can be disabled and enabled, and reports its state (pages 17 and 80).

Gains and current limits of a motor's loop are read back while its channel is disabled. A change would affect
the loop of an enabled channel, so ``readback`` only writes the current values there. This check needs
permission for motion: a stage that no loop holds may give way.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Final

from stagewire_apt import messages as m
from stagewire_apt.enumerations import EnableState, SolenoidState
from stagewire_apt.flags import BpcStatusBits, DcStatusBits
from stagewire_conformance.device.causes import Cause
from stagewire_conformance.device.check import Case, Kind
from stagewire_conformance.device.checks.apt.enable_state import (
    CONFUSING,
    ENABLED_SETS,
    ENABLING,
    PAUSE,
    disables_others,
    enable_state,
    keep_states,
    put_back,
    switch,
)
from stagewire_conformance.device.checks.apt.motion.axis import Axis
from stagewire_conformance.device.checks.apt.motion.motor_check import lacks_range, motors, unseen
from stagewire_conformance.device.checks.apt.outputs.output_check import lacks_volts, output_check
from stagewire_conformance.device.checks.apt.outputs.piezo import Piezo, bits_are_known
from stagewire_conformance.device.checks.apt.replies import judge_unasked, need_positions
from stagewire_conformance.device.checks.apt.settings.care import CARE, When
from stagewire_conformance.device.checks.apt.settings.readback import write_and_read
from stagewire_conformance.device.checks.apt.settings.sets import Neighbours, PlacedSet, placed_sets
from stagewire_conformance.device.permissions import HAZARDS, Need

if TYPE_CHECKING:
    from stagewire_conformance.device.declaration import Declaration
    from stagewire_conformance.device.permissions import Permissions
    from stagewire_conformance.device.targets import Target
    from stagewire_conformance.device.trial import Trial

_WAIT: Final = 1.0
"""Seconds within which the status must show the new state."""


def _lacks(declared: Declaration, allowed: Permissions, place: Target) -> str:
    if (place, 1) in motors(declared):
        return lacks_range(declared, allowed, (place, 1))
    is_piezo = "PZ_REQ_OUTPUTVOLTS" in place.messages
    return lacks_volts(declared, allowed, place) if is_piezo else ""


def _skip(declared: Declaration, place: Target) -> str:
    return unseen(place) if (place, 1) in motors(declared) else ""


def _bits_of(place: Target) -> tuple[str, ...]:
    """Return the request and the message that have the enabled bit; empty if none is claimed."""
    if place.status == "dc" and "MOT_REQ_STATUSBITS" in place.messages:
        return "MOT_REQ_STATUSBITS", "MOT_GET_STATUSBITS"
    if bits_are_known(place) and "PZ_REQ_PZSTATUSBITS" in place.messages:
        return "PZ_REQ_PZSTATUSBITS", "PZ_GET_PZSTATUSBITS"
    return ()


ENABLE = Kind(
    name="enable",
    title="A channel can be disabled and enabled, and reports its state",
    rules=(
        "channel-enable",
        "channel-idents",
        "slot-addressed-by-destination",
        "module-channels",
        "enable-states",
        "enable-state-read-back",
        "dc-status-bit-enabled",
        "piezo-status-bits-meaning",
    ),
)


@output_check(
    ENABLE,
    "MOD_SET_CHANENABLESTATE disables and enables {output}, and the channel reports it",
    messages=tuple(sorted(ENABLED_SETS)),
    does="disables each channel for a moment and enables it again: its stage may move if nothing "
    "holds it, and its output may drop to 0",
    lacks=_lacks,
    also=_bits_of,
    skip=_skip,
)
def _enable(trial: Trial, place: Target, channel: int) -> None:
    need_positions(trial, place)
    _see_to_it(trial, place, channel)
    before = enable_state(trial, place, channel)
    other = EnableState.DISABLE if before == EnableState.ENABLE else EnableState.ENABLE
    what = f"{place.name} channel {channel}"
    if disables_others(place):
        keep_states(trial, place)
    else:
        trial.undo(
            f"enable state of {what}",
            partial(put_back, trial, place, channel, before),
            because=lambda: (*ENABLING, CONFUSING),
        )
    others = [
        (each, number, enable_state(trial, each, number))
        for each in trial.declared.places
        for number in each.channels
        if (each, number) != (place, channel) and each.messages >= ENABLED_SETS
    ]
    for state in (other, EnableState.DISABLE + EnableState.ENABLE - other):
        name = EnableState(state).name
        trial.line.send(m.ModSetChanEnableState(channel, state), place.address)
        if disables_others(place):
            trial.line.pause(PAUSE)
        reply = trial.reply(m.ModReqChanEnableState(channel), place.address)
        now = reply.message.enable_state
        trial.must(
            now == state,
            f"{what}: MOD_SET_CHANENABLESTATE wrote {int(state)} ({name}), but "
            f"MOD_GET_CHANENABLESTATE then returned {now}",
            came=reply.raw,
            rule="channel-enable",
            cause=ENABLING,
            because=(CONFUSING,),
        )
        _judge_others(trial, place, f"{name} to {what}", others)
        for heard in trial.line.listen(0):
            judge_unasked(trial, heard, f"after MOD_SET_CHANENABLESTATE to {what}")
        _judge_bit(trial, place, channel, enabled=state == EnableState.ENABLE)


def _judge_others(
    trial: Trial, place: Target, wrote: str, others: Sequence[tuple[Target, int, int]]
) -> None:
    """Report other channels and bays whose state has changed.

    :param place: the target whose channel was set.
    :param wrote: the state that was written, and where.
    :param others: the others, with their states before.
    """
    for other, channel, was in others:
        reply = trial.reply(m.ModReqChanEnableState(channel), other.address)
        now = reply.message.enable_state
        may_be_disabled = other == place and disables_others(place)
        trial.must(
            now == was or (may_be_disabled and now == EnableState.DISABLE),
            f"MOD_SET_CHANENABLESTATE wrote {wrote}, but MOD_GET_CHANENABLESTATE of {other.name} "
            f"channel {channel} then returned {now} instead of {was}; it should be unchanged",
            came=reply.raw,
            rule="module-channels" if other == place else "slot-addressed-by-destination",
            cause=CONFUSING,
            because=ENABLING,
        )


def _see_to_it(trial: Trial, place: Target, channel: int) -> None:
    """Check that disabling a channel can do nothing that was not allowed; otherwise end the check."""
    if (place, channel) in list(motors(trial.declared)):
        Axis(trial, place, channel).inside()
    elif "PZ_REQ_OUTPUTVOLTS" in place.messages:
        piezo = Piezo(trial, place, channel)
        low, high = piezo.span("output_volts")
        if not low <= 0 <= high or not low <= piezo.volts <= high:
            piezo.give_up(
                f"{piezo.text} may output anything from 0 V to its set voltage; allow a "
                "range that includes both"
            )
    elif "MOT_REQ_SOL_STATE" in place.messages:
        state = trial.reply(m.MotReqSolState(channel), place.address).message.state
        if state == SolenoidState.SOLENOID_ON:
            trial.inconclusive(f"{place.name}: the solenoid is on, so its channel was not disabled")


def _judge_bit(trial: Trial, place: Target, channel: int, *, enabled: bool) -> None:
    """Report a wrong enabled bit in the status, if a claimed message has this bit."""
    if not _bits_of(place):
        return
    request = trial.declared.make(_bits_of(place)[0], channel)
    bits = DcStatusBits if place.status == "dc" else BpcStatusBits
    end = trial.line.now + _WAIT
    while True:
        heard = trial.reply(request, place.address)
        says = bool(bits(heard.message.status_bits).channel_enabled)
        if says == enabled or trial.line.now > end:
            break
        trial.line.listen(0.1)
    alone = says != enabled and _is_in_status(trial, place, channel, enabled)
    trial.must(
        says == enabled,
        f"{place.name} channel {channel} is {'enabled' if enabled else 'disabled'}, but "
        f"{heard.name} reports channel_enabled = {int(says)}"
        + (", unlike the status with the position" if alone else ""),
        came=heard.raw,
        rule="status-bits-same" if alone else _rule_of_bit(heard.name),
        cause=Cause(heard.name, "status_bits" if alone else "channel_enabled"),
        because=ENABLING,
    )


def _is_in_status(trial: Trial, place: Target, channel: int, enabled: bool) -> bool:
    """Return whether the status of a motor has the right bit, so that only the bits alone are wrong."""
    query = place.unit.status_query
    if place.status != "dc" or query is None or query.req is None or unseen(place):
        return False
    request = trial.declared.make(query.req.layout.message, channel)
    came = trial.reply(request, place.address)
    return bool(DcStatusBits(came.message.status_bits).channel_enabled) == enabled


LOOPS = Kind(
    name="loops",
    title="Gains and limits of a motor's loop are read back as written",
    rules=(
        "dc-pid-parameters",
        "dc-pid-ranges",
        "dc-pid-filter-bits",
        "position-loop-parameters",
        "position-loop-ranges",
        "motor-output-parameters",
        "motor-output-ranges",
        "motor-bias-range",
        "current-loop-parameters",
        "current-loop-ranges",
        "settled-current-loop-parameters",
        "settled-current-loop-ranges",
    ),
)


def _loops(declared: Declaration, allowed: Permissions) -> Iterator[Case]:
    for placed in placed_sets(declared):
        care = CARE.get(placed.set.name)
        if care is None or care.when is not When.DISABLED:
            continue
        if placed.place.messages >= ENABLED_SETS:
            yield replace(
                placed.case(),
                words={"fields": ", ".join(care.fields)},
                needs=declared.needs((placed.set.set, *ENABLED_SETS), placed.place) & HAZARDS,
                skip=placed.set.skip or unseen(placed.place),
                lacks=lacks_range(declared, allowed, (placed.place, placed.channel or 1)),
            )


@LOOPS.check(
    "{placed.set.set} is read back while the channel is disabled, at {placed.text}",
    seconds=0.8,
    needs={Need.TUNING, Need.MOTION},
    does="disables each channel, slightly reduces {fields} of {placed.set.set}, restores them, and "
    "enables the channel again",
    each=_loops,
)
def _look_at_loops(trial: Trial, placed: PlacedSet) -> None:
    care = CARE[placed.set.name]
    assert placed.channel is not None  # every loop belongs to a channel
    Axis(trial, placed.place, placed.channel).inside()
    switch(trial, placed.place, placed.channel, EnableState.DISABLE)
    before = placed.read(trial)
    neighbours = Neighbours.of(trial, placed)
    placed.undo(trial, before)
    write_and_read(trial, placed, care, before, neighbours)


def _rule_of_bit(message: str) -> str:
    """Return the rule about the bit of an enabled channel in a status."""
    return "piezo-status-bits-meaning" if message.startswith("PZ_") else "dc-status-bit-enabled"
