"""Judgement of a move: on its way, and after its end (sections 4, 9, 14 and 18)."""

from __future__ import annotations

from itertools import pairwise
from typing import Final

from stagewire_conformance.device.causes import EFFECT, Cause
from stagewire_conformance.device.checks.ms2000.motion.mover import (
    ARRIVED,
    COUNTS_PER_SPEED,
    TARGET,
    Mover,
    Sample,
)
from stagewire_ms2000.flags import StatusBits

_MOVED: Final = 20
"""Counts between two readings above which an axis has certainly moved."""
_FULL: Final = 0.9
"""The part of the highest speed from which an axis is not seen to ramp."""
_LOOKS: Final = 4
"""Readings within a ramp, so that at least one certainly shows it."""
_SPARE: Final = 1.05
"""The ratio to its maximum speed that an axis may report: a servo catches up."""
_TELLABLE: Final = 0x7FFF
"""The highest speed in a signed number of two bytes; a top speed may be higher."""
_SETTLED: Final = 0.3
"""Seconds within which the bits of an axis that is not busy must also show this."""
_PAUSE: Final = 0.02


def judge_course(mover: Mover, goal: int, samples: list[Sample]) -> None:
    """Compare the samples of a move with the document.

    :param goal: the target of the move.
    """
    trial, name = mover.trial, mover.name
    _judge_positions(mover, goal, samples)
    upwards = goal > samples[0].position
    way = f"axis {name} on its way {'up' if upwards else 'down'} to {goal}"
    for before, after in pairwise(samples):
        if abs(after.position - before.position) > _MOVED and after.busy:
            trial.must(
                before.status.motor_signal or after.status.motor_signal,
                f"{way} moved from {before.position} to {after.position}, but its status byte "
                f"is {int(after.status):#04x}, without bit 0, which means motion",
                came=bytes((int(after.status),)),
                rule="status-moving-bit",
                cause=Cause("status byte", "motion"),
            )
    if mover.top_speed > _TELLABLE:
        trial.info(f"{way} may be faster than {_TELLABLE} µm/s, which a reply cannot represent")
    else:
        _judge_speed(mover, way, upwards, samples)
    _judge_ramps(mover, way, samples)


def _judge_positions(mover: Mover, goal: int, samples: list[Sample]) -> None:
    """Report a position that is that of the target from the start, and end the check."""
    busy = [sample for sample in samples if sample.busy]
    mover.trial.need(
        len(busy) <= _LOOKS or any(abs(each.position - goal) > ARRIVED for each in busy),
        f"axis {mover.name} was busy for {len(busy)} readings on its way to {goal}, and all of them had this "
        "position; the position should follow the motion",
        rule="position-and-status-reply",
        cause=Cause("READ_MOTOR_POSITION", "position"),
    )


def _speed_of(samples: list[Sample]) -> float:
    """Return the highest speed in µm/s that the positions show; 0 if there are too few."""
    pairs = zip(samples, samples[_LOOKS:], strict=False)
    found = (
        abs(after.position - before.position) / max(after.time - before.time, 1e-3)
        for before, after in pairs
    )
    return max(found, default=0.0) / COUNTS_PER_SPEED


def _judge_speed(mover: Mover, way: str, upwards: bool, samples: list[Sample]) -> None:
    trial, fastest = mover.trial, max((sample.speed for sample in samples), key=abs)
    most = mover.top_speed * _SPARE + 1
    too_fast = _speed_of(samples) > most
    trial.must(
        abs(fastest) <= most,
        f"{way} reported a speed of {fastest} µm/s"
        + (", which its positions confirm" if too_fast else "")
        + f"; its maximum is {mover.top_speed}",
        rule="top-speed-limits-travel" if too_fast else "current-speed-reply",
        cause=Cause("WRITE_TOP_SPEED", EFFECT)
        if too_fast
        else Cause("READ_CURRENT_SPEED", "speed"),
        because=(Cause("WRITE_TOP_SPEED", EFFECT),),
    )
    if len(samples) > _LOOKS:
        trial.must(
            fastest > 0 if upwards else fastest < 0,
            f"{way} reported speeds up to {fastest} µm/s; the sign of the speed should be "
            "that of the direction",
            rule="current-speed-reply",
            cause=Cause("READ_CURRENT_SPEED", "sign"),
        )


