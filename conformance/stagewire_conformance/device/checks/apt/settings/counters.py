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
from stagewire_conformance.device.checks.apt.settings.sets import Spot, Values, spots
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
    for spot in spots(declared):
        if field := _COUNTERS.get(spot.set.name):
            yield replace(spot.case(field=field), words={"counter": field.replace("_", " ")})


@KIND.check(
    "{spot.set.set} sets the counter at {spot.text}, and {spot.set.req} tells it",
    needs={Need.SETTINGS},
    does="lets the {counter} count from elsewhere for a moment, and puts it back; nothing moves",
    each=_counters,
)
def _run(trial: Trial, spot: Spot, field: str) -> None:
    before: int = spot.read(trial)[field]
    trial.undo(f"{spot.set.set} at {spot.text}", lambda: _put_back(trial, spot, field, before))
    shift, wide = trial.random.randint(*_SHIFT), trial.random.randint(*_WIDE)
    for value in (before + shift, before - wide, before + wide):
        if not -(2**31) <= value < 2**31:
            continue
        came = spot.write_and_ask(trial, {field: value})
        told = spot.values(came)[field]
        if not trial.must(
            abs(told - value) <= _NOISE,
            f"{spot.text}: {spot.set.set} wrote {field} = {value}, and {spot.set.get} then said {told} "
            f"(before it was {before})",
            wanted=spot.expected(trial, {field: value}, came),
            came=came.raw,
        ):
            return  # whatever the controller makes of it, no more of that
        if field == "position":
            _see_in_status(trial, spot, value)


def _see_in_status(trial: Trial, spot: Spot, value: int) -> None:
    """See that the status message counts as the counter does."""
    query = spot.place.unit.status_query
    if query is None or query.req is None or query.req.layout.message not in spot.place.messages:
        return
    request = trial.declared.make(query.req.layout.message, spot.channel)
    came = trial.reply(request, spot.place.address)
    position: int = came.message.position
    trial.must(
        abs(position - value) <= _NOISE,
        f"{spot.text}: {spot.set.set} wrote position = {value}, and {came.name} then said {position}",
        came=came.raw,
    )


def _put_back(trial: Trial, spot: Spot, field: str, before: int) -> None:
    values: Values = {field: before}
    line, declared, address = trial.line, trial.declared, spot.place.address
    line.send(declared.make(spot.set.set, spot.channel, **values), address)
    came = line.ask(declared.make(spot.set.req, spot.channel), address)
    if came is None or abs(spot.values(came)[field] - before) > _NOISE:
        says = "nothing" if came is None else came.text
        raise StagewireError(
            f"{spot.text}: write {spot.set.set} {field}={before} (it says: {says})"
        )
