"""From a unit to its virtual controller."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from stagewire_virtual.asi_ms2000 import Ms2000Instrument
from stagewire_virtual.clock import Clock
from stagewire_virtual.errors import VirtualError
from stagewire_virtual.instrument import Instrument
from stagewire_virtual.options import Options
from stagewire_virtual.thorlabs_apt.instrument import AptInstrument
from stagewire_virtual.units import Unit

__all__ = ["make_instrument"]

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
