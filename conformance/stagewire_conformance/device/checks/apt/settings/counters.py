"""``counters``: the position counter and the encoder counter can be set, and nothing moves by it.

They live: a servo may hold its stage a few counts beside what was set. So what a
counter says may differ by less than can be mistaken for what it said before.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Final

from stagewire.errors import StagewireError
from stagewire_conformance.device.check import Case, Kind
from stagewire_conformance.device.checks.apt.settings.sets import PlacedSet, Values, placed_sets
from stagewire_conformance.device.permissions import Need

if TYPE_CHECKING:
    from stagewire_conformance.device.declaration import Declaration
    from stagewire_conformance.device.permissions import Permissions
    from stagewire_conformance.device.trial import Trial


_COUNTERS: Final = {"MOT_POSCOUNTER": "position", "MOT_ENCCOUNTER": "encoder_count"}
"""Parameter set -> its value."""

_SHIFT: Final = (1000, 5000)
"""By how many counts a counter is changed at first."""

_WIDE: Final = (0x1_0000, 0x1_FFFF)
"""By how many it is changed then: more than two bytes hold, so that its width is seen, too."""

_NOISE: Final = 64
"""Counts by which a stage that is held may be seen beside where it is."""


KIND = Kind(
    name="counters",
    title="Counters can be set, and count on from there",
    rules=(
        "position-counter-set",
        "position-counter-signed",
        "encoder-counter-set",
        "encoder-counter-signed",
        "status-position",
        "dc-status-position",
        "command-without-acknowledgement",
    ),
)


def _counters(declared: Declaration, allowed: Permissions) -> Iterator[Case]:
    for placed in placed_sets(declared):
        if field := _COUNTERS.get(placed.set.name):
            yield replace(placed.case(field=field), words={"counter": field.replace("_", " ")})


@KIND.check(
    "{placed.set.set} sets the counter at {placed.text}, and {placed.set.req} tells it",
    needs={Need.SETTINGS},
    does="lets the {counter} count from elsewhere for a moment, and puts it back; nothing moves",
    each=_counters,
)
def _run(trial: Trial, placed: PlacedSet, field: str) -> None:
    before: int = placed.read(trial)[field]
    trial.undo(
        f"{placed.set.set} at {placed.text}", lambda: _put_back(trial, placed, field, before)
    )
    shift, wide = trial.random.randint(*_SHIFT), trial.random.randint(*_WIDE)
    for value in (before + shift, before - wide, before + wide):
        if not -(2**31) <= value < 2**31:
            continue
        came = placed.write_and_ask(trial, {field: value})
        told = placed.values(came)[field]
        if not trial.must(
            abs(told - value) <= _NOISE,
            f"{placed.text}: {placed.set.set} wrote {field} = {value}, and {placed.set.get} then said {told} "
            f"(before it was {before})",
            wanted=placed.expected(trial, {field: value}, came),
            came=came.raw,
        ):
            return  # whatever the controller makes of it, no more of that
        if field == "position":
            _see_in_status(trial, placed, value)


def _see_in_status(trial: Trial, placed: PlacedSet, value: int) -> None:
    """See that the status message counts as the counter does."""
    query = placed.place.unit.status_query
    if query is None or query.req is None or query.req.layout.message not in placed.place.messages:
        return
    request = trial.declared.make(query.req.layout.message, placed.channel)
    came = trial.reply(request, placed.place.address)
    position: int = came.message.position
    trial.must(
        abs(position - value) <= _NOISE,
        f"{placed.text}: {placed.set.set} wrote position = {value}, and {came.name} then said {position}",
        came=came.raw,
    )


def _put_back(trial: Trial, placed: PlacedSet, field: str, before: int) -> None:
    values: Values = {field: before}
    line, declared, address = trial.line, trial.declared, placed.place.address
    line.send(declared.make(placed.set.set, placed.channel, **values), address)
    came = line.ask(declared.make(placed.set.req, placed.channel), address)
    if came is None or abs(placed.values(came)[field] - before) > _NOISE:
        says = "nothing" if came is None else came.text
        raise StagewireError(
            f"{placed.text}: write {placed.set.set} {field}={before} (it says: {says})"
        )
