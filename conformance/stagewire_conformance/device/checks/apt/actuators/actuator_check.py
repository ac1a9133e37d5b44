"""The decorator of checks of actuators: one check for each channel."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Final, TypeVar

from stagewire_conformance.device.check import Case, Kind
from stagewire_conformance.device.checks.apt.actuators.actuator import LONGEST
from stagewire_conformance.device.checks.apt.actuators.families import (
    Family,
    family_of,
    sets_of,
    stop_of,
)
from stagewire_conformance.device.checks.apt.actuators.readiness import MODE_SETS
from stagewire_conformance.device.checks.apt.enable_state import ENABLED_SETS
from stagewire_conformance.device.checks.apt.motion.motor_check import lacks_range
from stagewire_conformance.device.permissions import Need

if TYPE_CHECKING:
    from stagewire_conformance.device.declaration import Declaration
    from stagewire_conformance.device.permissions import Permissions
    from stagewire_conformance.device.targets import Target

_Looks = TypeVar("_Looks", bound=Callable[..., None])

_BOUND: Final = f"each motion ends within {LONGEST:g} s and inside {{range}}, or is stopped"


def actuator_check(
    kind: Kind,
    title: str,
    *,
    does: str,
    messages: Callable[[Family], tuple[str, ...]],
    seconds: float,
    reads: Callable[[Family], tuple[str, ...]] = lambda family: (),
    writes: Callable[[Family], tuple[str, ...]] = lambda family: (),
    changes: bool = False,
    fits: Callable[[Target], object] = lambda place: True,
    name: str = "",
) -> Callable[[_Looks], _Looks]:
    """Declare a function as a check of each actuator; a decorator.

    It needs the permission for settings if a move changes one, as on a PDXC2, or if ``changes``.

    :param title: has the actuator as ``{actuator}``.
    :param messages: returns the messages that a target must claim, besides those of its moves.
    :param reads: returns the parameter sets that are read, besides those of its moves.
    :param writes: returns the parameter sets that are also written if settings may be changed.
    :param changes: whether the check is about settings that it changes.
    :param fits: returns whether a target has what the check is about.
    :param name: the name of the check within its kind, if the kind has several.
    """

    def cases(declared: Declaration, allowed: Permissions) -> Iterator[Case]:
        for place in declared.places:
            family = family_of(place)
            if family is None or not fits(place):
                continue
            wanted = (*messages(family), family.command, stop_of(place))
            written = (*family.stored, *(writes(family) if allowed.settings else ()))
            for channel in place.channels:
                yield Case(
                    name=f"{place.name}/{channel}",
                    arguments={"place": place, "channel": channel},
                    words={"actuator": f"channel {channel} of {place.name}"},
                    messages=(
                        *wanted,
                        *_used(declared, place, channel, family, reads(family), written),
                    ),
                    needs=frozenset({Need.SETTINGS} if family.stored or changes else ()),
                    skip=place.why_none(wanted),
                    lacks=lacks_range(declared, allowed, (place, channel)),
                )

    return kind.check(
        title,
        needs={Need.MOTION},
        does=does,
        bound=_BOUND,
        seconds=seconds,
        each=cases,
        name=name,
    )


def _used(
    declared: Declaration,
    place: Target,
    channel: int,
    family: Family,
    reads: tuple[str, ...],
    written: tuple[str, ...],
) -> list[str]:
    """Return the claimed messages that every check of an actuator may use."""
    names = [*sorted(ENABLED_SETS), *sorted(MODE_SETS), family.completed]
    names += ["PZMOT_REQ_POSCOUNTERS", "PZMOT_GET_POSCOUNTERS"]
    names += ["PZMOT_REQ_STATUSUPDATE", "PZMOT_GET_STATUSUPDATE"]
    names += ["MOT_REQ_DCSTATUSUPDATE", "MOT_GET_DCSTATUSUPDATE"]
    names += ["PZ_REQ_POSCONTROLMODE", "PZ_GET_POSCONTROLMODE"]
    for placed in sets_of(declared, place, channel, *written, *family.paces, *reads):
        names += placed.set.messages[0 if placed.set.name in written else 1 :]
    return [name for name in names if name in place.messages]
