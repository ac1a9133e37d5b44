"""Status bits by their names, in the table that the registry gives the unit (pages 101 to 104)."""

from __future__ import annotations

from collections.abc import Mapping

from stagewire_virtual.units import Unit

__all__ = ["StatusBits"]


class StatusBits:
    """The bits that ``PZ_GET_PZSTATUSUPDATE`` of a unit has.

    Tables are printed for the TPZ001 and the BPC series. MPZ601 and TSG001 send the bits of the latter,
    which is the richer one and agrees with the other.
    """

    def __init__(self, unit: Unit) -> None:
        (layout,) = unit.message("PZ_GET_PZSTATUSUPDATE")["layouts"]
        field = next(field for field in layout["fields"] if field["name"] == "status_bits")
        table = field["flags_by_unit"].get(unit.name, field["flag_table"])
        bits = unit.registry["flags"][table]["bits"]
        self._masks: dict[str, int] = {name: bit["mask"] for name, bit in bits.items()}

    def value(self, states: Mapping[str, bool]) -> int:
        """Return the word with the named bits set; a name that the table does not have is left out."""
        return sum(mask for name, mask in self._masks.items() if states.get(name))
