"""Everything that makes a virtual controller, but its clock."""

from __future__ import annotations

from dataclasses import dataclass, field

from stagewire_virtual.clock import Clock
from stagewire_virtual.faults import Fault, FaultyLine
from stagewire_virtual.instrument import Instrument
from stagewire_virtual.making import make_instrument
from stagewire_virtual.options import Options
from stagewire_virtual.thorlabs_apt.instrument import rack_of
from stagewire_virtual.units import Unit

__all__ = ["Blueprint"]


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

    def make(self, clock: Clock) -> Instrument | FaultyLine:
        """Make a controller, behind its faults if there are some.

        Raises :class:`~stagewire_virtual.errors.VirtualError` for what the unit cannot have.
        """
        instrument: Instrument
        if self.unit is None:
            instrument = rack_of(self.bays, clock, self.options)
        else:
            instrument = make_instrument(self.unit, clock, self.options)
        if not self.faults:
            return instrument
        return FaultyLine(instrument, self.faults, self.options.seed)
