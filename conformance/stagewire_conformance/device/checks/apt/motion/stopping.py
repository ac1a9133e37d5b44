"""The effect of a stop command: the motor slows down, comes to rest, and reports it only then.

A motor that ignores a stop may still arrive somewhere by itself, so its end message alone does not show that
it was stopped. Once a stop was ignored, no check starts a motion that only a stop ends.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from stagewire_apt.enumerations import StopMode
from stagewire_conformance.device.causes import EFFECT, Cause
from stagewire_conformance.device.checks.apt.motion.axis import HELD, HOMED, JITTER, Axis
from stagewire_conformance.device.checks.apt.motion.course import points_of, top_speed

if TYPE_CHECKING:
    from collections.abc import Sequence

    from stagewire_conformance.device.checks.apt.motion.watch import Watched

IGNORED: Final = Cause("MOT_MOVE_STOP", EFFECT)
"""The cause that a motor does not stop on command."""

_TELLING: Final = 50
"""Counts of motion after which the way a motor stops can be judged."""
_SLOWS: Final = 2
"""The maximum distance after a profiled stop, relative to the distance in which the motor sped up."""
_LATE: Final = 0.3
"""Seconds by which a stop may be late."""


def need_stops(axes: Sequence[Axis]) -> None:
    """End the check before a motion that only a stop ends, if a motor has ignored a stop."""
    axes[0].trial.depends_on(IGNORED)


def judge_stopping(
    axis: Axis,
    told: str,
    start: int,
    seen: Watched,
    mode: StopMode,
    *,
    endless: bool = False,
) -> bool:
    """Report a motor that ignores a stop, or reports it too early; return whether the motor is right.

    :param start: where the motion began.
    :param mode: how the motor was stopped.
    :param endless: whether only a stop ends the motion. Then the motor is stopped again.
    """
    stopped = seen.stopped
    if stopped is None or seen.halted is not None or not seen.ends:
        return True
    at = stopped.position if seen.stopped_at is None else seen.stopped_at
    status = axis.status()
    early = seen.after is not None and abs(status.position - seen.after) > HELD
    ends = [end.name for end in seen.ends]
    if early:
        status = axis.halt() if endless else axis.standing()
        ends += [heard.name for heard in axis.trial.line.listen(0)]
    end = seen.ends[0]
    if HOMED in ends:  # it counts from there now
        ignored = status.bits.homed and abs(status.position) <= HELD
        where = "to its home position"
    else:
        longest = HELD + int(_LATE * top_speed(points_of(seen.statuses)))
        if not early or mode is StopMode.PROFILED:  # otherwise, it should have stopped at once
            longest += _SLOWS * abs(at - start)
        ignored = abs(status.position - at) > longest
        where = f"to {status.position}"
    if ignored:
        return axis.trial.must(
            False,
            f"{axis.text}: {told} was sent when it was at {at}, but it moved {where}; it "
            "should have slowed down and stopped",
            rule="stop-any-move",
            cause=IGNORED,
            came=end.raw,
        )
    return axis.trial.must(
        not early,
        f"{axis.text}: after {told}, it sent {end.name} at {seen.after}, but moved on to {status.position}; "
        "it should report the end when it is at rest",
        rule="stop-completed",
        cause=Cause(end.name, "early"),
        came=end.raw,
    )


@dataclass(frozen=True)
class StoppedMotion:
    """A motion that was stopped.

    :param signed: the distance that the motor covered before the stop, with its sign.
    :param after: the distance that it covered after the stop.
    :param speeding: whether it was still speeding up, so that a profile slows it down over about the distance
        that it had covered.
    """

    signed: int
    after: int
    speeding: bool

    @property
    def gone(self) -> int:
        """The distance before the stop."""
        return abs(self.signed)


def judge_modes(
    axis: Axis, when: str, at_once: StoppedMotion, slowly: StoppedMotion, *, certain: bool = True
) -> None:
    """Report a profiled stop that is not slower than an immediate one.

    :param when: the motion, for sentences: ``" in MOT_MOVE_VELOCITY"``.
    :param certain: whether the mode of the command decides; otherwise a difference is NON-STRICT.
    """
    if slowly.gone < _TELLING:
        return
    certain &= slowly.speeding or at_once.after > slowly.after + HELD
    least = at_once.after + (slowly.gone // 8 if slowly.speeding else 0)
    during = "of speeding up" if slowly.speeding else "of motion"
    (axis.trial.must if certain else axis.trial.should)(
        slowly.after > least + JITTER,
        f"{axis.text}: MOT_MOVE_STOP with a profile{when} stopped after {slowly.after} counts, and the "
        f"immediate one after {at_once.after}; after {slowly.gone} counts {during}, a profiled "
        "stop should slow down gradually, and an immediate one should not",
        rule="stop-mode-values",
        cause=Cause("MOT_MOVE_STOP", f"mode{when}"),
        because=(Cause("MOT_MOVE_STOP", "mode"),),
    )
