"""The status bits of a unit by name, in the table that the registry assigns to the unit."""

from __future__ import annotations

from collections.abc import Mapping

from stagewire_virtual.instrument import Unit


class StatusBits:
    """The bits in the field ``status_bits`` of a message.

    :param unit: the unit in the registry.
    :param message: the name of the message.
    """

    def __init__(self, unit: Unit, message: str) -> None:
        (layout,) = unit.message(message)["layouts"]
        field = next(field for field in layout["fields"] if field["name"] == "status_bits")
        table = field.get("flags_by_unit", {}).get(unit.name, field["flag_table"])
        bits = unit.registry["flags"][table]["bits"]
        self._masks: dict[str, int] = {name: bit["mask"] for name, bit in bits.items()}

    def value(self, states: Mapping[str, bool]) -> int:
        """Return the word with the named bits set; names that are not in the table are ignored."""
        return sum(mask for name, mask in self._masks.items() if states.get(name))
