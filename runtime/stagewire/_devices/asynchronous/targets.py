"""Targets of motions: checks before a motion is sent, and whether it ended on its target.

Targets are compared with the limits of the stage. The documents state no tolerance for the final position.
The default is a choice of this library: servos report the end of a move when their trajectory ends, some tens
of counts before the target, and steppers report the commanded counts. Both deviate by far less than 0.01 mm.
A rotary stage has fewer counts: 0.1 degrees are 68 of the coarsest servo. A stage that hits a limit switch
deviates by far more.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from fractions import Fraction
from math import floor
from typing import Any, Final

from stagewire._codec.flags import Flags
from stagewire._devices.asynchronous.calls import (
    check_limits,
    look,
    moves,
    query,
    refuse_left,
    reports_motion,
)
from stagewire._devices.asynchronous.transport import Endpoint
from stagewire._devices.endpoint import Deadline
from stagewire._devices.limits import position_scale
from stagewire._devices.tables import Action, MotionEnd, Stored
from stagewire._devices.travel import MEASURES, POSITION
from stagewire._devices.values import Bits, BitsByUnit, InUnits, Values
from stagewire.errors import (
    LimitError,
    MotionUnderWayError,
    ReplyTimeoutError,
    TargetNotReachedError,
)
from stagewire.quantities import Scale

TOLERANCES: Final = {"mm": Fraction(1, 100), "deg": Fraction(1, 10)}
"""Unit -> how far from its target a motion may end, if the scale of the position is known."""
TOLERANCE_MM: Final = TOLERANCES["mm"]  # name of 0.1, for one release
TOLERANCE_COUNTS: Final = 500
"""The same if the scale is unknown: 0.015 mm on the stages with the finest encoders in the document."""
HOMED: Final = "homed"
"""Name of the status bit of a stage that is homed."""
_PAUSE: Final = 0.1
"""Seconds between two status requests while the stage still moves."""


async def targets_of(
    endpoint: Endpoint, what: str, action: Action, fields: Mapping[str, Any], deadline: Deadline
) -> tuple[int, ...]:
    """Return the expected final positions of a motion in counts; empty if it has no target or it is unknown.

    A target that is stored in the controller is read. For a distance, the position is read. If neither the
    message nor the stored value gives a direction, there is a target in each direction.

    Raise :class:`~stagewire.errors.LimitError` for a value that exceeds the limits of the stage: a target
    outside the travel, if its ends are known (of two targets, only if both are outside), or a target further
    away than the travel is long, if only its length is known.
    """
    check_limits(endpoint, what, action.given, fields)  # sends nothing
    if action.target is None:
        return ()
    if action.stored is None:
        [entry] = [entry for entry in action.given if entry.target is not None]
        counts = fields[entry.field]
    else:
        stored = await _stored(endpoint, what, action.stored, deadline)
        if stored is None:
            return ()
        counts = stored
        _check_stored(endpoint, what, action, counts)
    if action.target == "absolute":
        await _check_target(endpoint, what, counts, deadline)
        return (counts,)
    status = await _status(endpoint, what, deadline)
    here = position_in(status)
    if here is None:
        return ()
    directed = action.stored is None or _goes_as_stored(endpoint, action)
    ways = (counts,) if directed or not counts else (counts, -counts)
    _check_ways(endpoint, what, here, ways)
    targets = tuple(here + way for way in ways)
    limits = endpoint.connection.limits(endpoint.place)
    limits.check_held(
        what, targets, endpoint.scales(), homed=any(HOMED in bits.names for bits in bits_in(status))
    )
    return targets


def position_in(values: Values[Any] | None) -> int | None:
    """Return the position that a controller reported, in counts; None if it reported none."""
    if values is None:
        return None
    sent = values.message.layout.fields  # a shorter form has not all fields
    for value in vars(type(values)).values():
        if isinstance(value, InUnits) and value.quantity == POSITION and value.field in sent:
            counts: int = getattr(values.message, value.field)
            return counts
    return None


def bits_in(values: Values[Any] | None) -> Iterator[Flags]:
    """Yield the values that have named bits, of those that a controller sent."""
    if values is None:
        return
    sent = values.message.layout.fields
    for name, value in vars(type(values)).items():
        if isinstance(value, Bits | BitsByUnit) and value.field in sent:
            yield getattr(values, name)


async def _stored(endpoint: Endpoint, what: str, stored: Stored, deadline: Deadline) -> int | None:
    """Read a stored target; None if it cannot be read or is not in use."""
    table = stored.table
    if table.req is None or table.req.layout.message not in endpoint.connection.unit.messages:
        return None
    await refuse_second(endpoint, what, deadline)
    message = (await query(endpoint, table, endpoint.part_of(deadline), {})).message
    if stored.when is not None:
        field, value = stored.when
        if getattr(message, field) != value:
            return None
    counts: int = getattr(message, stored.field)
    return counts


async def _status(endpoint: Endpoint, what: str, deadline: Deadline) -> Values[Any] | None:
    """Request the status with the position; None for a unit that cannot report it."""
    status = endpoint.connection.unit.status_query
    if status is None:
        return None
    await refuse_second(endpoint, what, deadline)
    values: Values[Any] = await look(endpoint, status, endpoint.part_of(deadline))
    return values


async def refuse_second(endpoint: Endpoint, what: str, deadline: Deadline) -> None:
    """Raise an error for a motion that would be refused, before anything is requested for it."""
    await refuse_left(endpoint, what, deadline.left)
    running = endpoint.connection.motions.at(endpoint.place)
    if running is not None and running.exchange is not None:
        advice = (
            "stop it, wait for its end, or wait until is_moving() returns False"
            if reports_motion(endpoint.connection.unit)
            else "stop it, or wait for its end"
        )
        raise MotionUnderWayError(
            f"{what} was not sent: {running.what} is or may be under way; {advice}"
        )


def _check_stored(endpoint: Endpoint, what: str, action: Action, counts: int) -> None:
    travel = endpoint.connection.limits(endpoint.place).travel
    if travel is not None:
        assert action.stored is not None
        check = travel.check_place if action.target == "absolute" else travel.check_distance
        check(f"{what}: stored {action.stored.field}", counts, _known_scale(endpoint))


async def _check_target(endpoint: Endpoint, what: str, counts: int, deadline: Deadline) -> None:
    """Compare an absolute target with the limits of the controller, and with the length of the travel.

    The status is requested if only the length is known, or if the limits apply only after homing.
    """
    limits, scales = endpoint.connection.limits(endpoint.place), endpoint.scales()
    limits.check_held(what, (counts,), scales)
    travel = limits.travel if limits.travel is not None and limits.travel.low is None else None
    if travel is None and not limits.depend_on_homing:
        return
    status = await _status(endpoint, what, deadline)
    here = position_in(status)
    if travel is not None and here is not None:
        travel.check_way(what, here, counts, _known_scale(endpoint))
    limits.check_held(
        what, (counts,), scales, homed=any(HOMED in bits.names for bits in bits_in(status))
    )


def _check_ways(endpoint: Endpoint, what: str, here: int, ways: tuple[int, ...]) -> None:
    travel = endpoint.connection.limits(endpoint.place).travel
    if travel is None:
        return
    scale = _known_scale(endpoint)
    if not any(travel.holds(here + way, scale) for way in ways):
        way = " or ".join(f"{travel.number(way, scale):+.10g}" for way in ways)
        raise LimitError(
            f"{what}: {way} {travel.unit} from the position {travel.shown(here, scale)} is outside the "
            f"travel, {travel}; nothing was sent"
        )


def _known_scale(endpoint: Endpoint) -> Scale:
    """Return the scale of the position, which is known if there is a travel."""
    scale = _scale(endpoint)
    assert scale is not None
    return scale


def _goes_as_stored(endpoint: Endpoint, action: Action) -> bool:
    """Return whether a motion uses the sign of the stored distance.

    This is the case if another form of the message carries the distance itself. A jog step, or a step for
    separate commands each way, has no direction; the message gives it.
    """
    name = action.message.layout.message
    messages = endpoint.connection.facts.protocol.messages
    forms = [cls for cls in messages if cls.layout.message == name]
    return len(forms) > 1


async def checked(
    endpoint: Endpoint, what: str, targets: tuple[int, ...], end: MotionEnd[Any], deadline: Deadline
) -> MotionEnd[Any]:
    """Return how a motion ended, if it ended on one of its targets.

    The status is requested if the end message has no position. It is requested again if the position is off
    the target while the status bits show motion, until they show rest or the deadline has passed.

    Raise :class:`~stagewire.errors.TargetNotReachedError`, and :class:`~stagewire.errors.ReplyTimeoutError`
    if a status request is not answered.
    """
    said, asked = end.values, False
    tolerance = _tolerance(endpoint)
    status = endpoint.connection.unit.status_query
    while True:
        position = position_in(said)
        if position is not None and abs(_miss(targets, position)) <= tolerance:
            return MotionEnd(end.message, said, end.seconds)
        done = position is not None and (
            not _shows_motion(endpoint, said) or (asked and deadline.over)
        )
        if done or status is None:
            break
        if asked:
            await endpoint.transport.pause(_PAUSE)
        try:
            said, asked = await look(endpoint, status, endpoint.seconds(None)), True
        except ReplyTimeoutError as error:
            raise ReplyTimeoutError(
                f"{what} has ended, but its final position is unknown: {error}"
            ) from None
    if position is None:
        return end  # the unit cannot report its position
    raise _missed(
        endpoint, what, targets, position, tolerance, MotionEnd(end.message, said, end.seconds)
    )


def _miss(targets: tuple[int, ...], position: int) -> int:
    """Return the signed distance from a position to the nearest target."""
    return min((target - position for target in targets), key=abs)


def _shows_motion(endpoint: Endpoint, values: Values[Any] | None) -> bool:
    moving = None if values is None else endpoint.connection.unit.moving.get(type(values.message))
    return moving is not None and moves(values.message, moving)  # type: ignore[union-attr]


def _tolerance(endpoint: Endpoint) -> int:
    """Return the tolerance in counts."""
    choices, scale = endpoint.connection.choices, _scale(endpoint)
    if choices.target_tolerance_counts is not None:
        return choices.target_tolerance_counts
    if scale is None or scale.unit not in MEASURES:
        return TOLERANCE_COUNTS
    base, factor = MEASURES[scale.unit]
    tolerance = choices.target_tolerances.get(base, TOLERANCES[base])
    return floor(abs(scale.counts_per_unit) * tolerance * factor)


def _scale(endpoint: Endpoint) -> Scale | None:
    return position_scale(endpoint.scales())


def _missed(
    endpoint: Endpoint,
    what: str,
    targets: tuple[int, ...],
    position: int,
    tolerance: int,
    end: MotionEnd[Any],
) -> TargetNotReachedError:
    target, scale = position + _miss(targets, position), _scale(endpoint)

    def shown(counts: int) -> str:
        if scale is None:
            return f"{counts} counts"
        return f"{float(scale.from_counts(counts)):.6g} {scale.unit}"

    states = (
        [] if end.values is None else list(endpoint.connection.unit.hindered(end.values.message))
    )
    why = [state.cause for state in states]
    if _shows_motion(endpoint, end.values):
        why.append("its status still shows motion")
    text = (
        f"{what} ended at {shown(position)}, {shown(abs(target - position))} from its target, "
        f"{shown(target)} (tolerance {shown(tolerance)})"
    )
    return TargetNotReachedError(
        f"{text}: {'; '.join(why)}" if why else text,
        target=target,
        position=position,
        tolerance=tolerance,
        unit="" if scale is None else scale.unit,
        target_in_units=None if scale is None else float(scale.from_counts(target)),
        position_in_units=None if scale is None else float(scale.from_counts(position)),
        limits=tuple(state.name for state in states if state.limit),
        end=end,
    )
