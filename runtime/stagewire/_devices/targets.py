"""Where a motion should end: found, and compared with the limits of the stage, before it is sent."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from typing import Any

from stagewire._devices.calls import ask, check_limits, look, refuse_left
from stagewire._devices.limits import POSITION, in_mm
from stagewire._devices.line import Deadline
from stagewire._devices.spot import Spot
from stagewire._devices.tables import Action, Stored
from stagewire._devices.values import InUnits, Values
from stagewire.errors import LimitError, MotionUnderWayError

__all__ = ["position_in", "targets_of"]


async def targets_of(
    spot: Spot, what: str, action: Action, fields: Mapping[str, Any], deadline: Deadline
) -> tuple[int, ...]:
    """Return where a motion may end, in counts; empty where it has no target, or where that is unknown.

    A target that the controller has stored is read. For a distance the position is read; where neither the
    message nor what is stored states the direction, there is a target either way.

    Raises :class:`~stagewire.errors.LimitError` for values that exceed the limits of the stage; for a target
    outside the travel, if that is known, of two ways only if both lead out of it; and for a target that is
    further than the travel from where the stage is, if only the length of the travel is known.
    """
    check_limits(spot, what, action.given, fields)  # asks nothing
    if action.target is None:
        return ()
    if action.stored is None:
        [entry] = [entry for entry in action.given if entry.target is not None]
        counts = fields[entry.field]
    else:
        stored = await _stored(spot, what, action.stored, deadline)
        if stored is None:
            return ()
        counts = stored
        _check_stored(spot, what, action, counts)
    if action.target == "absolute":
        await _check_way(spot, what, counts, deadline)
        return (counts,)
    here = await _position(spot, what, deadline)
    if here is None:
        return ()
    directed = action.stored is None or _goes_as_stored(spot, action)
    ways = (counts,) if directed or not counts else (counts, -counts)
    _check_ways(spot, what, here, ways)
    return tuple(here + way for way in ways)


def position_in(values: Values[Any] | None) -> int | None:
    """Return the position that a controller reported, in counts; None where it reported none."""
    for value in () if values is None else vars(type(values)).values():
        if isinstance(value, InUnits) and value.quantity == POSITION:
            counts: int = getattr(values.message, value.field)  # type: ignore[union-attr]
            return counts
    return None


async def _stored(spot: Spot, what: str, stored: Stored, deadline: Deadline) -> int | None:
    """Read what a controller has stored; None where it cannot be asked, or does not use it now."""
    table = stored.table
    if table.req is None or table.req.layout.message not in spot.connection.unit.messages:
        return None
    await _refuse_second(spot, what, deadline)
    message = (await ask(spot, table, spot.part_of(deadline), {})).message
    if stored.when is not None:
        field, value = stored.when
        if getattr(message, field) != value:
            return None
    counts: int = getattr(message, stored.field)
    return counts


async def _position(spot: Spot, what: str, deadline: Deadline) -> int | None:
    """Ask where it is; None for a unit that cannot be asked."""
    status = spot.connection.unit.status_query
    if status is None:
        return None
    await _refuse_second(spot, what, deadline)
    return position_in(await look(spot, status, spot.part_of(deadline)))


async def _refuse_second(spot: Spot, what: str, deadline: Deadline) -> None:
    """Raise before anything is asked for a motion that would be refused."""
    await refuse_left(spot, what, deadline.left)
    running = spot.connection.motions.at(spot.place)
    if running is not None and running.exchange is not None:
        raise MotionUnderWayError(
            f"{what} was not sent: {running.what} is under way, or may be; wait for its end, stop it, or let "
            "is_moving() see that nothing moves"
        )


def _check_stored(spot: Spot, what: str, action: Action, counts: int) -> None:
    travel = spot.connection.limits(spot.place).travel
    if travel is not None:
        assert action.stored is not None
        check = travel.check_place if action.target == "absolute" else travel.check_distance
        check(f"{what}: {action.stored.field}, as it is stored", _in_mm(spot, counts))


async def _check_way(spot: Spot, what: str, counts: int, deadline: Deadline) -> None:
    """Ask where the stage is, if only the length of its travel is known, and compare the way with that."""
    travel = spot.connection.limits(spot.place).travel
    if travel is None or travel.low is not None:
        return
    here = await _position(spot, what, deadline)
    if here is not None:
        travel.check_way(what, _in_mm(spot, here), _in_mm(spot, counts))


def _check_ways(spot: Spot, what: str, here: int, ways: tuple[int, ...]) -> None:
    travel = spot.connection.limits(spot.place).travel
    if travel is not None and all(_in_mm(spot, here + way) not in travel for way in ways):
        way = " or ".join(f"{float(_in_mm(spot, way)):+.10g}" for way in ways)
        raise LimitError(
            f"{what}: from {float(_in_mm(spot, here)):.10g} mm {way} mm is outside the travel, {travel}; "
            "nothing was sent"
        )


def _in_mm(spot: Spot, counts: int) -> Fraction:
    """Return a position in mm; its scale is known where there is a travel."""
    scales = spot.scales()
    unit = scales.unit_of(POSITION)
    return in_mm(scales.of(POSITION, unit).from_counts(counts), unit)


def _goes_as_stored(spot: Spot, action: Action) -> bool:
    """Say whether a motion is by the stored distance, sign and all: a message that could carry it does so.

    A step that is stored for jogs, or for a command each way, is taken in a direction of the message's own.
    """
    id = action.message.layout.id
    forms = [cls for cls in spot.connection.facts.protocol.messages if cls.layout.id == id]
    return len(forms) > 1
