"""Judgement of a motion by its positions: they follow it, and it ends at its target."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from stagewire_conformance.device.causes import Cause
from stagewire_conformance.device.checks.apt.broken_rules import (
    command_in,
    rule_of_command,
    rule_of_miss,
    rule_of_status,
)
from stagewire_conformance.device.checks.apt.motion.axis import HELD, JITTER, Axis, Status
from stagewire_conformance.device.checks.apt.motion.course import beyond, points_of

_ACCURATE: Final = 32
"""Counts from its target at which a settled servo may rest."""
_FEW: Final = 3
"""The minimum number of statuses between the first and the last that must show a motion."""
_FOLLOWS: Final = 0.1
"""Seconds after which the position must have changed."""


def judge_positions(
    axis: Axis, told: str, statuses: Sequence[Status], start: int, target: int
) -> None:
    """Report positions that did not follow a motion that has ended at its target, or went beyond it."""
    middle = [status for status in statuses[1:-1] if status.moving]
    seconds = middle[-1].time - middle[0].time if middle else 0.0
    if len(middle) >= _FEW and seconds >= _FOLLOWS and abs(target - start) > HELD:
        for end, where in ((start, "where the motion began"), (target, "its target")):
            axis.trial.must(
                any(abs(each.position - end) > JITTER for each in middle),
                f"{axis.text}: after {told}, {len(middle)} statuses of the moving motor in "
                f"{seconds:.2f} s had the position {middle[-1].position}, {where}; the position should "
                "follow the motion",
                rule=rule_of_status(axis.place, "position"),
                cause=Cause(middle[-1].heard.name, "position"),
                came=middle[-1].heard.raw,
            )
    over = beyond(points_of(statuses), start, target)
    place = target + (over if target >= start else -over)
    axis.trial.must(
        over <= abs(axis.backlash) + axis.overshoot(target - start),
        f"{axis.text}: after {told} from {start}, it was at {place}, {over} counts beyond its "
        "target; it should not go further"
        + (f" than its backlash distance of {axis.backlash}" if axis.backlash else ""),
        rule=rule_of_command(told),
        cause=Cause(command_in(told), "overshoot"),
    )


def judge_place(
    axis: Axis, told: str, status: Status, start: int, target: int, *, accurate: bool = False
) -> bool:
    """Report a motor that is not at its target; return whether it is.

    A motor that was commanded to where it was may stay anywhere a servo holds its stage.

    :param accurate: whether even a small distance from the target is reported, as NON-STRICT.
    """
    missed = status.position - target
    near = HELD if abs(target - start) <= JITTER else axis.tolerance(target - start)
    bits = status.bits
    limit = bits.forward_hardware_limit or bits.reverse_hardware_limit
    hint = " (a limit switch is active: is the range within the travel?)" if limit else ""
    if accurate and abs(missed) <= near:
        axis.trial.should(
            abs(missed) <= _ACCURATE,
            f"{axis.text}: after {told}, it rests at {status.position}, {abs(missed)} counts away from its "
            f"target {target}; a move is complete when the axis has settled at the demanded position",
            rule=rule_of_command(told),
            cause=axis.cause_of_miss(command_in(told), missed, target - start),
            because=axis.spoilt,
            came=status.heard.raw,
        )
        return True
    return axis.trial.must(
        abs(missed) <= near,
        f"{axis.text}: after {told}, it is at {status.position}; from {start} it should have "
        f"gone to {target}{hint}",
        rule=rule_of_miss(told, missed, target - start),
        cause=axis.cause_of_miss(command_in(told), missed, target - start),
        because=axis.spoilt,
        came=status.heard.raw,
    )
