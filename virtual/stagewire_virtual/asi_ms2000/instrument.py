"""A virtual MS-2000 or MFC-2000: its axes, both formats, and the switches between them.

``STRATEGIES`` has the readings to choose from where the document is ambiguous.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

from stagewire.errors import CodecError
from stagewire.framing import CommandReceived, Garbage
from stagewire.protocols import CommandFrame, SetupCommand
from stagewire_ms2000 import PROTOCOL
from stagewire_ms2000 import messages as m
from stagewire_ms2000.quantities import POSITION
from stagewire_virtual.asi_ms2000.formats import HighLevel, LowLevel
from stagewire_virtual.asi_ms2000.servo_axis import TRAVEL, ServoAxis
from stagewire_virtual.clock import Clock
from stagewire_virtual.errors import BadOptionError, UnknownPartError
from stagewire_virtual.instrument import Instrument, Row, Unit
from stagewire_virtual.options import Options, Settings, known_only

STRATEGIES: Final[Mapping[str, Mapping[str, str]]] = {
    "power_on_mode": {
        "high": "After power-on and reset it takes lines of text (section 1: 255 66 ends this).",
        "low": "After power-on and reset it takes low-level commands.",
    },
    "colon_in_data": {
        "data": "As many bytes as the size says are data, including a colon (section 2, group 5).",
        "end": "Any colon ends the command and clears the buffer (section 2, RS-232 timeout).",
    },
    "prefix_in_frame": {
        "data": "255 begins a setup command at the start of a command, and is data elsewhere.",
        "setup": "255 and a letter form a setup command anywhere; pending bytes are discarded.",
    },
    "missing_size": {
        "accepted": "Any command without data may omit its size (examples of sections 7 and 14).",
        "ignored": "A command that reads is ignored without its size (section 2, group 3: three exceptions).",
    },
    "disabled_axis": {
        "not_busy": "A stopped axis is never busy (section 16, from firmware 3.3 on).",
        "busy": "A stopped axis is busy while it is away from its target (before firmware 3.3).",
    },
    "start_motor": {
        "resumes": "START_MOTOR resumes the move to the target, which may be a new one.",
        "stays": "START_MOTOR only enables the motor; the current position becomes the target.",
    },
    "vector_speed": {
        "unsigned": "Vector speeds are 0 to 65535 µm/s, upwards only (section 25 does not mention a sign).",
        "signed": "Vector speeds are -32768 to 32767 µm/s, as READ_CURRENT_SPEED returns them.",
    },
}
"""Strategy -> reading -> its effect. The first reading is the default."""


def readings(unit: str, chosen: Mapping[str, str]) -> dict[str, str]:
    """Return the reading of each strategy: the chosen one, or the default.

    Raises :class:`~stagewire_virtual.errors.BadOptionError` for an unknown strategy or reading.
    """
    known_only("strategy", chosen, STRATEGIES, unit)
    for name, reading in chosen.items():
        known_only(f"{name} reading", [reading], STRATEGIES[name], unit)
    return {name: next(iter(known)) for name, known in STRATEGIES.items()} | dict(chosen)


_FITTED: Final = 3
"""The number of axes without settings: X, Y and Z. Settings for a fourth channel add F."""


def identifiers(unit: Unit) -> dict[str, int]:
    """Return the identifiers of all axes by name, in order, without the reserved ones (section 2)."""
    values = unit.registry["enumerations"]["axis"]["values"]
    found = {name: value["value"] for name, value in values.items() if not value.get("reserved")}
    return dict(sorted(found.items(), key=lambda axis: axis[1]))


def fit_axes(
    unit: Unit, clock: Clock, options: Options, readings: Mapping[str, str]
) -> dict[str, ServoAxis]:
    """Make the axes of a controller, by name.

    Raises :class:`~stagewire_virtual.errors.BadOptionError` for an option that it does not support.
    """
    names = list(identifiers(unit))
    _check(unit, options, names)
    fitted = names[: max(_FITTED, len(options.channels))]
    return {
        name: ServoAxis(clock, options.settings(index), readings)
        for index, name in enumerate(fitted)
    }


def _check(unit: Unit, options: Options, names: list[str]) -> None:
    known_only("quirk", options.quirks, (), unit.name)
    wrong = {
        "does not report a model": options.model is not None,
        "does not report a serial number": options.serial_number is not None,
        "does not report a hardware type": options.hardware_type is not None,
        "does not report a stage id": options.stage_id is not None,
        "never answers unknown commands": options.answer_unsupported,
        "has no bays": bool(options.empty_bays),
        f"has only the axes {', '.join(names)}": len(options.channels) > len(names),
    }
    for settings in options.channels:
        wrong |= _unsupported_options(settings)
    for sentence, is_wrong in wrong.items():
        if is_wrong:
            raise BadOptionError(f"{unit.name} {sentence}")


def _unsupported_options(settings: Settings) -> dict[str, bool]:
    travel = TRAVEL if settings.travel is None else settings.travel
    position = 0 if settings.position is None else settings.position
    return {
        "always counts in tenths of a micrometre and accepts no stage": settings.stage is not None,
        f"requires a travel above 0, not {travel}": travel <= 0,
        f"cannot start at {position} within a travel of {travel}": not 0 <= position <= travel,
    }


class Ms2000Instrument(Instrument):
    """A controller of servo axes.

    It processes bytes one by one, so the chunks in which they arrive do not matter. Incomplete commands have
    no timeout (section 2).

    :param options: its ``channels`` are the axes X, Y, Z and F in order, with travel and position in tenths
        of a micrometre; its ``strategies`` are those in
        :data:`~stagewire_virtual.asi_ms2000.instrument.STRATEGIES`.

    Raises :class:`~stagewire_virtual.errors.BadOptionError` for an option that it does not support.
    """

    def __init__(self, unit: Unit, clock: Clock, options: Options) -> None:
        super().__init__(unit, clock)
        self._readings = readings(unit.name, options.strategies)
        self.axes = fit_axes(unit, clock, options, self._readings)
        """The fitted axes by name."""
        self._framer = PROTOCOL.framer()
        self._high = HighLevel(self.axes)
        addresses = identifiers(unit)
        addressed = {addresses[name]: axis for name, axis in self.axes.items()}
        self._low = LowLevel(unit, addressed, self._readings, self._refuse)
        self._wake()

    def receive(self, data: bytes) -> None:
        """Process bytes from the host, in any chunks."""
        for byte in data:
            if self._low_level and self._readings["prefix_in_frame"] == "data":
                self._take(byte)
            else:
                self._look_for_prefix(byte)

    def power_cycle(self) -> None:
        """Switch off and on; RESET_CONTROLLER does the same (section 1).

        Only the physical positions of the stages are kept, because the document mentions no memory.
        """
        for axis in self.axes.values():
            axis.power_on()
        self._wake()

    def rows(self) -> Sequence[Row]:
        """Return the rows of the live table, one for each axis."""
        return [
            Row(
                _part(name),
                f"{float(POSITION.from_counts(axis.position)) / 1000:.4f} mm",
                axis.words,
            )
            for name, axis in self.axes.items()
        ]

    def stick(self, part: str, stuck: bool) -> None:
        """Block an axis, or release it; its servo keeps pushing.

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
        """Discard incomplete input in both formats."""
        self._prefixed = False
        self._framer.reset()
        self._high.clear()

    def _look_for_prefix(self, byte: int) -> None:
        """Process a byte in a mode where 255 and a setup letter are a setup command anywhere."""
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
        """Process a byte in the present format."""
        if not self._low_level:
            self._say(self._high.feed(byte))
            return
        for event in self._framer.feed(bytes((byte,))):
            if isinstance(event, CommandReceived):
                self._carry_out(event.frame)
            elif not isinstance(event, Garbage):
                try:
                    PROTOCOL.decode(event.raw)
                except CodecError as error:
                    self._refuse(f"{event.raw.hex(' ')}: {error}")
        if byte == PROTOCOL.marks.terminator and self._readings["colon_in_data"] == "end":
            self._framer.reset()

    def _carry_out(self, frame: CommandFrame) -> None:
        if isinstance(frame.message, SetupCommand):
            self._set_up(frame.message)
        else:
            assert frame.axis is not None  # only setup commands have no axis
            self._say(self._low.carry_out(frame.axis, frame.message, frame.sized))

    def _set_up(self, command: SetupCommand) -> None:
        """Carry out a setup command (section 1)."""
        if command.layout.message not in self.unit.messages:
            self._refuse(f"{command.layout.message} is not a command of this controller")
            return
        match command.layout.switches_to:
            case "power_on":
                self.power_cycle()
            case None:  # the other two select the unit of WHERE
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
