"""Motors that are confused: a command to one affects another, or one reports the motion of another.

Bays differ only by the address in their messages, channels of a module only by the channel (pages 9 and 17).
The first finding ends the check, and no other check moves several motors after it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

from stagewire_apt import messages as m
from stagewire_apt.enumerations import StopMode
from stagewire_conformance.device.causes import Cause
from stagewire_conformance.device.checks.apt.motion.axis import JITTER, STOPPED, Axis, Status
from stagewire_conformance.device.checks.apt.motion.watch import Watched
from stagewire_conformance.device.checks.apt.replies import judge_addresses, wrong_addresses
from stagewire_conformance.device.trial import EnoughError

if TYPE_CHECKING:
    from stagewire import FramedMessage
    from stagewire_conformance.device.lines.dialogue import Incoming
    from stagewire_conformance.device.trial import Trial

CONFUSED: Final = Cause("motors", "confused")
"""The cause that a command to one motor affects another one, or that one reports the motion of another."""
_OBEYS: Final = 0.15
"""Seconds after which a motor that obeys a command has certainly moved."""
_SURE: Final = 3
"""Statuses that show that a motor was stopped."""
_GOES_ON: Final = 0.1
"""Seconds in which a motor that was not stopped moves on."""


def need_no_confusion(trial: Trial) -> None:
    """End the check before it moves several motors, if they were confused before."""
    trial.depends_on(CONFUSED, *wrong_addresses(trial))


def start(commands: Mapping[Axis, FramedMessage], *, first_alone: bool) -> dict[Axis, float]:
    """Send commands to motors, and return the times at which they were sent.

    :param first_alone: whether to wait after the first command: the other motors must not obey it.
    """
    first, *others = commands
    stood = {other: other.status().position for other in others if first_alone}
    first.send(commands[first])
    began = {first: first.trial.line.now}
    if stood:
        first.pause(_OBEYS)
        judge_others(first, commands[first].layout.message, stood)
    for other in others:
        other.send(commands[other])
        began[other] = other.trial.line.now
    return began


def judge_others(axis: Axis, command: str, stood: Mapping[Axis, int]) -> None:
    """Report motors that have moved although only another one was commanded to; stop them, and end the check.

    :param stood: the positions of the other motors before the command.
    """
    for other, place in stood.items():
        status = other.status()
        moved = abs(status.position - place) > 2 * JITTER  # it may have oscillated
        if moved:
            for each in (axis, other):
                each.send(m.MotMoveStop(each.channel, StopMode.IMMEDIATE))
        need_apart(
            not moved,
            axis,
            other,
            f"{command} was sent to {axis.text}, but {other.text} went from {place} to {status.position}; "
            "it should not move",
            status.heard,
        )


def judge_stop_alone(
    axis: Axis,
    others: Mapping[Axis, Watched],
    after: Mapping[Axis, Sequence[Status]] = MappingProxyType({}),
) -> None:
    """Report motors that stopped, or reported a stop, although only another one was stopped; end the check.

    :param after: their statuses between that stop and their own.
    """
    for other, seen in others.items():
        if seen.halted is not None:
            continue
        end = next((end for end in seen.ends if end.name == STOPPED), None)
        stood = after.get(other, ())
        if seen.stopped is None and end is not None:
            place = other.position()
            other.pause(_GOES_ON)
            if abs(other.position() - place) > JITTER:
                need_source(axis, "MOT_MOVE_STOP", other, end)
        elif len(stood) < _SURE or any(status.moving for status in stood[1:]):
            continue
        else:
            place, end = stood[-1].position, stood[-1].heard
        need_apart(
            False,
            axis,
            other,
            f"MOT_MOVE_STOP was sent to {axis.text}, but {other.text} also stopped, at {place}, and then "
            f"reported {end.text}; it should move on",
            end,
        )


def judge_sources(seen: Mapping[Axis, Watched]) -> None:
    """Report end messages of motors that moved together if their sources are wrong, and end the check.

    A motor that has stopped without an end message has sent it as another one, which has two. If it has
    moved on, the stop has reached the other one.
    """
    for axis, each in seen.items():
        for other, twice in seen.items():
            names = [end.name for end in twice.ends]
            own = [end.name for end in each.ends]
            if each.stopped is None or STOPPED in own or names[1:] != [STOPPED]:
                continue
            need_apart(
                not own,
                axis,
                other,
                f"MOT_MOVE_STOP was sent to {axis.text}, but {other.text} reported another {STOPPED}, and "
                f"{axis.text} moved on until {' and '.join(own)}",
                twice.ends[1],
            )
            need_source(axis, "MOT_MOVE_STOP", other, twice.ends[1])
        for end in each.ends:
            judge_addresses(axis.trial, axis.place, end)
            if wrong_addresses(axis.trial) and len(seen) > 1:
                raise EnoughError


def need_source(axis: Axis, command: str, other: Axis, end: Incoming) -> None:
    """Report an end message with the address of another motor, and end the check."""
    axis.trial.need(
        False,
        f"{command} was sent to {axis.text} only, and its end was reported by {end.name} from "
        f"{other.place.name}; the source should be {axis.place.name}",
        rule="slot-source",
        cause=CONFUSED,
        came=end.raw,
    )


def need_apart(holds: bool, axis: Axis, other: Axis, text: str, came: Incoming) -> None:
    """Report two motors that are confused, and end the check."""
    axis.trial.need(
        holds,
        text,
        rule=rule_of_apart(axis, other),
        cause=CONFUSED,
        came=came.raw,
    )


def rule_of_apart(axis: Axis, other: Axis) -> str:
    """Return the rule that two motors are not confused: bays by the address, channels by the channel."""
    return "slot-addressed-by-destination" if axis.place != other.place else "module-channels"
