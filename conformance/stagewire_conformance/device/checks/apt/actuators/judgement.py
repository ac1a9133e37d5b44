"""Judgement of a motion of an actuator: its end, its target, its velocity, and the other channels."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Final

from stagewire_conformance.device.causes import CHANNEL, DELIVERY, EFFECT, MOTION_AT_REST, Cause

if TYPE_CHECKING:
    from stagewire_conformance.device.checks.apt.actuators.actuator import Actuator, Motion

_MEASURABLE: Final = 0.3
"""Seconds of the shortest motion whose velocity is judged."""
_FACTOR: Final = 2
"""The ratio up to which a duration may differ from that of the velocity that is set."""
_SLACK: Final = 0.3
"""Seconds that a motion may take longer, to speed up and to report its end."""


def judge_target(actuator: Actuator, seen: Motion, target: int, rule: str) -> bool:
    """Report a motion that did not end at its target; return whether it did."""
    left = seen.strayed is not None and abs(seen.strayed - target) > actuator.family.tolerance
    why = f", where it was stopped after it was at {seen.strayed}" if left else ""
    return actuator.trial.must(
        abs(seen.rest - target) <= actuator.family.tolerance,
        f"{actuator.text}: after {seen.told} from {seen.start}, it is at {seen.rest}{why}; it should be at "
        f"{target}",
        rule=rule,
        cause=Cause(seen.told.partition(" ")[0], EFFECT),
    )


def judge_end(actuator: Actuator, seen: Motion, wanted: tuple[str, ...], rule: str) -> None:
    """Report a motion whose end was not reported once, by its own channel, and with its position.

    :param wanted: the messages of which one reports the end.
    """
    names = " or ".join(wanted)
    own = [each for each in seen.ends if each.name in wanted]
    of_others = [each for each in own if each.channel not in (actuator.channel, None)]
    trial = actuator.trial
    for each in of_others:
        trial.must(
            False,
            f"{actuator.text}: after {seen.told}, {each.name} names channel {each.channel} instead of "
            f"{actuator.channel}",
            rule=actuator.family.rules.channel,
            cause=Cause(each.name, CHANNEL),
            came=each.raw,
        )
    own = [each for each in own if each not in of_others]
    if not own and of_others:
        return
    trial.must(
        len(own) == 1,
        f"{actuator.text}: {seen.told} was reported by {names} {len(own)} times; it should be once, when the "
        "motion ends",
        rule=rule,
        cause=Cause(wanted[0], DELIVERY),
        because=(Cause(seen.told.partition(" ")[0], EFFECT),),
    )
    for each in own:
        told = getattr(each.message, "abs_position", getattr(each.message, "position", seen.rest))
        trial.must(
            abs(told - seen.rest) <= actuator.family.tolerance,
            f"{actuator.text}: after {seen.told}, {each.name} reports the position {told}, but it is at "
            f"{seen.rest}",
            rule=rule,
            cause=Cause(each.name, "position"),
            came=each.raw,
        )


def judge_others(actuator: Actuator, seen: Motion, before: Mapping[int, int]) -> None:
    """Report the other channels that a command has moved."""
    for channel, now in actuator.others().items():
        actuator.trial.must(
            abs(now - before[channel]) <= actuator.family.tolerance,
            f"{seen.told} to {actuator.text} also moved channel {channel}, from {before[channel]} to {now}",
            rule=actuator.family.rules.channel,
            cause=Cause(seen.told.partition(" ")[0], "another channel"),
        )


def judge_pace(actuator: Actuator, seen: Motion, rate: float) -> None:
    """Report a motion that is much faster or slower than its parameters say."""
    rule = actuator.family.rules.pace
    due = abs(seen.rest - seen.start) / max(rate, 1e-9)
    if not rule or due < _MEASURABLE:
        return
    actuator.trial.must(
        due / _FACTOR <= seen.seconds <= _FACTOR * due + _SLACK,
        f"{actuator.text}: {seen.told} from {seen.start} took {seen.seconds:.2f} s; at {rate:.0f} counts/s, "
        f"which are set, it should take about {due:.2f} s",
        rule=rule,
        cause=Cause(seen.told.partition(" ")[0], "pace"),
    )


def judge_bits(actuator: Actuator, seen: Motion) -> None:
    """Report a status without motion bits during a motion, or with them at rest."""
    if seen.moved is None:
        return
    rule = actuator.family.rules.bits
    actuator.trial.must(
        seen.moved,
        f"{actuator.text}: its position changed after {seen.told}, but its status did not report motion",
        rule=rule,
        cause=Cause("status", "motion bits"),
    )
    actuator.trial.must(
        not actuator.reports_motion(),
        f"{actuator.text} rests at {seen.rest} after {seen.told}, but its status reports motion",
        rule=rule,
        cause=Cause("status", MOTION_AT_REST),
    )
