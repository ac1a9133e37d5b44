"""What is to be said of a motion: how it ended, what it said of itself meanwhile, and where it is."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from stagewire_apt.enumerations import MoveDirection
from stagewire_conformance.device.checks.apt.motion.axis import HELD, Axis, Status
from stagewire_conformance.device.checks.apt.motion.pace import status_velocity
from stagewire_conformance.device.checks.apt.motion.watch import Watched
from stagewire_conformance.device.checks.apt.replies import judge_message, judge_unasked
from stagewire_conformance.device.checks.apt.wording import raw_of

if TYPE_CHECKING:
    from stagewire_conformance.device.lines.dialogue import Incoming


_TELLING_SPEED = 3.0
"""A velocity as it is told that has to be told as more than 0."""
_LATE = 0.1
"""Seconds after the first look in which the bits of motion may still be missing."""
_SETTLES = 0.12
"""Seconds for which bits of motion may stay when the end was told."""
_WAYS = {
    MoveDirection.FORWARD: "forward",
    MoveDirection.REVERSE: "in reverse",
    None: "forward or in reverse",
}
"""A direction in sentences; None is one that is not known."""

_MIDWAY = 20
"""A motor is on its way while it is a twentieth of it from both ends."""


def judge_end(axis: Axis, told: str, seen: Watched, wanted: str) -> Incoming | None:
    """Say how a motion ended, and return the message that told it; a motor that did not end is stopped.

    :param told: what it was told, for sentences: ``MOT_MOVE_ABSOLUTE to 1000``.
    :param wanted: the message that has to tell the end, once.
    """
    trial = axis.trial
    for other in seen.others:
        judge_unasked(trial, other, f"after {told} at {axis.text}")
    if seen.strayed is not None:
        trial.must(
            False,
            f"{axis.text}: after {told} it was at {seen.strayed.position}, outside of "
            f"{axis.low}..{axis.high} or further than it should have gone; it was called back",
            came=seen.strayed.heard.raw,
        )
        return None
    if not seen.ends:
        last = seen.statuses[-1] if seen.statuses else None
        says = f"; it is at {last.position} and says {_names(last)}" if last else ""
        axis.halt()
        trial.must(
            False,
            f"{axis.text}: after {told} no {wanted} came within {seen.seconds:.1f} s{says}; it was stopped",
        )
        return None
    first, *more = seen.ends
    ours = next((end for end in seen.ends if end.name == wanted and _is_of(axis, end)), first)
    trial.must(
        ours.name == wanted,
        f"{axis.text}: after {told} there came {ours.name}; it should be {wanted}",
        came=ours.raw,
    )
    trial.must(
        not more,
        f"{axis.text}: after {told} there came {len(seen.ends)} end messages ("
        f"{', '.join(f'{end.name} from {end.source:#04x}' for end in seen.ends)}); it should be one",
        came=raw_of(seen.ends),
    )
    judge_message(trial, axis.place, axis.channel, ours)
    if ours.name != "MOT_MOVE_HOMED":
        _judge_status_of_end(axis, told, ours)
    return ours


def _judge_status_of_end(axis: Axis, told: str, end: Incoming) -> None:
    trial = axis.trial
    if not trial.should(
        hasattr(end.message, "status_bits"),
        f"{axis.text}: {end.name} after {told} is a header alone; 14 bytes of status should follow",
        came=end.raw,
    ):
        return
    status = axis.status_of(end)
    trial.should(  # controllers are known that send the bits of an instant before
        not status.moving,
        f"{axis.text}: {end.name} after {told} says {_names(status)}; at its end nothing should be moving",
        came=end.raw,
    )
    if axis.settle_time is not None and end.name == "MOT_MOVE_COMPLETED":
        # page 66: with a settle time of 0 a move is complete wherever it is
        (trial.must if axis.settle_time else trial.should)(
            status.bits.settled,
            f"{axis.text}: {end.name} after {told} says {_names(status)}; a move is complete when the "
            "axis has settled",
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
    """Say what is wrong with what a motor said of itself on its way.

    :param direction: what it was told, which its bits have to say; None: it was told a position or a
        distance. Then they may say either, because no page says in which direction positions rise, but they
        have to say the same of every motion to higher positions, and the other of those to lower ones.
    :param jogging: its bits have to say that it jogs.
    """
    low, high = min(start, target), max(start, target)
    edge = max(1, (high - low) // _MIDWAY)
    way, towards = (1, "up") if target > start else (-1, "down")
    midway = [status for status in statuses if low + edge < status.position < high - edge]
    _judge_velocity(axis, told, midway)
    for status in _without_late_ones(statuses, midway):
        says = (
            f"{axis.text}: on its way {towards} after {told}, at {status.position}, {status.heard.name} "
            f"says {_names(status)}"
        )
        expected = direction or axis.direction_of(way)
        named = _WAYS[expected]
        if not axis.trial.must(
            status.direction is not None and expected in (None, status.direction),
            f"{says}; it should say that it moves {named}",
            came=status.heard.raw,
        ):
            return
        assert status.direction is not None
        axis.learn(way, status.direction)
        bits = status.bits
        if axis.settle_time is not None and not axis.trial.must(
            not bits.settled,
            f"{axis.text}: on its way after {told}, {status.heard.name} says {_names(status)}; it is "
            "settled at rest only",
            came=status.heard.raw,
        ):
            return
        jogs = getattr(bits, f"jogging_{status.direction.name.lower()}")
        if jogging and not axis.trial.must(
            jogs, f"{says}; it should say that it jogs {named}", came=status.heard.raw
        ):
            return


def _without_late_ones(statuses: Sequence[Status], midway: Sequence[Status]) -> Sequence[Status]:
    """Leave out what was said so early that bits of motion may still be missing."""
    return [status for status in midway if status.moving or status.time - statuses[0].time >= _LATE]


def _judge_velocity(axis: Axis, told: str, midway: Sequence[Status]) -> None:
    """Say what is wrong with the velocity that a motor told on its way (page 79).

    Whether it has a sign is not judged: the page prints a word. Without a scale one that is always 0 is not
    strict, since nobody knows how little that may be.
    """
    if len(midway) < 2 or midway[0].velocity is None:
        return
    first, last = midway[0], midway[-1]
    seconds = max(last.time - first.time, 1e-3)
    speed = abs(last.position - first.position) / seconds
    unit = status_velocity(axis.place, axis.channel)
    told_speeds = [abs(status.velocity or 0) for status in midway]
    if speed / (unit or 1.0) >= _TELLING_SPEED:
        (axis.trial.must if unit else axis.trial.should)(
            any(told_speeds),
            f"{axis.text}: on its way after {told} it went {speed:.0f} counts/s, and {last.heard.name} "
            "went on to say a velocity of 0",
            came=last.heard.raw,
        )
    if unit and axis.pace.known:
        most = 1.5 * axis.pace.velocity / unit + _TELLING_SPEED
        axis.trial.must(
            max(told_speeds) <= most,
            f"{axis.text}: on its way after {told}, {last.heard.name} said a velocity of "
            f"{max(told_speeds)}; its velocity parameters allow {axis.pace.velocity / unit:.0f}",
            came=last.heard.raw,
        )


def judge_rest(axis: Axis, told: str, end: Incoming | None = None) -> Status:
    """Say what is wrong with what a motor says of itself after it has ended, and return it.

    :param end: the message that told the end; what it said has to hold still.
    """
    axis.pause(_SETTLES)
    status = axis.status()  # once: a status that is one behind is right when it is asked again
    axis.trial.must(
        not status.moving,
        f"{axis.text}: {told} has ended, and {status.heard.name} says {_names(status)}; it should say that "
        f"nothing moves",
        came=status.heard.raw,
    )
    position: int | None = getattr(end.message, "position", None) if end else None
    axis.trial.must(
        position is None or abs(position - status.position) <= HELD,
        f"{axis.text}: after {told} {end.name if end else ''} said that it is at {position}, and "
        f"{status.heard.name} then says {status.position}",
        came=end.raw if end else None,
    )
    return status


def judge_place(axis: Axis, told: str, status: Status, start: int, target: int) -> bool:
    """Say whether a motor is where it was told to go."""
    missed = status.position - target
    bits = status.bits
    limit = bits.forward_hardware_limit or bits.reverse_hardware_limit
    hint = " (a limit switch is active: does the range lie within the travel?)" if limit else ""
    return axis.trial.must(
        abs(missed) <= axis.tolerance(target - start),
        f"{axis.text}: after {told} it is at {status.position}; from {start} it should have gone to "
        f"{target}{hint}",
        came=status.heard.raw,
    )


def _is_of(axis: Axis, end: Incoming) -> bool:
    return end.source == axis.place.address and end.channel == axis.channel


def _names(status: Status) -> str:
    """Return the bits of a status that are set, by name."""
    bits: Any = status.bits
    return ", ".join(name for name in type(bits).bits if getattr(bits, name)) or "no bit"
