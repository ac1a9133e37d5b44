"""Values that examples state in units and in counts, as conversions by quantities.h."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from typing import Any

from stagewire_generator.model import Factor, Json, Protocol, Quantity
from stagewire_generator.targets.c.names import Names
from stagewire_generator.targets.c.source import integer
from stagewire_generator.targets.c.testing.values import CannotSayError

__all__ = ["Conversions"]

_LEAST, _GREATEST = -(1 << 63), (1 << 63) - 1
_POWERS = (  # units that measure the same, as powers of ten of the first
    {"s": 0, "ms": -3, "us": -6},
    {"m": 0, "mm": -3, "um": -6, "nm": -9},
    {"V": 0, "mV": -3},
)


class Conversions:
    """Finds the scale of a stated value by the name that quantities.h has for it."""

    def __init__(self, protocol: Protocol, names: Names) -> None:
        self._quantities = {quantity.name: quantity for quantity in protocol.quantities}
        self._stages = {stage.name: stage.scales for stage in protocol.stages}
        self._names = names

    def members(self, name: str, item: Json) -> list[str]:
        """Return the members of a conversion of the file of the examples.

        Raises :class:`CannotSayError` for a value without a scale.
        """
        words, unit, scale = self._scale(name, item)
        value = _ratio(_fraction(item["value"]) * _between(item["unit"], unit))
        made = [f".value = {value}"]
        if isinstance(scale, Factor):
            made.append(f".scale = {self._names.macro('scale_' + '_'.join(words))}")
        else:
            setting = item.get("setting", {}).get(scale.get("setting"))
            if setting is None or "counts_at_setting" not in scale:
                raise CannotSayError("a value without a scale")
            function = "_".join(("scale", *words)).lower()
            made.append(f".by_setting = {self._names.prefix}_{function}")
            made.append(f".setting = {_ratio(_fraction(setting))}")
        return [*made, f".counts = {_integer(item['exact'])}"]

    def _scale(self, name: str, item: Json) -> tuple[tuple[str, ...], str, Factor | Json]:
        """Return what a scale is called after, its unit, and what it is."""
        quantity = self._quantities.get(name)
        if quantity is None:
            raise CannotSayError("a quantity that there is not")
        if quantity.factor:
            return (name,), quantity.unit, quantity.factor
        rule = quantity.rule
        if "cases" in rule:
            case = str(item.get("setting", {}).get(rule["setting"]))
            found = _of(rule["cases"], case)
            return (name, case), found["unit"], found["scale"]
        if "units" in rule:
            device = item.get("controller") or item.get("device") or ""
            return (name, device), quantity.unit, _of(rule["units"], device)
        if rule.get("by") == "stage":
            return self._of_stage(quantity, item)
        return (name,), quantity.unit, rule

    def _of_stage(
        self, quantity: Quantity, item: Json
    ) -> tuple[tuple[str, ...], str, Factor | Json]:
        stage, controller = item.get("stage", ""), item.get("controller", "")
        found = _of(_of(_of(self._stages, stage), controller), quantity.name)
        words = stage, controller, quantity.name
        return words, quantity.unit, {} if isinstance(found, str) else found


def _of(table: Mapping[str, Any], key: str) -> Any:
    if key not in table:
        raise CannotSayError("a value without a scale")
    return table[key]


def _fraction(number: int | str) -> Fraction:
    try:
        return Fraction(number)
    except ValueError:  # a setting may be a name
        raise CannotSayError("a value that is no number") from None


def _ratio(value: Fraction) -> str:
    return f"{{{_integer(value.numerator)}, {_integer(value.denominator)}}}"


def _integer(value: int) -> str:
    if not _LEAST <= value <= _GREATEST:
        raise CannotSayError("a value of more than 64 bits")
    return integer(value, 8, signed=True)


def _between(unit: str, wanted: str) -> Fraction:
    """Return what a value in one unit is multiplied by, to be one in another."""
    (above, _, below), (wanted_above, _, wanted_below) = unit.partition("/"), wanted.partition("/")
    for powers in _POWERS:
        if below == wanted_below and above in powers and wanted_above in powers:
            return Fraction(10) ** (powers[above] - powers[wanted_above])
    if unit != wanted:
        raise CannotSayError("a value in a unit of something else")
    return Fraction(1)
