"""End messages that come too early: the motor still moves, or a stop has no effect."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from stagewire_conformance.device.causes import EFFECT, Cause
from stagewire_conformance.device.checks.apt.broken_rules import rule_of_end
from stagewire_conformance.device.checks.apt.motion.axis import (
    HELD,
    JITTER,
    POLL,
    STOPPED,
    Axis,
)
from stagewire_conformance.device.checks.apt.motion.watch import (
    Decision,
    Watched,
    drop_ends,
    is_outside,
)

if TYPE_CHECKING:
    from stagewire_conformance.device.lines.dialogue import Incoming

SETTLES: Final = 0.12
"""Seconds for which motion bits may remain after the end message."""
_COMES_TO_REST: Final = 5.0
"""Seconds within which a motor that moves on after an end message must come to rest."""
_RESTS: Final = 0.3
"""Seconds without motion after which such a motor is at rest."""


def judge_early(axis: Axis, told: str, end: Incoming, seen: Watched, target: int) -> bool:
    """Report an end message that came before the end of the motion; return whether it came after it."""
    after, start = seen.after, seen.statuses[0].position if seen.statuses else target
    if after is None or abs(after - target) <= axis.tolerance(target - start):
        return True
    axis.standing()
    rest = axis.position()
    position = getattr(end.message, "position", None)
    says = "" if position is None else f" with the position {position}"
    return axis.trial.must(
        abs(rest - after) <= JITTER,
        f"{axis.text}: after {told}, it sent {end.name}{says}, but was then at {after} and moved on "
        f"to {rest}; it should report the end when it is at its target {target}",
        rule=rule_of_end(told, end.name),
        cause=Cause(end.name, "early"),
        came=end.raw,
    )


def judge_over(
    axis: Axis,
    told: str,
    end: Incoming,
    seen: Watched,
    *,
    strays: Decision = is_outside,
    ignored: Decision = lambda axis, status: False,
) -> bool:
    """Report a motor that moves on after the message that it has ended; return whether it rests.

    A motor that moves on to where it must not be is stopped.

    :param strays: decides that it is there.
    :param ignored: decides, from its status at rest, that a stop had no effect.
    """
    axis.pause_after_motion(SETTLES)
    status = axis.status()
    if seen.after is None or abs(status.position - seen.after) <= HELD:
        return True
    until = axis.trial.line.now + _COMES_TO_REST
    still = status.time
    while not (halted := strays(axis, status) or axis.trial.line.now > until):
        axis.pause(POLL)
        last, status = status, axis.status()
        if status.moving or abs(status.position - last.position) > JITTER:
            still = status.time
        elif status.time - still >= _RESTS:
            break
    if halted:
        status = axis.halt()
    drop_ends(axis)  # of this motion
    is_ignored = end.name == STOPPED and (halted or ignored(axis, status))
    return axis.trial.must(
        False,
        f"{axis.text}: after {told}, it sent {end.name}, but was then at {seen.after} and moved on to "
        f"{status.position}{', where it was stopped again' if halted else ''}; it should report the end "
        "when it is at rest",
        rule="stop-any-move" if is_ignored else rule_of_end(told, end.name),
        cause=Cause("MOT_MOVE_STOP", EFFECT) if is_ignored else Cause(end.name, "early"),
        because=axis.spoilt,
        came=end.raw,
    )
