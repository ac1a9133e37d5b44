"""``connectors``: the settings of each connector are its own (Issue 37, pages 161 to 164).

Some requests also select a connector or a port. Each of them is read; then the settings of one after the
other are written, with a change if that is harmless, and all others must stay the same.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Final

from stagewire_conformance.device.causes import SHARED, Cause
from stagewire_conformance.device.check import Case, Kind
from stagewire_conformance.device.checks.apt import later_rules
from stagewire_conformance.device.checks.apt.broken_rules import rule_of_set
from stagewire_conformance.device.checks.apt.settings.care import CARE, Care
from stagewire_conformance.device.checks.apt.settings.sets import PlacedSet, Values, placed_sets
from stagewire_conformance.device.checks.apt.settings.variants import first_variant

if TYPE_CHECKING:
    from stagewire_conformance.device.declaration import Declaration
    from stagewire_conformance.device.permissions import Permissions
    from stagewire_conformance.device.trial import Trial

_UNREAD: Final = "reads only the values of one"
"""Why a set with a chooser is not read back like the others."""

KIND = Kind(
    name="connectors",
    title="Each connector has its own settings",
    rules=later_rules.OF_CONNECTORS,
)


def _sets(declared: Declaration, allowed: Permissions) -> Iterator[Case]:
    for placed in placed_sets(declared):
        one = placed.set
        if one.chooser:
            yield Case(
                name=placed.name,
                arguments={"placed": placed},
                messages=one.messages,
                needs=one.needs,
                skip="" if _UNREAD in one.skip else one.skip,
            )


def _connectors(trial: Trial, placed: PlacedSet) -> list[int]:
    """Return the connectors that the unit has: a bit of a mask, or a documented value."""
    fields = trial.declared.registry.fields(placed.set.req, "header")
    facts = fields[placed.set.chooser]
    bits = facts.get("flags", {})
    return sorted(bits.values() if bits else facts["enum"].values())


def _read(trial: Trial, placed: PlacedSet, connector: int) -> Values | None:
    """Return the settings of a connector; None if the unit does not have it."""
    one = placed.set
    request = trial.declared.make(one.req, placed.channel, **{one.chooser: connector})
    came = trial.line.ask(request, placed.place.address)
    if came is not None:
        return placed.values(came)
    for heard in trial.line.listen(0):
        if heard.name == one.get:
            trial.need(
                False,
                f"{placed.text}: {one.req} asked for {one.chooser} {connector}, but {one.get} is about "
                f"{placed.values(heard)[one.chooser]}",
                came=heard.raw,
                rule=rule_of_set(one.set),
                cause=Cause(one.get, one.chooser),
            )
    return None


@KIND.check(
    "{placed.set.set} sets each connector on its own, at {placed.text}",
    does="writes the settings of each connector, with another source for an input, and restores them",
    seconds=0.3,
    each=_sets,
)
def _run(trial: Trial, placed: PlacedSet) -> None:
    one, care = placed.set, CARE.get(placed.set.name, Care())
    now: dict[int, Values] = {}
    for connector in _connectors(trial, placed):
        values = _read(trial, placed, connector)
        if values is not None:
            now[connector] = values
    trial.need(
        bool(now),
        f"{placed.text}: {one.req} was answered for no {one.chooser}",
        rule="request-answered",
    )
    for connector, before in now.items():
        trial.undo(
            f"{one.set} of {one.chooser} {connector} at {placed.text}",
            lambda before=before: placed.write(trial, before),  # type: ignore[misc]
        )
        harmless = all(before[name] in allowed for name, allowed in care.only_if.items())
        others = [values for other, values in now.items() if other != connector]
        changed = first_variant(one, care, before, trial.random, others) if harmless else None
        wanted = {**before, **dict([changed] if changed else ())}
        placed.write(trial, wanted)
        now[connector] = wanted
        for other, values in now.items():
            _judge(trial, placed, (connector, other), values)


def _judge(trial: Trial, placed: PlacedSet, places: tuple[int, int], wanted: Values) -> None:
    """Require the settings of a connector after a SET of the same or of another one."""
    written, read = places
    told = _read(trial, placed, read)
    one = placed.set
    trial.must(
        told == wanted,
        f"{placed.text}: after {one.set} of {one.chooser} {written}, {one.get} of {one.chooser} {read} "
        f"returned {told}, expected {wanted}",
        rule=rule_of_set(one.set),
        cause=Cause(one.set, SHARED),
    )
