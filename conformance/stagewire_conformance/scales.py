"""Scales from the registry: exact factors, and the rounded ones that the document prints."""

from __future__ import annotations

import re
from collections.abc import Mapping
from fractions import Fraction
from typing import Any

from stagewire.errors import UnknownScaleError
from stagewire.quantities import Scale, exact
from stagewire_conformance.registry import Registry

Json = dict[str, Any]

_THOUSAND = Fraction(1000)
_SAME = (  # units of the same quantity, relative to the first
    {"s": Fraction(1), "ms": 1 / _THOUSAND, "us": 1 / _THOUSAND**2},
    {"m": Fraction(1), "mm": 1 / _THOUSAND, "um": 1 / _THOUSAND**2, "nm": 1 / _THOUSAND**3},
    {"V": Fraction(1), "mV": 1 / _THOUSAND},
)
_NUMBER = re.compile(r"[0-9][0-9,]*(?:\.[0-9]+)?")


def factor(rule: Mapping[str, Any], unit: str) -> Scale | None:
    """Return the scale if ``rule`` is a single factor; None if it depends on something."""
    for key, value in rule.items():
        if not isinstance(value, dict) or "numerator" not in value:
            continue
        fraction = Fraction(value["numerator"], value["denominator"])
        if key.endswith("_per_count"):
            fraction = 1 / fraction
        return Scale(fraction, unit, str(rule.get("printed", "")), rule.get("source", ""))
    return None


def printed_factor(scale: Scale) -> Fraction | None:
    """Return the factor that the document prints, in counts per unit; None if it prints no number.

    It may be a number (``134218``), arithmetic with its result (``512 x 67 = 34,304``), or an equation of
    counts and units (``3430 Encoder Counts/sec = 0.1 mm/sec``).
    """
    left, equals, right = scale.printed.partition("=")
    numbers, results = _NUMBER.findall(left), _NUMBER.findall(right)
    if not equals and len(numbers) == 1:
        return _number(numbers[0])
    if len(numbers) == 1 and len(results) == 1:
        return _number(numbers[0]) / _number(results[0])
    if len(numbers) > 1 and len(results) == 1:
        return _number(results[0])
    return None


def _number(text: str) -> Fraction:
    return exact(text.replace(",", ""))


def in_unit(value: Fraction, unit: str, wanted: str) -> Fraction:
    """Convert a value to another unit of the same quantity, such as 2 s to ms or 1 mm/s to um/s.

    Raises :class:`UnknownScaleError` if the units measure different quantities.
    """
    if unit == wanted:
        return value
    above, _, below = unit.partition("/")
    wanted_above, _, wanted_below = wanted.partition("/")
    if below == wanted_below:
        for kind in _SAME:
            if above in kind and wanted_above in kind:
                return value * kind[above] / kind[wanted_above]
    raise UnknownScaleError(f"the registry uses {wanted}, and {unit} cannot be converted")


def _rule(registry: Registry, stated: Mapping[str, Any]) -> Json:
    """Return the rule of the registry for a stated value: that of its stage, its unit or its quantity.

    Raises :class:`UnknownScaleError` if the registry has none.
    """
    name = stated["quantity"]
    quantity = registry.table("quantities").get(name)
    if quantity is None:
        raise UnknownScaleError(f"unknown quantity {name}")
    rule: Json = {"unit": quantity["unit"], **quantity["scale"]}
    if rule.get("by") == "setting" and "cases" in rule:
        case = rule["cases"].get(str(stated.get("setting", {}).get(rule["setting"])))
        if case is None:
            raise UnknownScaleError(
                f"{name} requires {rule['setting']}: {', '.join(rule['cases'])}"
            )
        rule = {"unit": case["unit"], **case["scale"]}
    if rule.get("by") == "unit":
        unit = stated.get("controller") or stated.get("device")
        if unit not in rule["units"]:
            raise UnknownScaleError(f"{name} is not defined for {unit}")
        return {"unit": rule["unit"], **rule["units"][unit]}
    if rule.get("by") == "stage":
        stage = registry.table("stages").get(stated.get("stage", ""))
        scales = (stage or {}).get("controllers", {}).get(stated.get("controller"), {})
        if name not in scales:
            where = f"{stated.get('stage')} on {stated.get('controller')}"
            raise UnknownScaleError(f"{name} of {where} is not in the registry")
        rotary = (stage or {}).get("rotary")
        unit = quantity.get("rotary_unit") if rotary else rule["unit"]
        return {"unit": unit, **scales[name]}
    return rule


def scale_of(registry: Registry, stated: Mapping[str, Any]) -> Scale:
    """Return the exact scale of a stated value.

    Raises :class:`UnknownScaleError` if the scale is unknown.
    """
    rule = _rule(registry, stated)
    unit = rule["unit"]
    if "unknown" in rule:
        raise UnknownScaleError(f"{stated['quantity']}: {rule['unknown']}")
    if "conflict" in rule:
        sources = " and ".join(rule["conflict"])
        raise UnknownScaleError(f"{stated['quantity']}: {sources} contradict each other")
    if rule.get("by") == "setting":
        setting = rule["setting"]
        value = stated.get("setting", {}).get(setting)
        if value is None:
            raise UnknownScaleError(
                f"{stated['quantity']} depends on {setting}, which is not stated"
            )
        return Scale(Fraction(rule["counts_at_setting"]) / exact(value), unit)
    found = factor(rule, unit)
    if found is None:
        raise UnknownScaleError(f"{stated['quantity']} has no factor in the registry")
    return found
