"""The speed of a motor in counts, from the velocity and acceleration that the controller reports."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import TYPE_CHECKING, Final

from stagewire.errors import UnknownScaleError
from stagewire.quantities import ScaleConflict
from stagewire_apt import messages as m
from stagewire_conformance.device.trial import NotRunError

if TYPE_CHECKING:
    from stagewire.devices import Scales
    from stagewire.quantities import Scale
    from stagewire_conformance.device.targets import Target
    from stagewire_conformance.device.trial import Trial


_PATIENCE: Final = 5.0
"""Seconds that a move may take beyond twice its expected time."""
LONGEST: Final = 30.0
"""The most seconds that a motion may take; homing has its own bound."""
_LEAST: Final = 10.0
"""The least velocity in counts/s of a motion that is started: a slower one looks like rest."""
_EXPECTED: Final = 20.0
"""The most seconds that a motion is expected to take. A longer one is not started."""

_MOST_PER_MM: Final = 34_304
"""The counts/mm of the finest DC servo of the document (page 56)."""
_LEAST_PER_MM_S: Final = 2.048
"""The velocity in a status that is 1 mm/s by the coarsest scale."""
_FASTER: Final = 4.0
"""The ratio of a measured velocity to that of a scale from which the scale does not apply."""
_LITERAL: Final = 0.1
"""The relative difference up to which a measured unit is the count/s."""
_FRACTION: Final = 65536
"""Velocities and accelerations of DC servo controllers have 16 fractional bits (page 14)."""


@dataclass(frozen=True)
class Pace:
    """A velocity in counts/s and an acceleration in counts/s².

    :param known: whether both have scales. Otherwise the raw values are used as they are (page 30). Some
        controllers are known to scale them so that the motor is slower, none so that it is faster.
    :param measured: the velocity of earlier moves, if it is not known; None without one. The motor may be
        faster, because short moves do not reach its velocity.
    :param unit: the counts/s of one unit of a velocity on the wire.
    :param printed: the pace if the controller takes the units of page 30 literally, while this is not
        excluded: the scale is not from the document, and no move has confirmed it.
    """

    velocity: float
    acceleration: float
    known: bool
    measured: float | None = None
    unit: float = 1.0
    printed: Pace | None = None

    @property
    def fastest(self) -> Pace:
        """The pace that a motion without a target may have."""
        return self.printed or self

    def distance(self, seconds: float) -> int:
        """Return the distance of a move from rest to rest in some time."""
        ramp = self.velocity / self.acceleration
        if seconds >= 2 * ramp:
            return int(self.velocity * (seconds - ramp))
        return int(self.acceleration * seconds * seconds / 4)

    def seconds(self, distance: int) -> float:
        """Return the duration of a move from rest to rest over a distance."""
        ramp = self.velocity / self.acceleration
        if abs(distance) >= self.velocity * ramp:
            return abs(distance) / self.velocity + ramp
        return 2 * math.sqrt(abs(distance) / self.acceleration)

    def as_measured(self) -> Pace:
        """Return the pace with the measured velocity, so that the motor is not slowed down too much."""
        if self.measured is None:
            return self
        return replace(
            self, velocity=self.measured, acceleration=max(self.acceleration, self.measured)
        )

    def slower(self, velocity: float) -> Pace:
        """Return the pace with a lower velocity."""
        return replace(
            self, velocity=velocity, measured=None if self.measured is None else velocity
        )

    def limit(self, distance: int) -> float:
        """Return the seconds after which a move over a distance is stopped."""
        return min(2 * self.seconds(distance) + _PATIENCE, LONGEST) if self.known else LONGEST

    def bound(self, distance: int) -> float:
        """Return the seconds after which a move over a distance is stopped, before it is started.

        End the check if the move would take too long.
        """
        if self.known and self.velocity < _LEAST:
            raise NotRunError(
                f"at {self.velocity:.1f} counts/s, a motion is too slow to be observed; set a higher velocity"
            )
        needed = abs(distance) / self.measured if self.measured else self.seconds(distance)
        if (self.known or self.measured) and needed > _EXPECTED:
            raise NotRunError(
                f"a motion over {abs(distance)} counts would take about {needed:.0f} s at "
                f"{self.measured or self.velocity:.0f} counts/s, but the suite starts none that takes "
                f"more than {_EXPECTED:.0f} s; set a higher velocity, or allow a smaller range"
            )
        return self.limit(distance)


def pace_of(trial: Trial, place: Target, channel: int) -> Pace:
    """Return the pace of moves (page 30); if it cannot be read, one that keeps moves short."""
    if "MOT_REQ_VELPARAMS" not in place.messages:
        return Pace(1000.0, 1000.0, known=False)
    told = trial.reply(m.MotReqVelParams(channel), place.address).message
    return _pace(trial, place, channel, told.max_velocity, told.acceleration)


def jog_pace_of(trial: Trial, place: Target, channel: int) -> Pace:
    """Return the pace of jogs (page 32)."""
    told = trial.reply(m.MotReqJogParams(channel), place.address).message
    return _pace(trial, place, channel, told.jog_max_velocity, told.jog_acceleration)


def home_pace_of(trial: Trial, place: Target, channel: int, moves: Pace) -> Pace:
    """Return the pace of homing (page 37), with the acceleration of moves; that of moves if it is unknown."""
    if "MOT_REQ_HOMEPARAMS" not in place.messages:
        return moves
    told = trial.reply(m.MotReqHomeParams(channel), place.address).message
    return replace(moves, velocity=max(1.0, told.home_velocity * moves.unit))


def status_velocity(place: Target, channel: int) -> float | None:
    """Return the counts/s of one unit of velocity in a status (page 79); None if unknown."""
    ratio = _ratio(place, channel, "status_velocity")
    return None if ratio is None else float(ratio)


def velocity_scale(place: Target, channel: int) -> float | None:
    """Return the counts/s of one unit of a velocity parameter (page 30); None if unknown."""
    ratio = _ratio(place, channel, "velocity")
    return None if ratio is None else float(ratio)


def acceleration_scale(place: Target, channel: int, velocity: float) -> float | None:
    """Return the counts/s² of one unit of an acceleration parameter (page 30); None if unknown.

    If the document does not have it, it follows from the unit of the velocity, which is the count/s, or, for
    a servo, a change per cycle (page 14).

    :param velocity: the measured counts/s of one unit of a velocity.
    """
    ratio = _ratio(place, channel, "acceleration")
    if ratio is not None:
        return float(ratio)
    if abs(velocity - 1) <= _LITERAL:
        return 1.0
    return velocity**2 * _FRACTION if place.status == "dc" else None


def is_printed(place: Target, channel: int) -> bool:
    """Return whether a document prints the scale of a velocity parameter.

    Otherwise a controller may take the unit of page 30 literally, which is one count/s.
    """
    scale = _scale(place, channel, "velocity")
    return scale is not None and bool(scale.printed)


def coarsest_velocity(place: Target, channel: int) -> float:
    """Return the counts/s of one unit of velocity in a status by the coarsest of the documented scales.

    That of page 79, corrected by an erratum, is 2.048 per mm/s.
    """
    position = place.position_scale(channel)
    counts = _MOST_PER_MM if position is None else float(position.counts_per_unit)
    return counts / _LEAST_PER_MM_S


def _pace(trial: Trial, place: Target, channel: int, velocity: int, acceleration: int) -> Pace:
    ratio = trial.line.measured.get((place.address, channel))
    speed = _ratio(place, channel, "velocity")
    gain = _ratio(place, channel, "acceleration")
    if gain is None and speed is not None and place.status == "dc":
        gain = speed**2 * _FRACTION  # both are changes per servo cycle (page 14)
    printed = Pace(max(1.0, velocity), max(1.0, acceleration), known=False)
    if ratio is not None:
        printed = replace(printed, measured=printed.velocity * ratio)
    if speed is None or gain is None:
        return printed
    scaled = Pace(
        velocity=max(1.0, velocity * float(speed)),
        acceleration=max(1.0, acceleration * float(gain)),
        known=True,
        unit=float(speed),
    )
    if is_printed(place, channel):
        return scaled
    if ratio is not None and ratio > _FASTER * speed:
        return printed
    confirmed = (place.address, channel) in trial.line.confirmed
    return scaled if confirmed else replace(scaled, printed=printed)


def _ratio(place: Target, channel: int, quantity: str) -> Fraction | None:
    """Return the counts (of position, per second) of one unit on the wire; None if unknown.

    If sources contradict each other on the counts per millimetre, this ratio may still be the same for all.
    """
    scales = place.connected_to(channel).scales
    if quantity not in scales.rules:
        return None
    found = {
        _ratio_in(each, quantity)
        for each in (scales, *(replace(scales, source_of_scales=one) for one in _sources(scales)))
    } - {None}
    return found.pop() if len(found) == 1 else None


def _ratio_in(scales: Scales, quantity: str) -> Fraction | None:
    position, scale = (_known(scales, name) for name in ("position", quantity))
    if position is None or scale is None:
        return None
    return position.counts_per_unit / scale.counts_per_unit


def _sources(scales: Scales) -> set[str]:
    """Return the names of the sources that contradict each other on the scales of a stage."""
    stage = scales.stage
    return {
        source
        for on_unit in (stage.scales.values() if stage is not None else ())
        for scale in on_unit.values()
        if isinstance(scale, ScaleConflict)
        for source in scale.scales
    }


def _scale(place: Target, channel: int, quantity: str) -> Scale | None:
    return _known(place.connected_to(channel).scales, quantity)


def _known(scales: Scales, quantity: str) -> Scale | None:
    if quantity not in scales.rules:
        return None
    try:
        return scales.of(quantity, scales.unit_of(quantity))
    except UnknownScaleError:
        return None
