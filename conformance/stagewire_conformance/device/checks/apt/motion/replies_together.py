"""Other replies of a motor, compared with its status.

They are the bits alone (page 81), the position counter (page 28) and the encoder counter (page 29). Each is
read between two statuses, so that it can be compared while the motor moves.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from stagewire_apt import messages as m
from stagewire_apt.flags import DcStatusBits
from stagewire_conformance.device.causes import EFFECT, Cause
from stagewire_conformance.device.checks.apt.broken_rules import rule_of_status
from stagewire_conformance.device.checks.apt.motion.axis import HELD, JITTER, Axis, Status
from stagewire_conformance.device.lines.motions import reports_motion

if TYPE_CHECKING:
    from stagewire_conformance.device.lines.dialogue import Incoming

_BITS: Final = "MOT_REQ_STATUSBITS"
_COUNTER: Final = "MOT_REQ_POSCOUNTER"
_ENCODER: Final = "MOT_REQ_ENCCOUNTER"
_TRIES: Final = 3
"""The number of comparisons that must all fail."""


def judge_bits_alone(axis: Axis, when: str) -> bool:
    """Report MOT_GET_STATUSBITS with other bits than the status; return whether they agree.

    Only bits that are the same in the statuses before and after it are compared. A bit that differs once may
    have changed in between.

    :param when: the situation, for sentences: ``after MOT_MOVE_HOME``.
    """
    if _BITS not in axis.place.messages:
        return True
    for _ in range(_TRIES):
        before = axis.status()
        alone = axis.ask(m.MotReqStatusBits(axis.channel))
        after = axis.status()
        wrong = _differing(before, after, int(alone.message.status_bits))
        if not wrong:
            return True
    return axis.trial.must(
        False,
        f"{axis.text}: {when}, {alone.name} has {', '.join(wrong)}, unlike {after.heard.name} before and "
        "after it; both should report the same bits",
        rule="status-bits-same",
        cause=Cause(alone.name, "status_bits"),
        came=alone.raw,
    )


def judge_fresh_bits(axis: Axis, when: str) -> None:
    """Report MOT_GET_STATUSBITS of a moving motor that still has the bits of its last status, from rest.

    :param when: the situation; the motor must have been commanded to move long enough before.
    """
    if _BITS not in axis.place.messages:
        return
    alone = axis.ask(m.MotReqStatusBits(axis.channel))
    after = axis.status()
    bits = int(alone.message.status_bits)
    axis.trial.must(
        not after.moving or reports_motion(DcStatusBits(bits)),
        f"{axis.text}: {when}, {alone.name} reports no motion, but {after.heard.name} after it does; both "
        "should report the same bits",
        rule="status-bits-same",
        cause=Cause(alone.name, "status_bits"),
        came=alone.raw,
    )


def _differing(before: Status, after: Status, bits: int) -> list[str]:
    """Return the bits that differ, such as ``homed = 0``; a stepper has two tables of bits."""
    tables = (type(after.bits).bits, DcStatusBits.bits)
    shared = {name: bit for name, bit in tables[0].items() if tables[1].get(name) == bit}
    return [
        f"{name} = {bool(bits & mask):d}"
        for name, mask in shared.items()
        if bool(bits & mask) != getattr(after.bits, name) == getattr(before.bits, name)
    ]


def judge_counter(axis: Axis, when: str, before: Status, ends: tuple[int, int]) -> bool:
    """Report a position counter that differs from the status; return whether they agree.

    If the status stays at one end of the motion while the motor moves, the status is wrong.

    :param before: a status that has just been read.
    :param ends: the positions at which the motion begins and ends.
    """
    if _COUNTER not in axis.place.messages:
        return True
    counter = axis.ask(m.MotReqPosCounter(axis.channel))
    after = axis.status()
    low, high = sorted((before.position, after.position))
    position: int = counter.message.position
    margin = HELD + (high - low) // 2
    stays = before.moving and any(
        abs(before.position - end) <= JITTER >= abs(after.position - end) for end in ends
    )
    return axis.trial.must(
        low - margin <= position <= high + margin,
        f"{axis.text}: {when}, {counter.name} has {position}, but {after.heard.name}, read before and "
        f"after it, has {before.position} and {after.position}; "
        + ("the position should follow the motion" if stays else "both should have the same count"),
        rule=rule_of_status(axis.place, "position") if stays else "position-counter-absolute",
        cause=Cause(after.heard.name if stays else counter.name, "position"),
        because=(Cause("MOT_SET_POSCOUNTER", EFFECT), Cause(counter.name, "position")),
        came=after.heard.raw if stays else counter.raw,
    )


@dataclass(frozen=True)
class _Reading:
    """An encoder count, and the positions that were read before and after it."""

    before: int
    came: Incoming
    after: int

    @property
    def count(self) -> int:
        """The encoder count."""
        count: int = self.came.message.encoder_count
        return count


class EncoderReadings:
    """Encoder counts of a motor, from the beginning of a motion to its end.

    No page states the ratio of encoder counts to positions, nor which stages have an encoder. So the count
    only has to change along with the position, if it changes with the motion at all.
    """

    def __init__(self, axis: Axis) -> None:
        self._axis = axis
        self._readings: list[_Reading] = []
        self.read()

    def read(self) -> None:
        """Read the count, if it is claimed."""
        axis = self._axis
        if _ENCODER in axis.place.messages:
            before = axis.status().position
            came = axis.ask(m.MotReqEncCounter(axis.channel))
            self._readings.append(_Reading(before, came, axis.status().position))

    def judge(self, when: str) -> None:
        """Report a count that did not follow the motion, which has ended. A wrong count is NON-STRICT.

        Page 29 states for the encoder counter what page 28 states for the position counter, and names the
        position counter.
        """
        if len(self._readings) < 2:
            return
        self.read()
        first, *on_the_way, last = self._readings
        ratio = (last.count - first.count) / ((last.after - first.before) or 1)
        if abs(last.count - first.count) <= HELD:
            return
        for each in on_the_way:
            low, high = sorted((each.before, each.after))
            margin = HELD + (high - low) // 2
            place = first.before + (each.count - first.count) / ratio
            if not self._axis.trial.should(
                low - margin <= place <= high + margin,
                f"{self._axis.text}: {when}, between the positions {each.before} and {each.after}, "
                f"{each.came.name} has {each.count}; from {first.count} at {first.before} to {last.count} at "
                f"{last.after}, the count should follow the motion",
                rule="encoder-counter-after-homing",
                cause=Cause(each.came.name, "encoder_count"),
                because=self._axis.spoilt,
                came=each.came.raw,
            ):
                return
