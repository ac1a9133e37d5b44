"""A virtual MS-2000 or MFC-2000: both formats, the ways between them, and its axes."""

from __future__ import annotations

from collections.abc import Sequence

from stagewire.commands import CommandFrame, CommandReceived, SetupCommand
from stagewire.commands.refusals import refusal
from stagewire.framing import Garbage
from stagewire_ms2000 import PROTOCOL
from stagewire_ms2000 import messages as m
from stagewire_ms2000.quantities import POSITION
from stagewire_virtual.asi_ms2000.fitting import fit_axes, identifiers
from stagewire_virtual.asi_ms2000.high_level import HighLevel
from stagewire_virtual.asi_ms2000.low_level import LowLevel
from stagewire_virtual.asi_ms2000.strategies import readings
from stagewire_virtual.clock import Clock
from stagewire_virtual.errors import UnknownPartError
from stagewire_virtual.instrument import Instrument, Row
from stagewire_virtual.options import Options
from stagewire_virtual.units import Unit

__all__ = ["Ms2000Instrument"]


class Ms2000Instrument(Instrument):
    """A controller of servo axes.

    Bytes are taken one by one, so that nothing depends on how they come in chunks. No time-out gives up a
    command that is not finished (section 2).

    :param options: of its ``channels``, the axes X, Y, Z and F in order, travel and position in tenths of a
        micrometre; of its ``strategies``, the names in
        :data:`~stagewire_virtual.asi_ms2000.strategies.STRATEGIES`.

    Raises :class:`~stagewire_virtual.errors.BadOptionError` for an option that it cannot have.
    """

    def __init__(self, unit: Unit, clock: Clock, options: Options) -> None:
        super().__init__(unit, clock)
        self._readings = readings(unit.name, options.strategies)
        self.axes = fit_axes(unit, clock, options, self._readings)
        """The axes that are fitted, by name."""
        self._framer = PROTOCOL.framer()
        self._high = HighLevel(self.axes)
        addresses = identifiers(unit)
        addressed = {addresses[name]: axis for name, axis in self.axes.items()}
        self._low = LowLevel(unit, addressed, self._readings, self._refuse)
        self._wake()

    def receive(self, data: bytes) -> None:
        """Take what the host sends, cut at any byte."""
        for byte in data:
            if self._low_level and self._readings["prefix_in_frame"] == "data":
                self._take(byte)
            else:
                self._look_for_prefix(byte)

    def power_cycle(self) -> None:
        """Switch it off and on; RESET_CONTROLLER does the same (section 1).

        Nothing is kept but where the stages stand: the document knows no memory.
        """
        for axis in self.axes.values():
            axis.power_on()
        self._wake()

    def rows(self) -> Sequence[Row]:
        """Return what the live table shows, an axis a line."""
        return [
            Row(
                _part(name),
                f"{float(POSITION.from_counts(axis.position)) / 1000:.4f} mm",
                axis.words,
            )
            for name, axis in self.axes.items()
        ]

    def stick(self, part: str, stuck: bool) -> None:
        """Hold an axis, or let it go; its servo pushes on meanwhile.

        Raises :class:`~stagewire_virtual.errors.UnknownPartError` for a part that :meth:`rows` does not name.
        """
        axes = {_part(name): axis for name, axis in self.axes.items()}
        if part not in axes:
            raise UnknownPartError(part, list(axes))
        axes[part].stuck = stuck

    # The two formats

    def _wake(self) -> None:
        self._low_level = self._readings["power_on_mode"] == "low"
        self._high.hundredths = False
        self._forget()

    def _forget(self) -> None:
        """Forget what is pending in either format."""
        self._prefixed = False
        self._framer.reset()
        self._high.clear()

    def _look_for_prefix(self, byte: int) -> None:
        """Take a byte where 255 and the letter of a setup command are one wherever they stand."""
        marks = PROTOCOL.marks
        if self._prefixed:
            self._prefixed = False
            if byte in marks.setup:
                self._forget()
                self._carry_out(PROTOCOL.decode(bytes((marks.prefix, byte))))
                return
            self._take(marks.prefix)
        if byte == marks.prefix:
            self._prefixed = True
        else:
            self._take(byte)

    def _take(self, byte: int) -> None:
        """Take a byte of the format that is in force."""
        if not self._low_level:
            self._say(self._high.feed(byte))
            return
        for event in self._framer.feed(bytes((byte,))):
            if isinstance(event, CommandReceived):
                self._carry_out(event.frame)
            elif not isinstance(event, Garbage):
                self._refuse(
                    f"{event.raw.hex(' ')}: {refusal(PROTOCOL.title, PROTOCOL.rule, event.raw)}"
                )
        if byte == PROTOCOL.marks.terminator and self._readings["colon_in_data"] == "end":
            self._framer.reset()

    def _carry_out(self, frame: CommandFrame) -> None:
        if isinstance(frame.message, SetupCommand):
            self._set_up(frame.message)
        else:
            assert frame.axis is not None  # only setup commands have none
            self._say(self._low.carry_out(frame.axis, frame.message, frame.sized))

    def _set_up(self, command: SetupCommand) -> None:
        """Do what a setup command says (section 1)."""
        if command.layout.message not in self.unit.messages:
            self._refuse(f"{command.layout.message} is not a command of this controller")
            return
        match command.layout.switches_to:
            case "power_on":
                self.power_cycle()
            case None:  # the other two say how WHERE answers
                self._high.hundredths = isinstance(command, m.WhereInHundredths)
            case format:
                self._low_level = format == "low_level"

    def _say(self, data: bytes) -> None:
        if data:
            self.on_send(data)

    def _refuse(self, why: str) -> None:
        self.on_refusal(why)


def _part(name: str) -> str:
    return f"axis {name}"
