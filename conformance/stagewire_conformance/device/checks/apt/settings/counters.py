"""``counters``: the position counter and the encoder counter can be set, without motion.

A counter is live: a servo holds its stage only to within a few counts. So the checks allow a small
difference, but write values that differ more from the previous ones.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Final

from stagewire.errors import StagewireError
from stagewire_conformance.device.causes import EFFECT, SHARED, Cause
from stagewire_conformance.device.check import Case, Kind
from stagewire_conformance.device.checks.apt.broken_rules import rule_of_set, rule_of_status
from stagewire_conformance.device.checks.apt.settings.sets import PlacedSet, Values, placed_sets
from stagewire_conformance.device.checks.apt.streams import LATE, stream_of
from stagewire_conformance.device.lines.motions import STATUS_BITS, reports_motion
from stagewire_conformance.device.permissions import Need

if TYPE_CHECKING:
    from stagewire_conformance.device.declaration import Declaration
    from stagewire_conformance.device.lines.dialogue import Incoming
    from stagewire_conformance.device.permissions import Permissions
    from stagewire_conformance.device.trial import Trial


_COUNTERS: Final = {"MOT_POSCOUNTER": "position", "MOT_ENCCOUNTER": "encoder_count"}
"""Parameter set -> its value."""

_SHIFT: Final = (1000, 5000)
"""Counts of the first change."""

_WIDE: Final = (0x1_0000, 0x1_FFFF)
"""Counts of the other changes: more than two bytes can hold, which also tests the width of the counter."""

_NOISE: Final = 64
"""Counts by which the position of a stage that is held may vary."""

_POSITION: Final = "MOT_REQ_POSCOUNTER"
"""The request for the position counter."""

_UPDATE: Final = 0.5
"""Seconds within which a status update arrives."""

_WATCHED: Final = 0.15
"""Seconds after which a motion that the command has started can be seen."""


KIND = Kind(
    name="counters",
    title="Counters can be set, and continue from the new value",
    rules=(
        "position-counter-set",
        "position-counter-signed",
        "encoder-counter-set",
        "encoder-counter-signed",
        "status-position",
        "dc-status-position",
        "status-updates-position",
        "command-without-acknowledgement",
        "slot-addressed-by-destination",
        "module-channels",
    ),
)


def _counters(declared: Declaration, allowed: Permissions) -> Iterator[Case]:
    for placed in placed_sets(declared):
        if field := _COUNTERS.get(placed.set.name):
            stream = stream_of(declared, placed.place) if field == "position" else None
            also = () if stream is None or stream.skip else stream.messages
            yield replace(
                placed.case(field=field),
                messages=(*placed.set.messages, *also),
                words={"counter": field.replace("_", " ")},
            )


@KIND.check(
    "{placed.set.set} sets the counter at {placed.text}, and {placed.set.req} returns it",
    needs={Need.SETTINGS},
    does="sets the {counter} to other values for a moment, and restores it; nothing moves",
    each=_counters,
)
def _run(trial: Trial, placed: PlacedSet, field: str) -> None:
    before: int = placed.read(trial)[field]
    get = Cause(placed.set.get, field)
    trial.undo(
        f"{placed.set.set} at {placed.text}",
        lambda: _put_back(trial, placed, field, before),
        because=lambda: (get, *placed.reported(trial)),
    )
    still = not _is_moving(trial, placed)
    others = [
        (other, other.read(trial)[field])
        for other in placed_sets(trial.declared)
        if other.set.name == placed.set.name and other != placed and not other.set.skip
    ]
    position = _position(trial, placed) if field != "position" else None
    shift, wide = trial.random.randint(*_SHIFT), trial.random.randint(*_WIDE)
    for value in (before + shift, before - wide, before + wide):
        if not -(2**31) <= value < 2**31:
            continue
        came = placed.write_and_ask(trial, {field: value})
        told = placed.values(came)[field]
        right = abs(told - value) <= _NOISE
        is_set = not right and field == "position" and _is_in_status(trial, placed, value)
        if not trial.must(
            right,
            f"{placed.text}: {placed.set.set} wrote {field} = {value}, but {placed.set.get} "
            f"then returned {told} (before: {before})",
            wanted=placed.expected(trial, {field: value}, came),
            came=came.raw,
            rule=rule_of_set(placed.set.set),
            cause=get if is_set else Cause(placed.set.set, EFFECT),
            because=(Cause(placed.set.set, SHARED),),
        ):
            if field == "position" and not is_set and _is_scaled(trial, placed, value, told):
                # It is not known where the motor is.
                trial.causes.report(Cause(_status_name(trial, placed), "position"), trial.check)
            return  # more attempts would not help
        _judge_others(trial, placed, field, value, others)
        if field == "position":
            _see_in_status(trial, placed, value)
            if value == before + shift:
                if still and not _stays(trial, placed, value):
                    return
                _see_in_update(trial, placed, value)
        elif position is not None:
            _judge_alone(trial, placed, position, value)


def _is_scaled(trial: Trial, placed: PlacedSet, value: int, told: int) -> bool:
    """Return whether the counter returns a multiple of what is written."""
    other = value + _SHIFT[0]
    again: int = placed.values(placed.write_and_ask(trial, {"position": other}))["position"]
    is_same = abs(again * value - told * other) <= _NOISE * abs(value)
    return is_same and abs(again - told) > _NOISE


def _status_name(trial: Trial, placed: PlacedSet) -> str:
    """Return the name of the status message; empty if the target has none that can be requested."""
    came = _status(trial, placed)
    return "" if came is None else came.name


def _judge_others(
    trial: Trial, placed: PlacedSet, field: str, value: int, others: Sequence[tuple[PlacedSet, int]]
) -> None:
    """Report counters of other bays or channels that have also changed.

    :param others: the other counters with their previous values.
    """
    for other, was in others:
        came = other.ask(trial)
        told = other.values(came)[field]
        if not trial.must(
            abs(told - was) <= _NOISE,
            f"{placed.set.set} wrote {field} = {value} to {placed.text}, but {other.set.get} of {other.text} "
            f"then returned {told} instead of {was}; it should be unchanged",
            came=came.raw,
            rule="slot-addressed-by-destination"
            if other.place != placed.place
            else "module-channels",
            cause=Cause(placed.set.set, SHARED),
            because=other.reported(trial),
        ):  # the counters of the others may also be the ones that are wrong
            trial.causes.report(Cause(placed.set.get, field), trial.check)


def _status(trial: Trial, placed: PlacedSet) -> Incoming | None:
    """Return the status; None if the target has none that can be requested."""
    query = placed.place.unit.status_query
    if query is None or query.req is None or query.req.layout.message not in placed.place.messages:
        return None
    request = trial.declared.make(query.req.layout.message, placed.channel)
    return trial.reply(request, placed.place.address)


def _see_in_update(trial: Trial, placed: PlacedSet, value: int) -> None:
    """Check that a status update has the same count as the counter."""
    stream = stream_of(trial.declared, placed.place)
    if stream is None or stream.skip:
        return
    stream.begin(trial)
    came = trial.line.listen(
        _UPDATE, until=lambda heard: bool(stream.by_channel([heard]).get(placed.channel or 1))
    )
    stream.end(trial)
    updates = stream.by_channel(came).get(placed.channel or 1, [])
    trial.line.listen(LATE if updates else 0)  # one more may be on its way
    for update in updates[-1:]:
        position: int = update.message.position
        trial.must(
            abs(position - value) <= _NOISE,
            f"{placed.text}: {placed.set.set} wrote position = {value}, but {update.name} then had "
            f"{position} when it was sent periodically, unlike when it is requested",
            came=update.raw,
            rule="status-updates-position",
            cause=Cause(update.name, "periodic"),
            because=(Cause(update.name, "position"),),
        )


def _judge_alone(trial: Trial, placed: PlacedSet, before: int, value: int) -> None:
    """Report a position counter that follows the encoder counter.

    Both may be the same register, so this is NON-STRICT.
    """
    position = _position(trial, placed) or 0
    trial.should(
        abs(position - before) <= _NOISE,
        f"{placed.text}: {placed.set.set} wrote encoder_count = {value}, and the position counter went from "
        f"{before} to {position}; it has a message of its own",
        rule=rule_of_set(placed.set.set),
        cause=Cause(placed.set.set, "position counter"),
    )


def _is_in_status(trial: Trial, placed: PlacedSet, value: int) -> bool:
    """Return whether the status has a count that was written, so that only the GET is wrong."""
    came = _status(trial, placed)
    return came is not None and abs(came.message.position - value) <= _NOISE


def _see_in_status(trial: Trial, placed: PlacedSet, value: int) -> None:
    """Check that the status message has the same count as the counter."""
    came = _status(trial, placed)
    if came is None:
        return
    position: int = came.message.position
    trial.must(
        abs(position - value) <= _NOISE,
        f"{placed.text}: {placed.set.set} wrote position = {value}, but {came.name} then "
        f"returned {position}",
        came=came.raw,
        rule=rule_of_status(placed.place, "position"),
        cause=Cause(came.name, "position"),
    )


def _position(trial: Trial, placed: PlacedSet) -> int | None:
    """Return the position counter; None if the target does not claim it."""
    if _POSITION not in placed.place.messages:
        return None
    request = trial.declared.make(_POSITION, placed.channel)
    position: int = trial.reply(request, placed.place.address).message.position
    return position


def _is_moving(trial: Trial, placed: PlacedSet) -> bool:
    """Return whether the status reports a motion."""
    came = _status(trial, placed)
    if came is None:
        return False
    return reports_motion(STATUS_BITS[placed.place.status or ""](came.message.status_bits))


def _stays(trial: Trial, placed: PlacedSet, value: int) -> bool:
    """Report a motor that moves after its counter was set, and stop it; return whether it stays at rest."""
    trial.line.pause(_WATCHED)
    moving = _is_moving(trial, placed)
    came = placed.ask(trial)
    told = placed.values(came)["position"]
    stays = not moving and abs(told - value) <= _NOISE
    if not stays:
        trial.line.stop_channel(placed.place, placed.channel)
    return trial.must(
        stays,
        f"{placed.text}: after {placed.set.set} wrote position = {value}, the motor began to move, and was "
        f"stopped; it was at {told} after {_WATCHED} s. The command should only set the counter",
        came=came.raw,
        rule=rule_of_set(placed.set.set),
        cause=Cause(placed.set.set, EFFECT),
    )


def _put_back(trial: Trial, placed: PlacedSet, field: str, before: int) -> None:
    values: Values = {field: before}
    line, declared, address = trial.line, trial.declared, placed.place.address
    line.send(declared.make(placed.set.set, placed.channel, **values), address)
    # If the previous command started a motion, this one may also.
    if Cause(placed.set.set, EFFECT) in placed.reported(trial):
        line.stop_channel(placed.place, placed.channel)
    came = line.ask(declared.make(placed.set.req, placed.channel), address)
    if came is None or abs(placed.values(came)[field] - before) > _NOISE:
        says = "no reply" if came is None else came.text
        raise StagewireError(
            f"{placed.text}: send {placed.set.set} with {field}={before} (current state: {says})"
        )
