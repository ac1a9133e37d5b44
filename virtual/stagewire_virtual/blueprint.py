"""Everything that makes a virtual controller, but its clock; with the table of protocols that have some."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final

from stagewire_virtual.asi_ms2000.instrument import Ms2000Instrument
from stagewire_virtual.clock import Clock
from stagewire_virtual.errors import VirtualError
from stagewire_virtual.faults.fault import Fault
from stagewire_virtual.faults.link import FaultyLink
from stagewire_virtual.instrument import Instrument, Unit
from stagewire_virtual.options import Options
from stagewire_virtual.thorlabs_apt.instrument import AptInstrument, rack_of

_KINDS: Final[dict[str, Callable[[Unit, Clock, Options], Instrument]]] = {
    "asi_ms2000": Ms2000Instrument,
    "thorlabs_apt": AptInstrument,
}

_DEFAULT: Final = Options()


def make_instrument(unit: Unit, clock: Clock, options: Options = _DEFAULT) -> Instrument:
    """Make the virtual controller of a unit.

    Raises :class:`~stagewire_virtual.errors.BadOptionError` for an option that the unit cannot have, and
    :class:`~stagewire_virtual.errors.VirtualError` for a unit of a protocol without virtual controllers.
    """
    kind = _KINDS.get(unit.protocol.name)
    if kind is None:
        raise VirtualError(
            f"{unit.name} speaks {unit.protocol.name}, for which there are no virtual controllers "
            f"(there are for {', '.join(_KINDS)})"
        )
    return kind(unit, clock, options)


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

    def make(self, clock: Clock) -> Instrument | FaultyLink:
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
        return FaultyLink(instrument, self.faults, self.options.seed)
