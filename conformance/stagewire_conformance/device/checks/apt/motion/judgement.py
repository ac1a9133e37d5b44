"""Judgement of a motion: its end, the status on the way, and the status at rest."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from stagewire_apt.enumerations import MoveDirection
from stagewire_conformance.device.causes import (
    DELIVERY,
    EFFECT,
    MOTION_AT_REST,
    NOW_AND_THEN,
    UNSOLICITED,
    Cause,
)
from stagewire_conformance.device.checks.apt.broken_rules import (
    command_in,
    rule_of_distance,
    rule_of_end,
    rule_of_status,
)
from stagewire_conformance.device.checks.apt.enable_state import ENABLING
from stagewire_conformance.device.checks.apt.motion.axis import (
    HELD,
    Axis,
    Status,
)
from stagewire_conformance.device.checks.apt.motion.early_ends import SETTLES
from stagewire_conformance.device.checks.apt.motion.replies_together import judge_bits_alone
from stagewire_conformance.device.checks.apt.motion.velocities import (
    AT_REST,
    judge_changing_velocities,
    judge_velocities,
)
from stagewire_conformance.device.checks.apt.motion.watch import Watched, is_outside
from stagewire_conformance.device.checks.apt.replies import judge_message, judge_unasked
from stagewire_conformance.device.checks.apt.streams import unstopped
from stagewire_conformance.device.checks.apt.wording import raw_of

if TYPE_CHECKING:
    from stagewire_conformance.device.lines.dialogue import Incoming


_LATE = 0.1
"""Seconds after the first status in which the motion bits may be missing."""
_WAYS = {
    MoveDirection.FORWARD: "forward",
    MoveDirection.REVERSE: "in reverse",
    None: "forward or in reverse",
}
"""Names of the directions in sentences; None is an unknown direction."""

_STILL_SPEED = 3
"""The highest velocity, in units of the status, that a motor at rest may report."""

_BEFORE = 2
"""Statuses before the end of a motion that show how fast it was."""
_MIDWAY = 20
"""A motor is on its way while it is at least a twentieth of the distance from both ends."""


def judge_end(
    axis: Axis, told: str, seen: Watched, wanted: str, *, rule: str = ""
) -> Incoming | None:
    """Report how a motion ended, and return its end message. A motor without one is stopped.

    :param told: the command, for sentences: ``MOT_MOVE_ABSOLUTE to 1000``.
    :param wanted: the message that must report the end, once.
    :param rule: the rule about this message; by default that of the command.
    """
    trial = axis.trial
    rule = rule or rule_of_end(told, wanted)
    for other in seen.others:
        judge_unasked(trial, other, f"after {told} at {axis.text}")
    if seen.strayed is not None:
        if seen.stopped is None:  # the command that should have been stopped has moved it there
            told = told.rpartition(" in ")[2]
        left = f"outside of {axis.low}..{axis.high}"
        where = left if is_outside(axis, seen.strayed) else "further than it should go"
        trial.must(
            False,
            f"{axis.text}: after {told}, it was at {seen.strayed.position}, {where}; it was stopped",
            rule=rule_of_distance(told),
            cause=Cause(command_in(told), EFFECT),
            because=(*axis.spoilt, Cause(command_in(told.rpartition(" in ")[2]), EFFECT)),
            came=seen.strayed.heard.raw,
        )
        return None
    if not seen.ends:
        last = seen.statuses[-1] if seen.statuses else None
        says = f"; it is at {last.position} and reports {_names(last)}" if last else ""
        if not seen.overdue:
            axis.halt()
        elif not axis.pace.known and seen.progressed:
            trial.inconclusive(
                f"{axis.text}: after {told}, it was stopped on its way after {seen.seconds:.1f} s, which "
                "is the bound if the scale of its velocity is unknown; set a higher velocity"
            )
            return None
        trial.must(
            False,
            f"{axis.text}: after {told}, it sent no {wanted} within {seen.seconds:.1f} "
            f"s{says}; it was stopped",
            rule=rule,
            cause=trial.likely(Cause(wanted, DELIVERY), Cause(command_in(told), EFFECT)),
            because=axis.doubts if seen.overdue else _losses(axis, wanted),
        )
        return None
    first, *more = seen.ends
    ours = next((end for end in seen.ends if end.name == wanted and _is_of(axis, end)), first)
    trial.must(
        ours.name == wanted,
        f"{axis.text}: after {told}, it sent {ours.name} instead of {wanted}",
        rule=rule,
        cause=trial.likely(Cause(wanted, DELIVERY), Cause(command_in(told), EFFECT)),
        came=ours.raw,
    )
    trial.must(
        not more,
        f"{axis.text}: after {told}, {len(seen.ends)} end-of-move messages arrived "
        f"({', '.join(f'{end.name} from {end.source:#04x}' for end in seen.ends)}) instead of "
        "one",
        rule=rule,
        cause=Cause(more[0].name, UNSOLICITED) if more else None,
        came=raw_of(seen.ends),
    )
    judge_message(trial, axis.place, axis.channel, ours)
    return ours


def _losses(axis: Axis, wanted: str) -> tuple[Cause, ...]:
    """Return the defects that explain why an end message did not come, although the motion may have ended."""
    sometimes = (NOW_AND_THEN,) if wanted in axis.trial.line.received else ()
    return Cause(wanted, "early"), *ENABLING, *sometimes


def judge_no_reply(axis: Axis, told: str, seen: Watched) -> None:
    """Report a status message that answers a move. Several may be the updates of another program."""
    statuses = [
        other
        for other in seen.others
        if hasattr(other.message, "status_bits") and _is_of(axis, other)
    ]
    axis.trial.must(
        len(statuses) != 1,
        f"{axis.text}: {told} was answered with {statuses[0].name if statuses else ''}, which was not "
        "requested; a move has no reply before its end",
        rule="move-no-response",
        cause=Cause(command_in(told), UNSOLICITED),
        because=unstopped(axis.trial.declared),
        came=raw_of(statuses),
    )


def _judge_status_of_end(axis: Axis, told: str, end: Incoming) -> None:
    trial = axis.trial
    if not trial.should(
        hasattr(end.message, "status_bits"),
        f"{axis.text}: {end.name} after {told} is only a header; 14 bytes of status should "
        "follow it",
        rule=_rule_of_content(end),
        cause=Cause("end of a move", "status"),
        came=end.raw,
    ):
        return
    status = axis.status_of(end)
    trial.should(  # controllers are known that send the bits of the instant before
        not status.moving,
        f"{axis.text}: {end.name} after {told} reports {_names(status)}; it should report "
        "no motion",
        rule=rule_of_status(axis.place, "bits-motion"),
        cause=Cause(end.name, MOTION_AT_REST),
        because=axis.spoilt,
        came=end.raw,
    )
    if axis.settle_time is not None and end.name == "MOT_MOVE_COMPLETED":
        # page 66: with a settle time of 0, a move is complete at any position
        (trial.must if axis.settle_time else trial.should)(
            status.bits.settled,
            f"{axis.text}: {end.name} after {told} reports {_names(status)}; a move is complete "
            "only when the axis has settled",
            rule="move-complete-when-settled",
            cause=Cause(end.name, "settled"),
            came=end.raw,
        )


def judge_course(
    axis: Axis,
    told: str,
    statuses: Sequence[Status],
    start: int,
    target: int,
    *,
    direction: MoveDirection | None = None,
    jogging: bool = False,
) -> None:
    """Report what is wrong with the status of a motor on its way.

    :param direction: the commanded direction, which the bits must report. None: the command was a position or
        a distance. Then the bits may report either direction, because no page states in which one positions
        rise, but always the same one for motion to higher positions, and the other for motion to lower ones.
    :param jogging: whether the bits must report a jog.
    """
    if statuses and (statuses[-1].position - start) * (target - start) < 0:
        return  # it went the other way, which the judgement of its place reports
    if axis.trial.causes.check_of(Cause(command_in(told), EFFECT)):
        return  # the command is known to move it elsewhere
    low, high = min(start, target), max(start, target)
    edge = max(1, (high - low) // _MIDWAY)
    way, towards = (1, "up") if target > start else (-1, "down")
    midway = [status for status in statuses if low + edge < status.position < high - edge]
    moving = [status for status in statuses if status.moving]
    if judge_velocities(axis, told, midway, way):
        judge_changing_velocities(axis, told, moving)
    for status in _without_late_ones(statuses, midway):
        says = (
            f"{axis.text}: on its way {towards} after {told}, at {status.position}, "
            f"{status.heard.name} reports {_names(status)}"
        )
        expected = direction or axis.direction_of(way)
        named = _WAYS[expected]
        if not axis.trial.must(
            status.direction is not None and expected in (None, status.direction),
            f"{says}; it should report motion {named}",
            rule=rule_of_status(axis.place, "bits-motion"),
            cause=Cause(status.heard.name, "motion bits on the way"),
            came=status.heard.raw,
        ):
            return
        assert status.direction is not None
        axis.learn(way, status.direction)
        bits = status.bits
        if not axis.trial.must(
            not getattr(bits, "settled", False),
            f"{axis.text}: on its way after {told}, {status.heard.name} reports "
            f"{_names(status)}; it should be settled only at rest",
            rule="settled-at-rest",
            cause=Cause(status.heard.name, "settled"),
            came=status.heard.raw,
        ):
            return
        jogs = getattr(bits, f"jogging_{status.direction.name.lower()}")
        if jogging and not axis.trial.must(
            jogs,
            f"{says}; it should report jogging {named}",
            rule=rule_of_status(axis.place, "bits-motion"),
            cause=Cause(status.heard.name, "jogging bits"),
            came=status.heard.raw,
        ):
            return


def _without_late_ones(statuses: Sequence[Status], midway: Sequence[Status]) -> Sequence[Status]:
    """Leave out the first statuses, in which motion bits may still be missing."""
    return [status for status in midway if status.moving or status.time - statuses[0].time >= _LATE]


def judge_rest(
    axis: Axis, told: str, end: Incoming | None = None, seen: Watched | None = None
) -> Status:
    """Report what is wrong with the status of a motor after the end of a motion, and return it.

    :param end: the end message, whose content must be right, and must still hold.
    :param seen: the observed motion, if the motor was stopped.
    """
    axis.pause_after_motion(SETTLES)
    status = axis.status()  # only once: a second request would hide a status that lags by one
    if end is not None and seen is not None:
        _judge_jump(axis, told, end, status, seen.slowing[-_BEFORE:])
    axis.trial.must(
        not status.moving,
        f"{axis.text}: {told} has ended, but {status.heard.name} reports {_names(status)}; it "
        "should report no motion",
        rule=rule_of_status(axis.place, "bits-motion"),
        cause=Cause(status.heard.name, MOTION_AT_REST),
        came=status.heard.raw,
    )
    position: int | None = getattr(end.message, "position", None) if end else None
    axis.trial.must(
        position is None or abs(position - status.position) <= HELD,
        f"{axis.text}: after {told}, {end.name if end else ''} reported the position "
        f"{position}, but {status.heard.name} then reported {status.position}",
        rule=_rule_of_content(end) if end else "",
        cause=Cause(end.name, "position") if end else None,
        because=(Cause(status.heard.name, "position"),),
        came=end.raw if end else None,
    )
    if not status.moving:
        axis.trial.must(
            abs(status.velocity or 0) <= _STILL_SPEED,
            f"{axis.text}: {told} has ended, but {status.heard.name} reports a velocity of "
            f"{status.velocity}; at rest it should be 0",
            rule="dc-status-velocity",
            cause=Cause(status.heard.name, AT_REST),
            came=status.heard.raw,
        )
    if end is not None and end.name != "MOT_MOVE_HOMED":
        _judge_status_of_end(axis, told, end)
    judge_bits_alone(axis, f"after {told}")
    return status


def _judge_jump(
    axis: Axis, told: str, end: Incoming, rest: Status, slowing: Sequence[Status]
) -> None:
    """Report a position that jumps when a motor has slowed down to a stop.

    A motor that slows down covers less in each interval than in the one before. A servo may overshoot.

    :param slowing: its last statuses before the end message.
    """
    if len(slowing) < _BEFORE or axis.place.status != "stepper":
        return
    before, last = slowing
    speed = abs(last.position - before.position) / max(last.time - before.time, 1e-3)
    most = speed * (end.time - last.time) + 2 * HELD
    axis.trial.must(
        abs(rest.position - last.position) <= most,
        f"{axis.text}: after {told}, it slowed down from {before.position} to {last.position} counts, and "
        f"{rest.heard.name} at rest then reported {rest.position}; the position should not jump",
        rule=rule_of_status(axis.place, "position"),
        cause=Cause(rest.heard.name, "position"),
        because=(*axis.spoilt, Cause(end.name, "position")),
        came=rest.heard.raw,
    )


def _rule_of_content(end: Incoming) -> str:
    """Return the rule about the status in an end message."""
    return "move-stopped-status" if end.name == "MOT_MOVE_STOPPED" else "move-completed-status"


def _is_of(axis: Axis, end: Incoming) -> bool:
    return end.source == axis.place.address and end.channel == axis.channel


def _names(status: Status) -> str:
    """Return the names of the bits that are set in a status."""
    bits: Any = status.bits
    return ", ".join(name for name in type(bits).bits if getattr(bits, name)) or "no bit"
