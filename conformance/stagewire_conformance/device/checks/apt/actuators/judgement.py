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
_FOR_ALL: Final = "PZMOT_MOVE_STOPPED"
"""The message that the simulated KIM101 of the vendor sends for all channels when one is stopped."""
_SLACK: Final = 0.3
"""Seconds that a motion may take longer, to speed up and to report its end."""


def judge_target(actuator: Actuator, seen: Motion, target: int, rule: str, due: str = "") -> bool:
    """Report a motion that did not end at its target; return whether it did."""
    where = f"it is at {seen.rest}"
    if seen.strayed is not None and abs(seen.strayed - target) > actuator.family.tolerance:
        where = f"it did not stop by itself; the suite stopped it at {seen.strayed}"
    if seen.rest == seen.start:
        where = "it did not move"
    return actuator.trial.must(
        abs(seen.rest - target) <= actuator.family.tolerance,
        f"{actuator.text}: after {seen.told} from {seen.start}, {where}; "
        f"{due or f'it should be at {target}'}",
        rule=rule,
        cause=Cause(seen.told.partition(" ")[0], EFFECT),
    )


def judge_end(actuator: Actuator, seen: Motion, wanted: tuple[str, ...], rule: str) -> bool:
    """Report a motion whose end was not reported once, by its own channel, at rest and with its position.

    Return whether it was reported so.

    :param wanted: the messages of which one reports the end.
    """
    names = " or ".join(wanted)
    own = [each for each in seen.ends if each.name in wanted]
    of_others = [each for each in own if each.channel not in (actuator.channel, None)]
    trial = actuator.trial
    for each in of_others:
        if each.name == _FOR_ALL:
            trial.info(
                f"{actuator.text}: after {seen.told}, {each.name} also came for channel {each.channel}, as "
                "from the simulated KIM101 of the vendor"
            )
            continue
        trial.must(
            False,
            f"{actuator.text}: after {seen.told}, {each.name} names channel {each.channel} instead of "
            f"{actuator.channel}",
            rule=actuator.family.rules.channel,
            cause=Cause(each.name, CHANNEL),
            came=each.raw,
        )
    strange = any(each.name != _FOR_ALL for each in of_others)
    own = [each for each in own if each not in of_others]
    if not own and strange:
        return False
    right = trial.must(
        len(own) == 1,
        f"{actuator.text}: {seen.told} was reported by {names} {len(own)} times; it should be once, when the "
        "motion ends",
        rule=rule,
        cause=Cause(wanted[0], DELIVERY),
        because=(Cause(seen.told.partition(" ")[0], EFFECT),),
    )
    for each in own:
        told = getattr(each.message, "abs_position", getattr(each.message, "position", seen.rest))
        right &= trial.must(
            abs(told - seen.rest) <= actuator.family.tolerance,
            f"{actuator.text}: after {seen.told}, {each.name} reports the position {told}, but it is at "
            f"{seen.rest}",
            rule=rule,
            cause=Cause(each.name, "position"),
            came=each.raw,
        )
    if own and right and seen.then is not None:
        right = trial.must(
            abs(seen.then - seen.rest) <= actuator.family.tolerance,
            f"{actuator.text}: after {seen.told}, {own[0].name} came at {seen.then}, before it rested at "
            f"{seen.rest}; it should come when the motion ends",
            rule=rule,
            cause=Cause(own[0].name, "time"),
            came=own[0].raw,
        )
    return right and not strange


def judge_others(actuator: Actuator, seen: Motion, before: Mapping[int, int]) -> None:
    """Report the other channels that a command has moved."""
    for channel, now in actuator.others().items():
        actuator.trial.must(
            abs(now - before[channel]) <= actuator.family.tolerance,
            f"{actuator.text}: {seen.told} also moved channel {channel}, from {before[channel]} to {now}",
            rule=actuator.family.rules.channel,
            cause=Cause(seen.told.partition(" ")[0], "another channel"),
        )


def judge_pace(actuator: Actuator, seen: Motion, rate: float) -> None:
    """Report a motion that is much faster or slower than its parameters say.

    Only a motion whose end was reported correctly can be measured.
    """
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


def judge_motion(
    actuator: Actuator,
    seen: Motion,
    target: int,
    others: Mapping[int, int],
    rate: float,
    *,
    rule: str = "",
    end: str = "",
    due: str = "",
) -> bool:
    """Judge a motion to a target, its end and its velocity, and return whether it arrived.

    :param rule: the rule about the target; by default that of a move.
    :param end: the rule about the message at its end; by default that of a move.
    :param due: describes where it should be, if that is not only the target.
    """
    rules = actuator.family.rules
    arrived = judge_target(actuator, seen, target, rule or rules.move, due)
    judge_others(actuator, seen, others)
    if arrived and judge_end(actuator, seen, (actuator.family.completed,), end or rules.ends):
        judge_pace(actuator, seen, rate)
    return arrived


def arrives(actuator: Actuator, target: int) -> bool:
    """Move to a position before what is checked, and return whether the actuator is there."""
    return judge_target(actuator, actuator.move(target), target, actuator.family.rules.move)


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
        because=(Cause(actuator.status, DELIVERY),),
    )
    actuator.trial.must(
        not actuator.reports_motion(),
        f"{actuator.text} rests at {seen.rest} after {seen.told}, but its status reports motion",
        rule=rule,
        cause=Cause("status", MOTION_AT_REST),
    )
