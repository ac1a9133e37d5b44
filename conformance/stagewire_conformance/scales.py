"""Scales from the registry's data: exact factors, and the rounded ones that the document prints."""

from __future__ import annotations

import re
from collections.abc import Mapping
from fractions import Fraction
from typing import Any

from stagewire.errors import UnknownScaleError
from stagewire.quantities import Scale, exact
from stagewire_conformance.registry import Registry

__all__ = ["factor", "printed_factor", "scale_of", "stated_rule"]

Json = dict[str, Any]

_NUMBER = re.compile(r"[0-9][0-9,]*(?:\.[0-9]+)?")


def factor(rule: Mapping[str, Any], unit: str) -> Scale | None:
    """Return the scale that ``rule`` writes as one factor, or None when it depends on something."""
    for key, value in rule.items():
        if not isinstance(value, dict) or "numerator" not in value:
            continue
        fraction = Fraction(value["numerator"], value["denominator"])
        if key.endswith("_per_count"):
            fraction = 1 / fraction
        return Scale(fraction, unit, str(rule.get("printed", "")), rule.get("source", ""))
    return None


def printed_factor(scale: Scale) -> Fraction | None:
    """Return the factor as the document prints it, in counts per unit; None if it prints no number."""
    numbers = _NUMBER.findall(scale.printed)
    return exact(numbers[-1].replace(",", "")) if len(numbers) == 1 else None


def stated_rule(registry: Registry, stated: Mapping[str, Any]) -> Json:
    """Return the rule of the registry for a stated value: its stage's, its unit's or its quantity's.

    Raises :class:`UnknownScaleError` when the registry has none.
    """
    name = stated["quantity"]
    quantity = registry.table("quantities").get(name)
    if quantity is None:
        raise UnknownScaleError(f"the registry has no quantity {name}")
    rule: Json = {"unit": quantity["unit"], **quantity["scale"]}
    if rule.get("by") == "setting" and "cases" in rule:
        case = rule["cases"].get(str(stated.get("setting", {}).get(rule["setting"])))
        if case is None:
            raise UnknownScaleError(f"{name} needs {rule['setting']}: {', '.join(rule['cases'])}")
        rule = {"unit": case["unit"], **case["scale"]}
    if rule.get("by") == "unit":
        unit = stated.get("controller") or stated.get("device")
        if unit not in rule["units"]:
            raise UnknownScaleError(f"{name} is not known on {unit}")
        return {"unit": rule["unit"], **rule["units"][unit]}
    if rule.get("by") == "stage":
        stage = registry.table("stages").get(stated.get("stage", ""))
        scales = (stage or {}).get("controllers", {}).get(stated.get("controller"), {})
        if name not in scales:
            where = f"{stated.get('stage')} on {stated.get('controller')}"
            raise UnknownScaleError(f"{name} of {where} is not in the registry")
        return {"unit": rule["unit"], **scales[name]}
    return rule


def scale_of(registry: Registry, stated: Mapping[str, Any]) -> Scale:
    """Return the exact scale that applies to a stated value.

    Raises :class:`UnknownScaleError` when nothing states one.
    """
    rule = stated_rule(registry, stated)
    unit = rule["unit"]
    if "unknown" in rule:
        raise UnknownScaleError(f"{stated['quantity']}: {rule['unknown']}")
    if rule.get("by") == "setting":
        setting = rule["setting"]
        value = stated.get("setting", {}).get(setting)
        if value is None:
            raise UnknownScaleError(f"{stated['quantity']} depends on {setting}, which is not stated")
        return Scale(Fraction(rule["counts_at_setting"]) / exact(value), unit)
    found = factor(rule, unit)
    if found is None:
        raise UnknownScaleError(f"{stated['quantity']} has no factor in the registry")
    return found
