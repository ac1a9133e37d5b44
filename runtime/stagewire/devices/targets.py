"""Compare a motion with the limits of its stage before it is sent."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from fractions import Fraction
from typing import Any

from stagewire.devices.calls import ask, check_limits
from stagewire.devices.limits import POSITION, in_mm, mm_of
from stagewire.devices.line import Deadline
from stagewire.devices.spot import Spot
from stagewire.devices.tables import Action
from stagewire.devices.values import InUnits, Values
from stagewire.errors import LimitError

__all__ = ["check_target"]


async def check_target(
    spot: Spot, what: str, action: Action, fields: Mapping[str, Any], deadline: Deadline
) -> None:
    """Raise :class:`~stagewire.errors.LimitError` for values that exceed the limits of the stage.

    Where the controller stores the target, it is asked for it. The position is asked for where it decides:
    with a distance, and with a target where only the length of the travel is known. If neither the message
    nor what is stored gives the direction of a distance, it is refused only if it fits in neither.
    """
    check_limits(spot, what, action.given, fields)  # asks nothing
    travel = spot.connection.limits(spot.place).travel
    if travel is None or action.target is None:
        return
    place: Fraction | None = None
    distances: set[Fraction] = set()
    if action.stored is not None:
        table, field = action.stored
        if table.req is None or table.req.layout.message not in spot.connection.unit.messages:
            return  # what is stored there cannot be read
        distance = _in_mm(
            await ask(spot, table, spot.part_of(deadline), {}), lambda value: value.field == field
        )
        assert distance is not None  # a target is in units
        if action.target == "absolute":
            travel.check_place(f"{what}: {field}, as it is stored", distance)
            place = distance
        else:
            travel.check_distance(f"{what}: {field}, as it is stored", distance)
            distances = {distance} if _goes_as_stored(spot, action) else {distance, -distance}
    else:
        [entry] = [entry for entry in action.given if entry.target is not None]
        given = mm_of(entry, fields[entry.field], spot.scales())
        if action.target == "absolute":
            place = given
        else:
            distances = {given}
    status = spot.connection.unit.status_query
    if status is None or (travel.low is None) == (place is None):
        return  # what can be checked has been checked
    here = _in_mm(
        await ask(spot, status, spot.part_of(deadline), {}),
        lambda value: value.quantity == POSITION,
    )
    if here is None:
        return
    if place is not None:
        travel.check_way(what, here, place)
    elif all(here + distance not in travel for distance in distances):
        way = " or ".join(f"{float(distance):+.10g}" for distance in distances)
        raise LimitError(
            f"{what}: from {float(here):.10g} mm {way} mm is outside the travel, {travel}; nothing was sent"
        )


def _goes_as_stored(spot: Spot, action: Action) -> bool:
    """Say whether a motion is by the stored distance, sign and all: a message that could carry it does so.

    A step that is stored for jogs, or for a command each way, is taken in a direction of the message's own.
    """
    id = action.message.layout.id
    forms = [cls for cls in spot.connection.facts.protocol.messages if cls.layout.id == id]
    return len(forms) > 1


def _in_mm(values: Values[Any], wanted: Callable[[InUnits], bool]) -> Fraction | None:
    """Return the value that is wanted, if there is one."""
    for value in vars(type(values)).values():
        if isinstance(value, InUnits) and wanted(value):
            return in_mm(value.exact(values), value.unit)
    return None
