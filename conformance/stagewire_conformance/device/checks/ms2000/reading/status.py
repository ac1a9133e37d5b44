"""An axis at rest: letter, bits, position and speed agree (sections 4, 8, 9 and 14)."""

from __future__ import annotations

from typing import Final, NamedTuple

from stagewire_conformance.device.causes import Cause
from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks.ms2000.axis import DITHER, Axis
from stagewire_conformance.device.checks.ms2000.axis_check import axis_check
from stagewire_ms2000 import messages as m
from stagewire_ms2000.flags import StatusBits

_SAMPLES: Final = 5
_APART: Final = 0.1
"""Seconds between two samples. A servo settles within the half second of all samples."""


class _Sample(NamedTuple):
    """The values of an axis at about one instant."""

    busy: bool
    position: int
    speed: int
    status: StatusBits
    position_with_status: int
    status_with_position: StatusBits


def _sample(axis: Axis) -> _Sample:
    both = axis.ask(m.ReadMotorPositionAndStatus(), quiet=0.0)
    assert isinstance(both, m.ReadMotorPositionAndStatusReply)
    told = both.position, StatusBits(both.status)
    return _Sample(axis.is_busy, axis.position, axis.speed, axis.status, *told)


KIND: Final = Kind(
    name="status",
    title="The status letter, status bits, position and speed of an axis at rest are consistent",
    rules=(
        "status-answered", "status-not-busy", "status-byte-reply", "status-moving-bit",
        "status-servo-bit", "status-ramping-bits", "status-limit-bits", "position-and-status-reply",
        "current-speed-reply",
    ),
)  # fmt: skip


@axis_check(
    KIND,
    "{axis} at rest reports its state consistently",
    messages=(
        "READ_STATUS", "READ_STATUS_BYTE", "READ_MOTOR_POSITION",
        "READ_MOTOR_POSITION_AND_STATUS", "READ_CURRENT_SPEED", "READ_TARGET_POSITION",
    ),
    seconds=0.5,
)  # fmt: skip
def _look(axis: Axis) -> None:
    samples = [_sample(axis)]
    while len(samples) < _SAMPLES:
        axis.line.listen(_APART)
        samples.append(_sample(axis))
    positions = [sample.position for sample in samples]
    way = max(positions) - min(positions)
    if way > DITHER and all(sample.busy for sample in samples):
        axis.trial.inconclusive(
            f"axis {axis.name} moved by {way} counts during the check (is somebody using "
            "the joystick?)"
        )
        return
    _bits(axis, samples)
    _speed(axis, samples)
    _agree(axis, samples[-1])
    _letter(axis, samples)


def _bits(axis: Axis, samples: list[_Sample]) -> None:
    """Check the bits of an axis at rest. A servo that settles may show some of them now and then."""
    for name, all_bits in (
        ("READ_STATUS_BYTE", [sample.status for sample in samples]),
        ("READ_MOTOR_POSITION_AND_STATUS", [sample.status_with_position for sample in samples]),
    ):
        last = all_bits[-1]
        told = f"axis {axis.name} at rest: {name} returned {int(last):#04x}"
        for holds, what, rule, about in (
            (
                all(bits.servo for bits in all_bits),
                "without bit 1, which is always set",
                "status-servo-bit",
                "servo bit",
            ),
            (
                not all(bits.motor_signal for bits in all_bits),
                "with bit 0, which means motion",
                "status-moving-bit",
                "motion at rest",
            ),
            (
                not all(bits.ramping for bits in all_bits),
                "with bit 4, which means ramping",
                "status-ramping-bits",
                "ramping at rest",
            ),
            (
                not all(bits.upper_limit and bits.lower_limit for bits in all_bits),
                "with bits 6 and 7, which mean both ends",
                "status-limit-bits",
                "both limit bits",
            ),
        ):
            axis.trial.must(
                holds,
                f"{told}, {what}",
                came=bytes((int(last),)),
                rule=rule,
                cause=Cause("status byte", about),
            )


def _speed(axis: Axis, samples: list[_Sample]) -> None:
    axis.trial.must(
        not all(sample.speed for sample in samples),
        f"axis {axis.name} is at rest at {samples[-1].position}, but READ_CURRENT_SPEED "
        f"returned {samples[-1].speed} µm/s",
        rule="current-speed-reply",
        cause=Cause("READ_CURRENT_SPEED", "speed at rest"),
    )


def _agree(axis: Axis, sample: _Sample) -> None:
    """Compare the two commands that return the status byte, and the two that return the position."""
    axis.trial.must(
        sample.status == sample.status_with_position,
        f"axis {axis.name} at rest: READ_STATUS_BYTE returned {int(sample.status):#04x}, but "
        f"READ_MOTOR_POSITION_AND_STATUS {int(sample.status_with_position):#04x}; the status "
        "byte should be the same",
        wanted=bytes((int(sample.status),)),
        came=bytes((int(sample.status_with_position),)),
        rule="position-and-status-reply",
        cause=Cause("READ_MOTOR_POSITION_AND_STATUS", "status"),
    )
    axis.trial.must(
        abs(sample.position - sample.position_with_status) <= DITHER,
        f"axis {axis.name} at rest: READ_MOTOR_POSITION returned {sample.position}, but "
        f"READ_MOTOR_POSITION_AND_STATUS {sample.position_with_status}",
        rule="position-and-status-reply",
        cause=Cause("READ_MOTOR_POSITION_AND_STATUS", "position"),
    )


def _letter(axis: Axis, samples: list[_Sample]) -> None:
    """Check that the axis is not busy, unless it is disabled away from its target (section 16)."""
    if not all(sample.busy for sample in samples):
        return
    target, position = axis.target, samples[-1].position
    told = (
        f"axis {axis.name} has been at {position} for {_SAMPLES * _APART:.1f} s, with the "
        f"target {target}"
    )
    if axis.trial.must(
        abs(target - position) > DITHER,
        f"{told}, but READ_STATUS returned B",
        wanted=b"b",
        came=b"B",
        rule="status-not-busy",
        cause=Cause("READ_STATUS", "busy at rest"),
    ):
        axis.trial.info(f"{told}, and is busy: disabled, with firmware before 3.3")
