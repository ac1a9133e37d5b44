"""A channel of a piezo controller during a check: what it puts out, and what it may be told to.

Nothing is put out before what is there has been read and lies within what was allowed, and nothing that is
told lies outside. At the end of the check the channel has the mode and the set-points that it had.
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
from stagewire_conformance.device.checks.apt.enable_state import switch
from stagewire_conformance.device.checks.apt.streams import stream_of
from stagewire_conformance.device.permissions import COUNTS, RangeError
from stagewire_conformance.device.trial import EnoughError

if TYPE_CHECKING:
    from stagewire import FramedMessage
    from stagewire.devices import Scales
    from stagewire_conformance.device.lines.dialogue import Incoming
    from stagewire_conformance.device.targets import Target
    from stagewire_conformance.device.trial import Trial


FULL_SCALE: Final = 32767
"""Counts of the maximum voltage, and of the whole travel (pages 96 and 97)."""

OPEN: Final = (PositionControlMode.OPEN_LOOP, PositionControlMode.OPEN_LOOP_SMOOTH)
CLOSED: Final = (PositionControlMode.CLOSED_LOOP, PositionControlMode.CLOSED_LOOP_SMOOTH)

HELD: Final = FULL_SCALE // 100
"""Counts by which an output may be seen beside what was set: one in a hundred of full scale."""
_STEP: Final = FULL_SCALE // 20
"""Counts by which an output is changed at most."""
_LEAST: Final = FULL_SCALE // 200
"""Counts of the smallest change that shows anything."""
_REPORT: Final = 1.0
"""Seconds within which a status message comes."""


def bits_are_printed(place: Target) -> bool:
    """Return whether the document says what the status bits of a unit mean (pages 101 to 104)."""
    return place.unit.name == "TPZ001" or place.unit.name.startswith("BPC")


@dataclass(frozen=True)
class PiezoStatus:
    """What a status message said (page 103).

    :param bits: by the table of the BPC series, which has all that the TPZ001 has.
    """

    time: float
    voltage: int
    position: int
    bits: Any
    heard: Incoming


class Piezo:
    """A channel of a piezo controller.

    :param trial: of the check.
    :param place: where it is.
    :param channel: its number.
    """

    def __init__(self, trial: Trial, place: Target, channel: int) -> None:
        self.trial = trial
        self.place = place
        self.channel = channel
        self.text = f"{place.name} channel {channel}"
        stream = stream_of(trial.declared, place)
        assert stream is not None  # every piezo controller has status messages
        self._stream = stream

    def begin(self) -> None:
        """Let the status messages come, and enable the channel if it is not."""
        self._stream.begin(self.trial)
        switch(self.trial, self.place, self.channel, EnableState.ENABLE)

    # Asking and telling

    def send(self, message: FramedMessage) -> None:
        """Send a message to the place."""
        self.trial.line.send(message, self.place.address)

    def ask(self, request: FramedMessage) -> Any:
        """Ask the place, and return the message that answers; the check ends where nothing does."""
        return self.trial.reply(request, self.place.address).message

    @property
    def mode(self) -> int:
        """The control mode, asked for (page 94)."""
        mode: int = self.ask(m.PzReqPosControlMode(self.channel)).mode
        return mode

    @property
    def volts(self) -> int:
        """The voltage that is set, asked for (page 96)."""
        voltage: int = self.ask(m.PzReqOutputVolts(self.channel)).voltage
        return voltage

    @property
    def set_position(self) -> int:
        """The position that is set, asked for (page 97)."""
        position: int = self.ask(m.PzReqOutputPos(self.channel)).position_sw
        return position

    def status(self) -> PiezoStatus:
        """Wait for the next status message; the check ends where none comes."""
        line = self.trial.line
        line.listen(0)  # what came before is old
        came = line.listen(_REPORT, until=self._is_mine)
        self.trial.need(
            bool(came) and self._is_mine(came[-1]),
            f"{self.text}: status messages were started, and none came within {_REPORT:g} s",
        )
        message = came[-1].message
        bits = BpcStatusBits(message.status_bits)
        return PiezoStatus(came[-1].time, message.op_voltage, message.position, bits, came[-1])

    def _is_mine(self, heard: Incoming) -> bool:
        return bool(self._stream.of_it([heard])) and heard.channel == self.channel

    def seen(self, field: str, wanted: int, within: float = 2.0) -> PiezoStatus:
        """Wait until a value of the status is what it should be, and return the last status."""
        end = self.trial.line.now + within
        while True:
            status = self.status()
            if abs(getattr(status, field) - wanted) <= HELD or status.time >= end:
                return status

    def judge_seen(self, field: str, wanted: int, after: str) -> bool:
        """Say whether the output comes to be what was set."""
        status = self.seen(field, wanted)
        value = getattr(status, field)
        return self.trial.must(
            abs(value - wanted) <= HELD,
            f"{self.text}: after {after} {status.heard.name} went on to say a {field} of {value}; it "
            f"should have come to {wanted}",
            came=status.heard.raw,
        )

    # What may be put out

    def span(self, quantity: str) -> tuple[int, int]:
        """Return the range in counts of a quantity: ``output_volts`` or ``piezo_position``.

        The check is INFO, and ends, where nothing says which counts they are.
        """
        motion = self.trial.allowed.motion
        assert motion is not None  # who puts something out needs it
        try:
            if motion.unit == COUNTS:
                return motion.in_counts(None)
            return motion.in_counts(self._scales().of(quantity, _UNITS[quantity]))
        except (RangeError, UnknownScaleError) as error:
            self.give_up(
                f"{self.text}: {motion} says nothing of {quantity.replace('_', ' ')}: {error}"
            )

    def _scales(self) -> Scales:
        """Return the scales of the channel, with the settings that it tells."""
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
        """Return by how much an output is changed within a range; the check is INFO, and ends, without room.

        :param steps: how many of them there have to be.
        """
        low, high = max(span[0], -FULL_SCALE), min(span[1], FULL_SCALE)
        self.trial.need(
            low <= present <= high,
            f"{self.text} has an output of {present} counts, outside of what was allowed "
            f"({low}..{high} counts), "
            "so nothing was put out; set it to a value within, or allow a range that includes it",
        )
        up = high - present >= present - low
        room = min((high - present if up else present - low) // steps, _STEP)
        if room < _LEAST:
            self.give_up(
                f"{self.text}: there is no room for a change in {low}..{high} counts; allow a wider range"
            )
        size = self.trial.random.randint(max(_LEAST, room * 3 // 4), room)
        return size if up else -size

    def give_up(self, why: str) -> NoReturn:
        """End the check without a verdict."""
        self.trial.inconclusive(why)
        raise EnoughError


_UNITS: Final = {"output_volts": "V", "piezo_position": "um"}
