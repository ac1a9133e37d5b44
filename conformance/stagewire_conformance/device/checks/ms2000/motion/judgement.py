"""What has to hold of a move: while it goes on, and when it is over (sections 4, 9, 14 and 18)."""

from __future__ import annotations

from itertools import pairwise
from typing import Final

from stagewire_conformance.device.checks.ms2000.motion.mover import ARRIVED, Mover, Sample
from stagewire_ms2000.flags import StatusBits

_MOVED: Final = 20
"""Counts between two looks by which an axis has certainly moved."""
_LOOKS: Final = 4
"""Looks within a ramp, so that one of them has certainly seen it."""
_SPARE: Final = 1.05
"""How much faster than its maximum an axis may tell that it is: a servo makes up for what it has lost."""
_TELLABLE: Final = 0x7FFF
"""The highest speed that a signed number of two bytes holds; a top speed may be higher."""
_SETTLED: Final = 0.3
"""Seconds in which the bits of an axis that is not busy have to say so, too."""
_PAUSE: Final = 0.02


def judge_course(mover: Mover, goal: int, samples: list[Sample]) -> None:
    """Hold what an axis said during a move, sample by sample, against the document.

    :param goal: where it went.
    """
    trial, name = mover.trial, mover.name
    upwards = goal > samples[0].position
    way = f"axis {name} on its way {'up' if upwards else 'down'} to {goal}"
    for before, after in pairwise(samples):
        if abs(after.position - before.position) > _MOVED and after.busy:
            trial.must(
                before.status.motor_signal or after.status.motor_signal,
                f"{way} went from {before.position} to {after.position}, and its status byte tells "
                f"{int(after.status):#04x}, without bit 0: it does not move",
                came=bytes((int(after.status),)),
            )
    if mover.top_speed > _TELLABLE:
        trial.info(f"{way} may be faster than {_TELLABLE} µm/s, which no reply can tell")
    else:
        _judge_speed(mover, way, upwards, samples)
    _judge_ramps(mover, way, samples)


def _judge_speed(mover: Mover, way: str, upwards: bool, samples: list[Sample]) -> None:
    trial, fastest = mover.trial, max((sample.speed for sample in samples), key=abs)
    trial.must(
        abs(fastest) <= mover.top_speed * _SPARE + 1,
        f"{way} told a speed of {fastest} µm/s; its maximum is {mover.top_speed}",
    )
    if len(samples) > _LOOKS:
        trial.must(
            fastest > 0 if upwards else fastest < 0,
            f"{way} told the speed {fastest} µm/s at most; a speed has the sign of its way",
        )


def _judge_ramps(mover: Mover, way: str, samples: list[Sample]) -> None:
    """Look for both ramps, where the looks were so close that none could be missed."""
    begin, end = samples[0].position, samples[-1].position
    gaps = [after.time - before.time for before, after in pairwise(samples)]
    if len(samples) <= 2 * _LOOKS or max(gaps) * _LOOKS > mover.ramp_time / 1000:
        mover.trial.info(f"{way} was looked at too rarely to see its ramps")
        return
    middle = (begin + end) / 2
    first = [each.status for each in samples if abs(each.position - begin) < abs(middle - begin)]
    second = [each.status for each in samples[:-1] if abs(each.position - end) < abs(middle - end)]
    for half, down in ((first, False), (second, True)):
        ramping = [bits for bits in half if bits.ramping and bits.motor_signal]
        which = (
            "second half: ramping down (bits 4 and 5)" if down else "first half: ramping up (bit 4)"
        )
        mover.trial.must(
            any(bits.ramping_down is down for bits in ramping),
            f"{way} never told in its {which}; the bytes were {_hex(half)}",
            came=bytes(map(int, half)),
        )


def judge_rest(mover: Mover, goal: int) -> None:
    """See that an axis that is not busy any more is at its target, and that nothing says that it moves.

    Its bits and its speed may be late; a host that goes on finds the axis elsewhere if its letter is early.
    """
    trial, name = mover.trial, mover.name
    end = mover.line.now + _SETTLED
    first = sample = mover.sample()
    while mover.line.now < end and _is_moving(sample):
        mover.line.listen(_PAUSE)
        sample = mover.sample()
    over = f"axis {name} is not busy any more, and"
    trial.must(
        not sample.busy, f"axis {name} was not busy, and is busy again, and nothing was sent"
    )
    ends = first.status.upper_limit or first.status.lower_limit
    trial.must(
        abs(first.position - goal) <= ARRIVED,
        f"{over} it is at {first.position}; its target was {goal}"
        + (
            f" (a limit switch is closed: is {mover.low}..{mover.high} within its travel?)"
            if ends
            else ""
        ),
    )
    told = f"{over} its status byte tells {int(sample.status):#04x}"
    byte = bytes((int(sample.status),))
    trial.must(not sample.status.motor_signal, f"{told}, with bit 0: it moves", came=byte)
    trial.must(not sample.status.ramping, f"{told}, with bit 4: it ramps", came=byte)
    trial.must(sample.speed == 0, f"{over} READ_CURRENT_SPEED tells {sample.speed} µm/s")
    trial.must(
        mover.target == goal, f"{over} READ_TARGET_POSITION tells {mover.target}, not {goal}"
    )


def _is_moving(sample: Sample) -> bool:
    return bool(sample.status.motor_signal or sample.status.ramping or sample.speed)


def _hex(all_bits: list[StatusBits]) -> str:
    return bytes(map(int, all_bits)).hex(" ")
