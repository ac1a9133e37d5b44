"""Motions without an end of their own: they last until they are stopped."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from stagewire_conformance.device.causes import EFFECT, Cause
from stagewire_conformance.device.checks.apt.actuators.families import stop_of
from stagewire_conformance.device.checks.apt.actuators.judgement import (
    arrives,
    judge_end,
    judge_others,
)

if TYPE_CHECKING:
    from stagewire.protocols import FramedMessage
    from stagewire_conformance.device.checks.apt.actuators.actuator import Actuator

_SECONDS: Final = 0.2
"""Seconds of motion before the stop, and seconds in which the stop must take effect."""


def goes_to_middle(actuator: Actuator, room: int) -> bool:
    """Move to a position with room in both directions, and return whether the actuator is there."""
    middle = min(max(actuator.start, actuator.low + room), actuator.high - room)
    return middle == actuator.start or arrives(actuator, middle)


def judge_run(
    actuator: Actuator,
    told: str,
    message: FramedMessage,
    *,
    rate: float,
    least: int = 0,
    starts: str,
    lasts: str,
) -> None:
    """Start a motion that lasts until it is stopped, stop it, and judge both.

    :param least: the counts after which it is stopped at the earliest.
    :param starts: the rule of an actuator that does not move.
    :param lasts: the rule of a motion that ends by itself.
    """
    trial, text = actuator.trial, actuator.text
    far = max(least, round(rate * _SECONDS))
    room = far + round(rate * _SECONDS)
    if 2 * room > actuator.high - actuator.low:
        trial.inconclusive(
            f"{text}: {told} moves by up to {room} counts in an unknown direction until it is stopped; "
            f"allow a range of at least {2 * room} counts"
        )
        return
    if not goes_to_middle(actuator, room):
        return
    others, start = actuator.others(), actuator.position()
    seen = actuator.watch(
        told, message, start, room, rate, lambda at: abs(at - start) >= far, both_ways=True
    )
    cause = Cause(told.partition(" ")[0], EFFECT)
    if not seen.stopped:
        stayed = abs(seen.rest - start) <= actuator.family.tolerance
        what = "it did not move" if stayed else f"it ended by itself at {seen.rest}"
        trial.must(
            False,
            f"{text}: after {told} from {start}, {what}; it should move until it is stopped",
            rule=starts if stayed else lasts,
            cause=cause if stayed else Cause(cause.subject, "duration"),
        )
        return
    judge_others(actuator, seen, others)
    name = stop_of(actuator.place)
    if trial.must(
        seen.strayed is None,
        f"{text}: after {name} during {told} from {start}, it was still moving at {seen.strayed}; it should "
        "have stopped",
        rule="stop-any-move",
        cause=Cause(name, EFFECT),
    ):
        wanted = trial.declared.registry.messages[name]["exchange"]["completes_with"]
        judge_end(actuator, seen, tuple(wanted), "stop-completed")
