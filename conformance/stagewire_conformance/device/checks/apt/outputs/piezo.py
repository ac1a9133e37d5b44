"""A channel of a piezo controller during a check, and the limits of its output.

A check changes an output only if the current output was read and is within the allowed range, and only to
values within it. At the end of the check, the channel has its previous mode and set-points.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING, Any, Final, NoReturn

from stagewire.devices import ToldValue
from stagewire.errors import UnknownScaleError
from stagewire_apt import messages as m
from stagewire_apt.enumerations import EnableState, PositionControlMode
from stagewire_apt.flags import BpcStatusBits
from stagewire_conformance.device.causes import DELIVERY, Cause
from stagewire_conformance.device.checks.apt.enable_state import switch
from stagewire_conformance.device.checks.apt.outputs.output_check import Output
from stagewire_conformance.device.checks.apt.streams import stream_of
from stagewire_conformance.device.permissions import COUNTS, RangeError
from stagewire_conformance.device.trial import EnoughError

if TYPE_CHECKING:
    from stagewire.devices import Scales
    from stagewire_conformance.device.lines.dialogue import Incoming
    from stagewire_conformance.device.targets import Target
    from stagewire_conformance.device.trial import Trial


FULL_SCALE: Final = 32767
"""Counts of the maximum voltage and of the whole travel (pages 96 and 97)."""

OPEN: Final = (PositionControlMode.OPEN_LOOP, PositionControlMode.OPEN_LOOP_SMOOTH)
CLOSED: Final = (PositionControlMode.CLOSED_LOOP, PositionControlMode.CLOSED_LOOP_SMOOTH)

HELD: Final = FULL_SCALE // 100
"""The tolerance of an output in counts: one per cent of full scale."""
_STEP: Final = FULL_SCALE // 20
"""The largest change of an output in counts."""
_LEAST: Final = FULL_SCALE // 200
"""The smallest change in counts that can be observed."""
_REPORT: Final = 1.0
"""Seconds within which a status message arrives."""


_WITH_BITS: Final = ("TPZ001", "KPZ101", "KSG101", "KPC101", "PPC001", "PPC102", "MPZ601")


def bits_are_known(place: Target) -> bool:
    """Return whether a document or a C header of the vendor defines the status bits of a unit.

    The documents do for the TPZ001, the KPZ101 and the BPC series (pages 101 to 104).
    """
    return place.unit.name in _WITH_BITS or place.unit.name.startswith("BPC")


def needs_a_gauge(piezo: Piezo, bits: BpcStatusBits) -> None:
    """End the check without a verdict unless the status bits are known and report a strain gauge."""
    name = piezo.place.unit.name
    if not bits_are_known(piezo.place):
        piezo.give_up(
            f"{piezo.text}: no source defines the status bits of a {name}, so it is unknown whether it has a "
            "strain gauge"
        )
    if not bits.strain_gauge_connected:
        piezo.give_up(f"{piezo.text} does not report a strain gauge")


@dataclass(frozen=True)
class PiezoStatus:
    """The content of a status message (page 103).

    :param bits: the status bits, by the table of the BPC series; the bits that the checks use have the same
        places in all tables.
    """

    time: float
    voltage: int
    position: int
    bits: Any
    heard: Incoming


class Piezo(Output):
    """A channel of a piezo controller."""

    def __init__(self, trial: Trial, place: Target, channel: int) -> None:
        super().__init__(trial, place, channel)
        stream = stream_of(trial.declared, place)
        assert stream is not None  # every piezo controller has status messages
        self._stream = stream

    def begin(self) -> None:
        """Start the status messages, and enable the channel if it is disabled."""
        self._stream.begin(self.trial)
        switch(self.trial, self.place, self.channel, EnableState.ENABLE)

    # Messages

    @property
    def mode(self) -> int:
        """The current control mode, requested (page 94)."""
        mode: int = self.ask(m.PzReqPosControlMode(self.channel)).mode
        return mode

    @property
    def volts(self) -> int:
        """The set voltage, requested (page 96)."""
        voltage: int = self.ask(m.PzReqOutputVolts(self.channel)).voltage
        return voltage

    @property
    def set_position(self) -> int:
        """The set position, requested (page 97)."""
        position: int = self.ask(m.PzReqOutputPos(self.channel)).position_sw
        return position

    def status(self) -> PiezoStatus:
        """Wait for the next status message; the check ends without one."""
        line = self.trial.line
        line.listen(0)  # earlier messages are outdated
        came = line.listen(_REPORT, until=self._is_mine)
        self.trial.need(
            bool(came) and self._is_mine(came[-1]),
            f"{self.text} sent no status message within {_REPORT:g} s after they were started",
            rule="request-answered",
            cause=Cause("PZ_GET_PZSTATUSUPDATE", DELIVERY),
        )
        message = came[-1].message
        bits = BpcStatusBits(message.status_bits)
        return PiezoStatus(came[-1].time, message.op_voltage, message.position, bits, came[-1])

    def _is_mine(self, heard: Incoming) -> bool:
        return bool(self._stream.of_it([heard])) and heard.channel == self.channel

    def seen(self, field: str, wanted: int, within: float = 2.0) -> PiezoStatus:
        """Wait until a value of the status is as expected, and return the last status."""
        end = self.trial.line.now + within
        while True:
            status = self.status()
            if abs(getattr(status, field) - wanted) <= HELD or status.time >= end:
                return status

    def judge_seen(self, field: str, wanted: int, after: str) -> bool:
        """Report an output that does not reach its set-point."""
        status = self.seen(field, wanted)
        value = getattr(status, field)
        return self.trial.must(
            abs(value - wanted) <= HELD,
            f"{self.text}: after {after}, {status.heard.name} still reports a {field} of "
            f"{value}; it should have reached {wanted}",
            came=status.heard.raw,
            rule="piezo-update-position" if field == "position" else "piezo-update-voltage",
            cause=Cause(status.heard.name, field),
        )

    # Limits of the output

    def span(self, quantity: str) -> tuple[int, int]:
        """Return the range in counts of a quantity: ``output_volts`` or ``piezo_position``.

        The check ends with INFO if the counts cannot be determined.
        """
        motion = self.trial.allowed.motion
        assert motion is not None  # required for every output
        try:
            if motion.unit == COUNTS:
                return motion.in_counts(None)
            return motion.in_counts(self._scales().of(quantity, _UNITS[quantity]))
        except (RangeError, UnknownScaleError) as error:
            self.give_up(
                f"{self.text}: {motion} cannot be converted to counts of "
                f"{quantity.replace('_', ' ')}: {error}"
            )

    def _scales(self) -> Scales:
        """Return the scales of the channel, with the settings that it reports."""
        place = self.place
        scales = place.connected_to(self.channel).scales
        for setting in place.facts.settings.values():
            for told in setting.told:
                if setting.unit and told.req and told.req.layout.message in place.messages:
                    request = self.trial.declared.make(told.req.layout.message, self.channel)
                    raw = getattr(self.ask(request), told.field)
                    value = (
                        told.scale.from_counts(raw) if told.scale else (told.values or {}).get(raw)
                    )
                    if isinstance(value, int | Fraction):
                        scales = scales.told(
                            setting.name, ToldValue(Fraction(value), setting.unit, "")
                        )
        return scales

    def step(self, present: int, span: tuple[int, int], *, steps: int = 1) -> int:
        """Return a change of the output within a range; without room for one, the check ends with INFO.

        :param steps: how many of these changes must fit.
        """
        low, high = max(span[0], -FULL_SCALE), min(span[1], FULL_SCALE)
        self.trial.need(
            low <= present <= high,
            f"{self.text} has an output of {present} counts, outside of the allowed "
            f"{low}..{high} counts, so its output was not changed; set it to a value within "
            "this range, or allow a range that includes it",
            rule="piezo-update-voltage",
        )
        up = high - present >= present - low
        room = min((high - present if up else present - low) // steps, _STEP)
        if room < _LEAST:
            self.give_up(
                f"{self.text}: the range {low}..{high} counts leaves no room for a change; "
                "allow a wider range"
            )
        size = self.trial.random.randint(max(_LEAST, room * 3 // 4), room)
        return size if up else -size

    def give_up(self, why: str) -> NoReturn:
        """End the check without a verdict."""
        self.trial.inconclusive(why)
        raise EnoughError


@dataclass(frozen=True)
class Others:
    """The set voltages of all other channels, which a voltage to one channel must not change.

    :param piezo: the channel that is changed.
    :param volts: the voltage of each other channel.
    """

    piezo: Piezo
    volts: tuple[tuple[Piezo, int], ...]

    @classmethod
    def of(cls, piezo: Piezo) -> Others:
        """Read the voltages of the other channels that have them."""
        found = [
            Piezo(piezo.trial, place, channel)
            for place in piezo.trial.declared.places
            for channel in place.channels
            if (place, channel) != (piezo.place, piezo.channel)
            and place.messages >= {"PZ_REQ_OUTPUTVOLTS", "PZ_GET_OUTPUTVOLTS"}
        ]
        return cls(piezo, tuple((other, other.volts) for other in found))

    def judge(self, told: str) -> None:
        """Report other channels whose voltage has changed.

        :param told: the message and its value.
        """
        for other, was in self.volts:
            now = other.volts
            self.piezo.trial.must(
                now == was,
                f"after {told} to {self.piezo.text}, PZ_GET_OUTPUTVOLTS of {other.text} returned {now} "
                f"instead of {was}; it should be unchanged",
                rule="module-channels"
                if other.place == self.piezo.place
                else "slot-addressed-by-destination",
            )


_UNITS: Final = {"output_volts": "V", "piezo_position": "um"}
