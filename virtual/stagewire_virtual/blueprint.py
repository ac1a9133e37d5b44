"""Everything that makes a virtual controller, but its clock."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

from stagewire import Stage
from stagewire_virtual.clock import Clock
from stagewire_virtual.errors import BadOptionError
from stagewire_virtual.faults import Fault, FaultyLine
from stagewire_virtual.instrument import Instrument
from stagewire_virtual.making import make_instrument
from stagewire_virtual.options import Line, Options
from stagewire_virtual.thorlabs_apt.instrument import rack_of
from stagewire_virtual.units import Unit

__all__ = ["Blueprint", "check_stage", "parse_line"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Blueprint:
    """A unit, or a rack of modules, and all that was told of it.

    :param unit: what to make; None for a rack of modules.
    :param bays: of a rack of modules, the module in each bay; None is an empty one.
    :param options: of the unit.
    :param faults: what goes wrong on its line.
    """

    unit: Unit | None
    bays: tuple[Unit | None, ...] = ()
    options: Options = field(default_factory=Options)
    faults: tuple[Fault, ...] = ()

    @property
    def units(self) -> tuple[Unit, ...]:
        """The unit, or the modules in the bays."""
        return tuple(unit for unit in (self.unit, *self.bays) if unit is not None)

    def make(self, clock: Clock) -> Instrument | FaultyLine:
        """Make a controller, behind its faults if there are some.

        Raises :class:`~stagewire_virtual.errors.VirtualError` for what the unit cannot have.
        """
        for settings in self.options.channels:
            if settings.stage is not None:
                check_stage(settings.stage, self.units)
        instrument: Instrument
        if self.unit is None:
            instrument = rack_of(self.bays, clock, self.options)
        else:
            instrument = make_instrument(self.unit, clock, self.options)
        if not self.faults:
            return instrument
        return FaultyLine(instrument, self.faults, self.options.seed)


def check_stage(stage: Stage, units: Iterable[Unit]) -> None:
    """Raise :class:`~stagewire_virtual.errors.BadOptionError` for a stage of unknown scales on all units."""
    known = sorted({name for names in stage.controllers.values() for name in names})
    names = [unit.name for unit in units]
    if names and not set(names) & set(known):
        raise BadOptionError(
            f"the scales of {stage.name} on {' or '.join(names)} are not known "
            f"(they are on: {', '.join(known)}); without a stage everything is in counts"
        )


def parse_line(name: Line | str) -> Line:
    """Return the line of a name: ``usb`` or ``rs232``.

    Raises :class:`~stagewire_virtual.errors.BadOptionError` for another one.
    """
    try:
        return Line(name)
    except ValueError:
        known = " or ".join(line.value for line in Line)
        raise BadOptionError(f"there is no line {name!r}; it is {known}") from None
