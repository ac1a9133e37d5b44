"""Checks of motors: one for all of a kind, which move at once, where what is allowed and claimed suffices.

A controller with several bays, or channels, has to keep them apart all the time; so all its motors move at
once, each to a place of its own. Those that are declared alike make one check.

:data:`MOTION_BITS`, :data:`COMPLETION` and :data:`APART` are rules that several kinds of moves hold a
controller to.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import TYPE_CHECKING, Final

from stagewire_conformance.device.check import Case, Kind
from stagewire_conformance.device.checks.apt.motion.axis import Axis
from stagewire_conformance.device.checks.apt.motion.moves import returning
from stagewire_conformance.device.permissions import Need, RangeError

if TYPE_CHECKING:
    from stagewire_conformance.device.declaration import Declaration
    from stagewire_conformance.device.permissions import Permissions
    from stagewire_conformance.device.targets import Target
    from stagewire_conformance.device.trial import Trial

MOTION_BITS: Final = ("status-bits-motion", "dc-status-bits-motion")
"""What the status says of a motor that moves, and of one that does not."""

COMPLETION: Final = (
    "move-no-response",
    "move-completed",
    "move-completed-status",
    "move-complete-when-settled",
    "settled-at-rest",
    "status-position",
    "dc-status-position",
    "dc-status-velocity",
    *MOTION_BITS,
)
"""What holds for every move to a target."""

APART: Final = (
    "slot-addressed-by-destination",
    "slot-source",
    "reply-addresses-swapped",
    "bays-are-single-channel",
    "module-channels",
    "dual-channel-idents",
)
"""What holds where several motors move."""


Motor = tuple["Target", int]
"""A channel of a place."""

Moving = Callable[[Sequence[Axis]], None]
"""Looks at motors that are ready to move."""

_MOTOR: Final = "MOT_MOVE_HOME"
"""A unit that has it in its list moves something: a solenoid driver has other messages of motors."""


def motors(declared: Declaration) -> Iterator[Motor]:
    """Give the channels that move something."""
    for place in declared.places:
        if _MOTOR in place.listed:
            for channel in place.channels:
                yield place, channel


def lacks_range(declared: Declaration, allowed: Permissions, motor: Motor) -> str:
    """Return why the range that is allowed says nothing of a motor; empty where it does."""
    if allowed.motion is None:
        return ""
    try:
        declared.reach(*motor, allowed.motion)
    except RangeError as error:
        return str(error)
    return ""


def motor_check(
    kind: Kind,
    title: str,
    *,
    messages: tuple[str, ...],
    does: str,
    settings: bool = False,
    seconds: float = 1.5,
    lacks: Callable[[Declaration, Permissions, Motor], str] = lambda declared, allowed, motor: "",
    name: str = "",
    at_least: int = 1,
    also: tuple[str, ...] = (),
    only: str = _MOTOR,
) -> Callable[[Moving], Moving]:
    """Declare a function that looks at motors as a check of all motors that are declared alike.

    :param title: names them as ``{motors}``.
    :param does: names the range that was allowed as ``{range}``.
    :param settings: whether it also changes settings.
    :param lacks: returns what else is missing of what was allowed.
    :param name: of the check within its kind, if the kind has several.
    :param at_least: how many motors it takes.
    :param also: messages that it uses where they are claimed; those of the status are always among them.
    :param only: a message that units with such motors have in their lists.
    """

    def cases(declared: Declaration, allowed: Permissions) -> Iterator[Case]:
        for group in _alike(declared):
            place = group[0][0]
            if len(group) >= at_least and only in place.listed:
                yield Case(
                    name=_name(group),
                    arguments={"group": group},
                    words={
                        "motors": " and ".join(
                            f"channel {each[1]} of {each[0].name}" for each in group
                        )
                    },
                    messages=_used(declared, place, also),
                    skip=_skip(place, messages),
                    lacks=lacks_range(declared, allowed, group[0])
                    or lacks(declared, allowed, group[0]),
                )

    def declare(moving: Moving) -> Moving:
        kind.check(
            title,
            messages=messages,
            needs={Need.MOTION, Need.SETTINGS} if settings else {Need.MOTION},
            does=does,
            seconds=seconds,
            name=name,
            each=cases,
        )(partial(_run, moving=moving))
        return moving

    return declare


def _used(declared: Declaration, place: Target, also: tuple[str, ...]) -> list[str]:
    """Return what else is used of what a place claims: the status, and what is named."""
    query = place.unit.status_query
    names = [query.req.layout.message] if query and query.req else []
    for name in list(names):
        names += declared.registry.messages[name]["exchange"]["answered_by"]
    return [name for name in (*names, *also) if name in place.messages]


def _alike(declared: Declaration) -> list[list[Motor]]:
    """Return the motors in groups of those of which the same is declared."""
    groups: dict[tuple[object, ...], list[Motor]] = {}
    for place, channel in motors(declared):
        connected = place.connected_to(channel)
        key = (
            frozenset(place.messages),
            connected.position_scale,
            connected.travel,
            connected.homes,
            connected.limit_switches,
        )
        groups.setdefault(key, []).append((place, channel))
    return list(groups.values())


def _name(group: Sequence[Motor]) -> str:
    """Return what names the motors in an id: ``0x21/1+0x22/1``."""
    return "+".join(f"{place.name}/{channel}" for place, channel in group)


def unseen(place: Target) -> str:
    """Return why nobody can see where a motor is, which only the PICS can say; empty where it can be seen."""
    query = place.unit.status_query
    return place.why_not(query.req.layout.message) if query and query.req else ""


def _skip(place: Target, messages: tuple[str, ...]) -> str:
    """Return why a motor cannot be looked at, which only the PICS can say; empty where it can.

    Whoever moves something has to see where it is, must be able to stop it, and to bring it back.
    """
    every = (*messages, "MOT_MOVE_STOP", "MOT_MOVE_ABSOLUTE")
    return unseen(place) or place.why_none(every)


def _run(trial: Trial, group: Sequence[Motor], moving: Moving) -> None:
    axes = [Axis(trial, place, channel) for place, channel in group]
    for axis in axes:
        axis.inside()
    for axis in axes:
        axis.begin()
    returning(axes)
    moving(axes)
