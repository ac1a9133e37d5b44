"""Checks of motors: one check for all motors of a kind, which move together.

A controller with several bays or channels must never confuse them. So all its motors move at the same time,
each to a different position. Motors with the same declaration share one check, if the permissions suffice and
the messages are claimed.

:data:`MOTION_BITS`, :data:`COMPLETION` and :data:`APART` are rules that several kinds of moves check.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import TYPE_CHECKING, Final

from stagewire_conformance.device.check import Case, Kind
from stagewire_conformance.device.checks.apt.enable_state import ENABLING
from stagewire_conformance.device.checks.apt.motion.apart import need_no_confusion
from stagewire_conformance.device.checks.apt.motion.axis import Axis
from stagewire_conformance.device.checks.apt.motion.moves import returning
from stagewire_conformance.device.checks.apt.motion.pace import LONGEST
from stagewire_conformance.device.checks.apt.motion.parameters import (
    keep_backlash_inside,
    let_ends_be_reported,
)
from stagewire_conformance.device.permissions import Need, RangeError

if TYPE_CHECKING:
    from stagewire_conformance.device.declaration import Declaration
    from stagewire_conformance.device.permissions import Permissions
    from stagewire_conformance.device.targets import Target
    from stagewire_conformance.device.trial import Trial

MOTION_BITS: Final = (
    "status-bits-motion",
    "dc-status-bits-motion",
    "dc-status-velocity",
    "settled-at-rest",
    "status-bits-same",
    "no-error-in-normal-operation",
)
"""Rules for the messages of a motor in motion and at rest."""

COMPLETION: Final = (
    "move-no-response",
    "move-completed",
    "move-completed-status",
    "move-complete-when-settled",
    "status-position",
    "dc-status-position",
    *MOTION_BITS,
)
"""Rules for every move to a target."""

APART: Final = (
    "slot-addressed-by-destination",
    "slot-source",
    "reply-addresses-swapped",
    "bays-are-single-channel",
    "module-channels",
    "dual-channel-idents",
)
"""Rules for several motors."""


Motor = tuple["Target", int]
"""A channel of a target."""

Moving = Callable[[Sequence[Axis]], None]
"""Checks motors that are ready to move."""

_BOUND: Final = (
    f"each motion ends within {LONGEST:g} s, inside {{range}}, and after at most one and a half times "
    "its distance, or is stopped"
)

_MOTOR: Final = "MOT_MOVE_HOME"
"""Units with this message in their list move something. Solenoid drivers have other motor messages."""
_OTHERS: Final = {"PZMOT_GET_STATUSUPDATE", "POL_SET_PARAMS"}
"""Units with one of these messages home as motors do, but have their own kinds of checks."""
_BRUSHLESS: Final = "MOT_REQ_PMDPROFILEMODEPARAMS"
"""Units with this message in their list drive brushless motors."""
_FAST: Final = 0.7
"""The duration of a check of brushless motors, relative to the same check of other motors."""


def motors(declared: Declaration) -> Iterator[Motor]:
    """Yield the channels that move something."""
    for place in declared.places:
        if _MOTOR in place.listed and not _OTHERS & place.listed:
            for channel in place.channels:
                yield place, channel


def lacks_range(declared: Declaration, allowed: Permissions, motor: Motor) -> str:
    """Return why the allowed range cannot be applied to a motor; empty if it can."""
    if allowed.motion is None:
        return ""
    try:
        declared.reach(*motor, allowed.motion)
    except RangeError as error:
        return str(error)
    return ""


def _lacks_settings(place: Target, allowed: Permissions) -> str:
    """Return why the ends of motions are not reported without a setting; empty if they are."""
    required = place.unit.reports_ends_after
    if required is None or required.set is None or allowed.settings:
        return ""
    name = required.set.layout.message
    return f"{place.name} reports no end of a motion before {name}, which needs --allow-settings"


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
    bound: str = _BOUND,
) -> Callable[[Moving], Moving]:
    """Declare a function as a check of all motors with the same declaration; a decorator.

    :param title: has the motors as ``{motors}``.
    :param does: has the allowed range as ``{range}``.
    :param settings: whether the check also changes settings.
    :param seconds: the approximate duration with motors that are not brushless.
    :param lacks: returns why the permissions do not suffice.
    :param name: the name of the check within its kind, if the kind has several.
    :param at_least: the number of motors that the check requires.
    :param also: messages that the check uses if they are claimed; those of the status are always included.
    :param only: a message that units with such motors have in their lists.
    :param bound: the bound of each motion in time and distance.
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
                    seconds=seconds * (_FAST if _BRUSHLESS in place.listed else 1.0),
                    skip=_skip(place, messages),
                    lacks=lacks_range(declared, allowed, group[0])
                    or _lacks_settings(place, allowed)
                    or lacks(declared, allowed, group[0]),
                )

    def declare(moving: Moving) -> Moving:
        kind.check(
            title,
            messages=messages,
            needs={Need.MOTION, Need.SETTINGS} if settings else {Need.MOTION},
            does=does,
            bound=bound,
            name=name,
            each=cases,
        )(partial(_run, moving=moving))
        return moving

    return declare


def _used(declared: Declaration, place: Target, also: tuple[str, ...]) -> list[str]:
    """Return the claimed messages that are also used: those of the status, and ``also``."""
    query = place.unit.status_query
    names = [query.req.layout.message] if query and query.req else []
    names += ["MOT_REQ_STATUSBITS", "MOT_REQ_POSCOUNTER"]
    for name in list(names):
        names += declared.registry.messages[name]["exchange"]["answered_by"]
    return [name for name in (*names, *also) if name in place.messages]


def _alike(declared: Declaration) -> list[list[Motor]]:
    """Return the motors, grouped by equal declarations."""
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
    """Return the part of an id that identifies the motors: ``0x21/1+0x22/1``."""
    return "+".join(f"{place.name}/{channel}" for place, channel in group)


def unseen(place: Target) -> str:
    """Return why the position of a motor cannot be read, which only the PICS can decide; empty if it can."""
    query = place.unit.status_query
    return place.why_not(query.req.layout.message) if query and query.req else ""


def _skip(place: Target, messages: tuple[str, ...]) -> str:
    """Return why a motor cannot be checked, which only the PICS can decide; empty if it can.

    A check with motion must be able to read the position, to stop the motor, and to move it back.
    """
    every = (*messages, "MOT_MOVE_STOP", "MOT_MOVE_ABSOLUTE")
    return unseen(place) or place.why_none(every)


def _run(trial: Trial, group: Sequence[Motor], moving: Moving) -> None:
    axes = [Axis(trial, place, channel) for place, channel in group]
    if len(axes) > 1:
        need_no_confusion(trial)
    for axis in axes:
        # It must be known where a motor is and whether it moves, and it must be possible to disable it.
        trial.depends_on(*axis.spoilt, *ENABLING)
        axis.inside()
    for axis in axes:
        let_ends_be_reported(axis)
        axis.begin()
        keep_backlash_inside(axis)
    returning(axes)
    moving(axes)
