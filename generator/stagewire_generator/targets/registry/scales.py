"""Scales and settings as plain data: every factor as a numerator and a denominator."""

from __future__ import annotations

from fractions import Fraction

from stagewire_generator.model import Factor, Json, Limit, Quantity

__all__ = ["factor_json", "limit_json", "scale_json", "setting_json"]


def scale_json(quantity: Quantity) -> Json:
    """Return the scale of a quantity: its factor, or what it depends on."""
    return factor_json(quantity.factor) if quantity.factor else _rule(quantity.rule)


def factor_json(factor: Factor) -> Json:
    """Return an exact factor, and where it is from."""
    data: Json = {factor.key: _rational(factor.value)}
    if factor.printed:
        data["printed"] = factor.printed
    if factor.source:
        data["source"] = factor.source
    if factor.page is not None:
        data["page"] = factor.page
    return data


def limit_json(limit: Limit | str) -> Json:
    """Return a limit of a stage and where it is from, or why it is unknown."""
    if isinstance(limit, str):
        return {"unknown": limit}
    data: Json = {"value": _rational(limit.value), "unit": limit.unit}
    if limit.source:
        data["source"] = limit.source
    if limit.page is not None:
        data["page"] = limit.page
    if limit.note:
        data["note"] = limit.note
    return data


def _rule(rule: Json) -> Json:
    if "units" in rule:
        return {
            **rule,
            "units": {unit: factor_json(factor) for unit, factor in rule["units"].items()},
        }
    if "cases" in rule:
        cases = {
            name: {**case, "scale": _case(case["scale"])} for name, case in rule["cases"].items()
        }
        return {**rule, "cases": cases}
    return rule


def _case(scale: Factor | Json) -> Json:
    return factor_json(scale) if isinstance(scale, Factor) else _rule(scale)


def _rational(value: Fraction) -> Json:
    return {"numerator": value.numerator, "denominator": value.denominator}


def setting_json(setting: Json) -> Json:
    """Return a setting, and the parameter sets that tell it."""
    tellers = {
        name: {
            key: {n: _rational(Fraction(v)) for n, v in fact.items()} if key == "values" else fact
            for key, fact in teller.items()
        }
        for name, teller in setting["told_by"].items()
    }
    return {**setting, "unit": setting.get("unit"), "told_by": tellers}
