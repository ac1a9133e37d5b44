"""``channels`` and ``bays-apart``: a value that is set on one channel, or in one bay, does not affect others.

Each channel or bay in turn gets a different value; then all others must still have their own.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from typing import TYPE_CHECKING, Final

from stagewire_conformance.device.causes import SHARED, Cause
from stagewire_conformance.device.check import Case, Kind
from stagewire_conformance.device.checks.apt.broken_rules import rule_of_channel
from stagewire_conformance.device.checks.apt.settings.care import CARE, Care, When
from stagewire_conformance.device.checks.apt.settings.readback import ELSEWHERE
from stagewire_conformance.device.checks.apt.settings.sets import PlacedSet, Values, parameter_sets
from stagewire_conformance.device.checks.apt.settings.variants import first_variant, why_not_now

if TYPE_CHECKING:
    from stagewire_conformance.device.declaration import Declaration
    from stagewire_conformance.device.permissions import Permissions
    from stagewire_conformance.device.trial import Trial


CHANNELS = Kind(
    name="channels",
    title="Settings of one channel do not affect the other channels",
    rules=(
        "module-channels",
        "dual-channel-idents",
        "messages-for-any-channel",
        "piezo-dual-channel-idents",
        "piezo-messages-for-any-channel",
        "lut-channel",
        "low-pass-for-all-channels",
    ),
)
BAYS_APART = Kind(
    name="bays-apart",
    title="Settings of one bay do not affect the other bays",
    rules=("slot-addressed-by-destination", "slot-source", "bays-are-single-channel"),
)


def _channels(declared: Declaration, allowed: Permissions) -> Iterator[Case]:
    for place in declared.places:
        for one in parameter_sets(declared, place):
            if one.has_channel and len(place.channels) > 1:
                apart = [PlacedSet(place, channel, one) for channel in place.channels]
                yield from _apart(f"{place.name}/{one.set}", apart)


def _bays(declared: Declaration, allowed: Permissions) -> Iterator[Case]:
    by_name: dict[str, list[PlacedSet]] = {}
    for place in declared.places:
        if place.bay is not None:
            for one in parameter_sets(declared, place):
                channel = place.channels[0] if one.has_channel else None
                by_name.setdefault(one.name, []).append(PlacedSet(place, channel, one))
    for apart in by_name.values():
        if len(apart) > 1:
            yield from _apart(apart[0].set.set, apart)


def _apart(name: str, apart: Sequence[PlacedSet]) -> Iterator[Case]:
    one = apart[0].set
    care = CARE.get(one.name, Care())
    loops = care.when is When.DISABLED  # an enabled channel's loop would react
    own = any(not varied.common for varied in care.fields.values())
    if one.name in ELSEWHERE or one.chooser or not own or care.first_channel or loops:
        return
    yield Case(
        name=name,
        words={"set": one.set, "placed_sets": " and ".join(placed.text for placed in apart)},
        arguments={"apart": apart},
        messages=one.messages,
        needs=one.needs,
        skip=next((placed.set.skip for placed in apart if placed.set.skip), ""),
    )


_TITLE: Final = "{set} sets {placed_sets} independently"
_DOES: Final = (
    "changes a value with {set} in one channel or bay after the other, and restores the values"
)


@CHANNELS.check(_TITLE, does=_DOES, each=_channels)
@BAYS_APART.check(_TITLE, does=_DOES, each=_bays)
def _run(trial: Trial, apart: Sequence[PlacedSet]) -> None:
    care = CARE[apart[0].set.name]
    for placed in apart:
        trial.depends_on(*placed.reported(trial))
    now: list[tuple[PlacedSet, Values]] = []
    for placed in apart:
        before = placed.read(trial)
        now.append((placed, before))
        trial.undo(f"{placed.set.set} at {placed.text}", partial(placed.put_back, trial, before))
    changed = False
    for index, (placed, values) in enumerate(now):
        if why := why_not_now(trial, placed, care):
            trial.info(f"{placed.set.set} changed nothing at {placed.text}: {why}")
            continue
        elsewhere = [each for other, each in now if other is not placed]
        variant = first_variant(placed.set, care, values, trial.random, elsewhere)
        if variant is None:
            continue
        changed = True
        field, value = variant
        placed.write(trial, {**values, field: value})
        now[index] = placed, placed.read(trial)
        for other, theirs in now[:index] + now[index + 1 :]:
            after = f"{field} = {value} was written with {placed.set.set} to {placed.text}"
            _judge(trial, other, theirs, after)
    if not changed:
        trial.inconclusive("no value could be changed safely")


def _common(declared: Declaration, allowed: Permissions) -> Iterator[Case]:
    for place in declared.places:
        for one in parameter_sets(declared, place):
            care = CARE.get(one.name, Care())
            names = [name for name, varied in care.fields.items() if varied.common]
            if names and len(place.channels) > 1:
                first, last = (PlacedSet(place, place.channels[at], one) for at in (0, -1))
                yield Case(
                    name=f"{place.name}/{one.set}",
                    arguments={"first": first, "last": last, "field": names[0]},
                    messages=one.messages,
                    needs=one.needs,
                    skip=one.skip,
                )


@CHANNELS.check(
    "{field} of {first.set.set} applies to all channels of {first.place.name}",
    does="changes {field} with {first.set.set} in open loop, and restores it",
    each=_common,
)
def _run_common(trial: Trial, first: PlacedSet, last: PlacedSet, field: str) -> None:
    """Read on one channel the value that was written to another, which may not report it (page 119)."""
    care = CARE[first.set.name]
    why = why_not_now(trial, first, care) or why_not_now(trial, last, care)
    request = trial.declared.make(last.set.req, last.channel)
    theirs = trial.line.ask(request, last.place.address)
    if why or theirs is None:
        trial.inconclusive(f"{field} was not changed: {why or f'{last.text} reports no values'}")
        return
    before = last.values(theirs)
    last.undo(trial, before)
    value = next(
        each for each in care.fields[field].listed(last.set.fields[field]) if each != before[field]
    )
    last.write(trial, {**before, field: value})
    came = first.ask(trial)
    told = first.values(came)[field]
    trial.must(
        told == value,
        f"{last.set.set} wrote {field} = {value} to {last.text}, but {first.set.get} of "
        f"{first.text} then returned {told}; the value applies to all channels, whichever one "
        "the message names",
        came=came.raw,
        rule="low-pass-for-all-channels",
    )


def _judge(trial: Trial, other: PlacedSet, theirs: Values, after: str) -> None:
    came = other.ask(trial)
    says = other.values(came)
    changed = ", ".join(
        f"{name} = {value!r} instead of {theirs[name]!r}"
        for name, value in says.items()
        if value != theirs[name]
    )
    trial.must(
        not changed,
        f"after {after}, {other.set.get} of {other.text} returned {changed}; it should be "
        "unchanged",
        wanted=other.expected(trial, theirs, came),
        came=came.raw,
        rule="slot-addressed-by-destination"
        if BAYS_APART.name in trial.check
        else rule_of_channel(trial, other.set.get),
        cause=Cause(other.set.set, SHARED),
    )