def _judge_ramps(mover: Mover, way: str, samples: list[Sample]) -> None:
    """Check for both ramps, if the samples were close enough to show them."""
    begin, end = samples[0].position, samples[-1].position
    gaps = [after.time - before.time for before, after in pairwise(samples)]
    if len(samples) <= 2 * _LOOKS or max(gaps) * _LOOKS > mover.ramp_time / 1000:
        mover.trial.info(f"{way} was read too rarely to show its ramps")
        return
    middle = (begin + end) / 2
    first = [each for each in samples if abs(each.position - begin) < abs(middle - begin)]
    second = [each for each in samples[:-1] if abs(each.position - end) < abs(middle - end)]
    full = _FULL * max(abs(each.speed) for each in samples)
    missing, shown = [], []
    for half, down in ((first, False), (second, True)):
        if all(abs(each.speed) >= full for each in half):
            mover.trial.info(f"{way} was at full speed in all readings of one half")
            continue
        all_bits = [each.status for each in half]
        ramping = [bits for bits in all_bits if bits.ramping and bits.motor_signal]
        if not any(bits.ramping_down is down for bits in ramping):
            missing.append(
                "ramping down in the second half (bits 4 and 5)"
                if down
                else "ramping up in the first half (bit 4)"
            )
            shown += all_bits
    mover.trial.must(
        not missing,
        f"{way} did not report {' and '.join(missing)}; the status bytes were {_hex(shown)}",
        came=bytes(map(int, shown)),
        rule="status-ramping-bits",
        cause=Cause("status byte", "ramping"),
        because=(Cause("status byte", "motion"),),
    )


def judge_rest(mover: Mover, goal: int) -> None:
    """Check that an axis that is no longer busy is at its target, and reports no motion.

    Its bits and its speed may be late. Its letter may not: a host that relies on it would find the axis
    elsewhere.
    """
    trial, name = mover.trial, mover.name
    end = mover.line.now + _SETTLED
    first = sample = mover.sample()
    if not first.busy and abs(first.position - goal) > ARRIVED:
        mover.line.listen(_PAUSE)
        sample = mover.sample()
        trial.need(
            abs(sample.position - first.position) <= _MOVED,
            f"READ_STATUS of axis {name} returned b at {first.position}, but the axis moved on to "
            f"{sample.position}; it should be busy until it is at its target",
            wanted=b"B",
            came=b"b",
            rule="status-busy",
            cause=Cause("READ_STATUS", "busy"),
        )
    while mover.line.now < end and _is_moving(sample):
        mover.line.listen(_PAUSE)
        sample = mover.sample()
    over = f"axis {name} is no longer busy, but"
    trial.must(
        not sample.busy,
        f"axis {name} is busy again without a command",
        rule="status-not-busy",
        cause=Cause("READ_STATUS", "busy at rest"),
    )
    ends = first.status.upper_limit or first.status.lower_limit
    trial.must(
        abs(first.position - goal) <= ARRIVED,
        f"{over} is at {first.position}; its target was {goal}"
        + (
            f" (a limit switch is closed: is {mover.low}..{mover.high} within its travel?)"
            if ends
            else ""
        ),
        rule="target-moves",
        cause=TARGET,
    )
    told = f"{over} its status byte is {int(sample.status):#04x}"
    byte = bytes((int(sample.status),))
    trial.must(
        not sample.status.motor_signal,
        f"{told}, with bit 0, which means motion",
        came=byte,
        rule="status-moving-bit",
        cause=Cause("status byte", "motion at rest"),
    )
    trial.must(
        not sample.status.ramping,
        f"{told}, with bit 4, which means ramping",
        came=byte,
        rule="status-ramping-bits",
        cause=Cause("status byte", "ramping at rest"),
    )
    trial.must(
        sample.speed == 0,
        f"{over} READ_CURRENT_SPEED returned {sample.speed} µm/s",
        rule="current-speed-reply",
        cause=Cause("READ_CURRENT_SPEED", "speed at rest"),
    )
    trial.must(
        mover.target == goal,
        f"{over} READ_TARGET_POSITION returned {mover.target} instead of {goal}",
        rule="target-reply",
        cause=Cause("READ_TARGET_POSITION", "target"),
    )


def _is_moving(sample: Sample) -> bool:
    return bool(sample.status.motor_signal or sample.status.ramping or sample.speed)


def _hex(all_bits: list[StatusBits]) -> str:
    return bytes(map(int, all_bits)).hex(" ")
