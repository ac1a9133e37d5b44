"""The ends of the travel, and their status bits (section 14).

The table of section 14 has bit 6 for the upper switch and bit 7 for the lower one. Its example has the
reverse. The table is the definition.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from stagewire_conformance.device.causes import Cause
from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.ms2000.axis_check import AxisCase
from stagewire_conformance.device.checks.ms2000.motion.mover import (
    TARGET,
    Mover,
    lacks_of,
    motion_check,
)
from stagewire_conformance.device.declaration import Declaration
from stagewire_conformance.device.permissions import Permissions
from stagewire_conformance.device.targets import Target
from stagewire_ms2000.flags import StatusBits

KIND: Final = Kind(
    name="limits",
    title="An axis at an end of its travel reports which end",
    rules=("status-limit-bits",),
)


def _ends(declared: Declaration, allowed: Permissions) -> Iterator[AxisCase]:
    for place in declared.places:
        for name, upper in (("upper", True), ("lower", False)):
            yield AxisCase(
                place=place,
                name=name,
                words={"end": name},
                arguments={"upper": upper},
                skip=_undeclared(place),
                lacks=_lacks(declared, allowed, place, upper),
            )


def _undeclared(place: Target) -> str:
    connected = place.connected_to()
    if connected.travel is None:
        return f"the PICS declares no travel of axis {place.name}"
    if not connected.limit_switches:
        return f"the PICS declares no limit switches of axis {place.name}"
    return ""


def _lacks(declared: Declaration, allowed: Permissions, place: Target, upper: bool) -> str:
    """Return why the range does not include an end; empty if it does."""
    travel = place.travel_of()
    if travel is None or allowed.motion is None or lacks_of(declared, allowed, place):
        return ""
    low, high = declared.reach(place, None, allowed.motion)
    end = travel.high if upper else travel.low
    if end in (low, high):
        return ""
    return f"axis {place.name} goes to {end} counts; --allow-motion must include this position"


@motion_check(
    KIND,
    "{axis} reports that it is at its {end} end",
    messages=("READ_STATUS_BYTE",),
    seconds=10.0,
    each=_ends,
)
def _end(mover: Mover, upper: bool) -> None:
    mover.ready()
    trial = mover.trial
    begin = mover.status
    end = mover.high if upper else mover.low
    mover.go(end)
    status = mover.status
    which = "upper" if upper else "lower"
    own, other = (
        (status.upper_limit, status.lower_limit)
        if upper
        else (status.lower_limit, status.upper_limit)
    )
    told = f"axis {mover.name} is at its {which} end, and its status byte is {int(status):#04x}"
    byte = bytes((int(status),))
    if other and not own:
        trial.should(
            False,
            f"{told}, with the bit of the other end, as in the example and unlike the table",
            came=byte,
            rule="status-limit-bits",
            cause=Cause("status byte", "limit bits"),
        )
    else:
        trial.must(
            bool(own),
            f"{told}, without the bit of the {which} switch",
            came=byte,
            rule="status-limit-bits",
            cause=Cause("status byte", "limit bits"),
            because=(TARGET,),
        )
        trial.must(
            not other,
            f"{told}, with the bit of the other end",
            came=byte,
            rule="status-limit-bits",
            cause=Cause("status byte", "limit bits"),
        )
    if abs(mover.start - end) > 1 and not _at_an_end(begin):
        mover.go(mover.start)
        away = mover.status
        trial.must(
            not _at_an_end(away),
            f"axis {mover.name} is away from both ends, but its status byte is {int(away):#04x}",
            came=bytes((int(away),)),
            rule="status-limit-bits",
            cause=Cause("status byte", "limit bits at rest"),
        )


def _at_an_end(status: StatusBits) -> bool:
    return bool(status.upper_limit or status.lower_limit)
