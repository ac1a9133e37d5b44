"""What a scale makes of counts, without how it is written or where it is from."""

from __future__ import annotations

from collections.abc import Hashable

from stagewire_generator.model import Factor, Json, Quantity

__all__ = ["Scale", "exact", "known", "same_scale"]

Scale = Factor | Json | str | None
"""A factor; a rule (``{"by": …}``, ``{"unknown": why}``); why there is none; nothing at all."""

_NOTES = ("printed", "source", "page")


def known(scale: Scale) -> bool:
    """Whether counts can be converted by the scale, given what it depends on."""
    return isinstance(scale, Factor) or (isinstance(scale, dict) and "by" in scale)


def exact(scale: Scale) -> Hashable:
    """Return what decides a conversion: two scales that convert alike give the same."""
    if isinstance(scale, Factor):
        return scale.counts_per_unit
    if not isinstance(scale, dict) or not known(scale):
        return None
    facts: dict[str, Hashable] = {key: v for key, v in scale.items() if key not in _NOTES}
    if "units" in scale:
        facts["units"] = frozenset((unit, exact(factor)) for unit, factor in scale["units"].items())
    if "cases" in scale:
        cases = scale["cases"].items()
        facts["cases"] = frozenset((name, c["unit"], exact(c["scale"])) for name, c in cases)
    return frozenset(facts.items())


def same_scale(old: Quantity, new: Quantity) -> bool:
    """Whether fields of the one quantity convert as fields of the other.

    Two quantities by stage do not: each has factors of its own in the stages.
    """
    one, other = (quantity.factor or quantity.rule for quantity in (old, new))
    if isinstance(one, dict) and one.get("by") == "stage":
        return False
    return old.unit == new.unit and exact(one) == exact(other)
