"""Resolve scales to exact factors, and the quantities and stages that have them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction
from typing import TypeAlias

from stagewire_generator.diagnostics import Place
from stagewire_generator.model import (
    Json,
)
from stagewire_generator.model_scales import (
    Conflict,
    Controller,
    Factor,
    Limit,
    Quantity,
    Stage,
    StageId,
)
from stagewire_generator.resolver.tables import Tables
from stagewire_generator.scales import FACTOR, RATIONAL
from stagewire_generator.strict_yaml import Document

_LIMIT_UNITS = {
    key.format(unit): shown.format(unit)
    for unit in ("mm", "deg")
    for key, shown in (("{}", "{}"), ("{}_per_s", "{}/s"), ("{}_per_s2", "{}/s^2"))
}
_Scale: TypeAlias = Factor | Conflict | str  # a text states why it is unknown
_APART = Fraction(101, 100)
"""The least ratio of two figures that contradict each other."""
_WITHOUT_SOURCE = (
    "give the scale a `source` or a `page`; the page of the stage only counts for controllers with "
    "`units` and a `page`"
)


def define_quantities(tables: Tables) -> None:
    """Fill the table of quantities."""
    entries = tables.entries("quantities", "quantities", tables.quantities)
    for document, name, entry, place in entries:
        unit = entry.get("unit", "")
        found = _scale(tables, entry["scale"], unit, place)
        overlay = document.overlay_of("quantities", name, "scale")
        factor, rule = (
            (replace(found, overlay=overlay), {}) if isinstance(found, Factor) else (None, found)
        )
        tables.quantities[name] = Quantity(
            name,
            unit,
            entry["page"],
            entry["summary"],
            factor,
            rule,
            place,
            document.overlay,
            entry.get("rotary_unit", ""),
        )
        if "rotary_unit" in entry and rule.get("by") != "stage":
            what = f"{name} has a rotary_unit, but its scale does not depend on the stage"
            at = document.place("quantities", name, "rotary_unit")
            tables.diagnostics.add(at, "SW037", what, "remove it, or write `scale: {by: stage}`")


def resolve_settings(tables: Tables) -> Json:
    """Return the settings that scales depend on, sorted by name, each with the overlay that defines it."""
    settings: dict[str, Json] = {}
    for document, name, entry, _ in tables.entries("quantities", "settings", settings):
        settings[name] = {**entry, **({"overlay": document.overlay} if document.overlay else {})}
    return {name: settings[name] for name in sorted(settings)}


def resolve_stages(tables: Tables) -> tuple[tuple[Controller, ...], tuple[Stage, ...]]:
    """Return the controllers, and the stages with their factors on each."""
    controllers: dict[str, Controller] = {}
    stages: dict[str, Stage] = {}
    files = tables.files.get("stages", [])
    for document in files:
        for name, entry in document.data.get("controllers", {}).items():
            place = document.place("controllers", name)
            units, aliases = tuple(entry.get("units", ())), entry.get("aliases", {})
            page = entry.get("page")
            controllers[name] = Controller(name, units, place, document.overlay, aliases, page)
    alike: list[tuple[Document, str, Json]] = []
    for document in files:
        for name, entry in document.data.get("stages", {}).items():
            if "like" in entry:
                alike.append((document, name, entry))
            else:
                stages[name] = _stage(tables, controllers, document, name, entry)
    with_scales = dict(stages)
    for document, name, entry in alike:
        place = document.place("stages", name)
        what = "stage with its own scales:"
        other = tables.look_up(
            with_scales, entry["like"], what, document.place("stages", name, "like")
        )
        if other is not None:
            if entry.get("rotary") and not other.rotary:
                what = f"{name} is rotary, but {other.name} is not"
                hint = f"remove `rotary`, or give {name} its own scales"
                tables.diagnostics.add(
                    document.place("stages", name, "rotary"), "SW037", what, hint
                )
            stages[name] = Stage(
                name,
                entry["title"],
                entry["page"],
                _inherited(other, document.overlay),
                place,
                document.overlay,
                {**other.limits, **_limits(tables, document, name, entry, other.rotary)},
                tuple(entry.get("catalogue", ())),
                other.rotary,
                entry.get("axis", ""),
                _ids(document, name, entry),
                *_defaults(entry),
            )
    return tuple(controllers.values()), tuple(stages.values())


def _stage(
    tables: Tables,
    controllers: Mapping[str, Controller],
    document: Document,
    name: str,
    entry: Json,
) -> Stage:
    path = ("stages", name)
    scales: dict[str, dict[str, Factor | Conflict | str]] = {}
    rotary = entry.get("rotary", False)
    for controller, quantities in entry["controllers"].items():
        place = document.place(*path, "controllers", controller)
        group = tables.look_up(controllers, controller, "controller", place)
        for quantity, scale in quantities.items():
            place = document.place(*path, "controllers", controller, quantity)
            found = tables.look_up(tables.quantities, quantity, "quantity", place)
            unit = found.unit if found else ""
            if found and rotary:
                unit = found.rotary_unit
                if not unit:
                    what = f"{name} is rotary, but {quantity} has no rotary_unit"
                    hint = f"add `rotary_unit` to {quantity} in quantities.yaml"
                    tables.diagnostics.add(place, "SW037", what, hint)
                    continue
            factor = scale.get("unknown") or (
                _conflict(tables, scale["conflict"], unit, place)
                if "conflict" in scale
                else _factor(tables, scale, unit, place)
            )
            overlay = document.overlay_of(*path, "controllers", controller, quantity)
            is_added = (
                overlay != document.overlay
            )  # the page of the stage is then of another document
            printed = group is None or (
                group.units and group.page and (not is_added or overlay == group.overlay)
            )
            if factor:
                page = group.page if group and printed and is_added else None
                scales.setdefault(controller, {})[quantity] = _from(overlay, factor, page)
            if isinstance(factor, Factor) and not (printed or factor.source or factor.page):
                what = f"{name}: the scale of {quantity} on {controller} has no source and no page"
                tables.diagnostics.add(place, "SW037", what, _WITHOUT_SOURCE)
    place = document.place(*path)
    return Stage(
        name,
        entry["title"],
        entry["page"],
        scales,
        place,
        document.overlay,
        _limits(tables, document, name, entry, rotary),
        tuple(entry.get("catalogue", ())),
        rotary,
        entry.get("axis", ""),
        _ids(document, name, entry),
        *_defaults(entry),
    )


def _ids(document: Document, stage: str, entry: Json) -> dict[str, StageId]:
    """Return the numbers of a stage in messages."""
    return {
        field: StageId(
            found["id"],
            found.get("source", ""),
            found.get("page"),
            document.overlay_of("stages", stage, "ids", field),
        )
        for field, found in entry.get("ids", {}).items()
    }


def _defaults(entry: Json) -> tuple[dict[str, dict[str, str]], str, str]:
    """Return the parameters of the vendor's program for a stage, their source and a note."""
    found = dict(entry.get("defaults", {}))
    source, note = found.pop("source", ""), found.pop("note", "")
    return found, source, note


def _limits(
    tables: Tables, document: Document, stage: str, entry: Json, rotary: bool
) -> dict[str, Limit | str]:
    """Return the limits of a stage; for an unknown limit, the reason."""
    limits: dict[str, Limit | str] = {}
    for name, limit in entry.get("limits", {}).items():
        if "unknown" in limit:
            limits[name] = limit["unknown"]
            continue
        source, page, note = limit.get("source", ""), limit.get("page"), limit.get("note", "")
        overlay = document.overlay_of("stages", stage, "limits", name)
        if "endless" in limit:
            limits[name] = Limit(None, "", source, page, note, overlay)
            continue
        [key] = limit.keys() & _LIMIT_UNITS.keys()  # the schema requires exactly one
        if rotary != key.startswith("deg"):
            place = document.place("stages", stage, "limits", name, key)
            what = f"{stage}: {name} is in {_LIMIT_UNITS[key]}"
            hint = "a rotary stage has limits in deg, any other stage in mm"
            tables.diagnostics.add(place, "SW037", what, hint)
        value = Fraction(str(limit[key]))
        limits[name] = Limit(value, _LIMIT_UNITS[key], source, page, note, overlay)
    return limits


def _from(overlay: str, scale: _Scale, page: int | None = None) -> _Scale:
    """Return a scale with the overlay whose document its page belongs to.

    :param page: the page of a factor without a page or source of its own.
    """
    if isinstance(scale, Conflict):
        return Conflict({s: replace(f, overlay=overlay) for s, f in scale.factors.items()})
    if not isinstance(scale, Factor):
        return scale
    return replace(scale, overlay=overlay, page=scale.page if scale.page or scale.source else page)


def _inherited(stage: Stage, overlay: str) -> Mapping[str, Mapping[str, _Scale]]:
    """Return the scales of a stage for one that is like it.

    A scale without a page of its own keeps the page of its stage if that is in another document.

    :param overlay: the overlay that defines the other stage.
    """
    if overlay == stage.overlay:
        return stage.scales
    return {
        controller: {
            name: _from(scale.overlay, scale, stage.page) if isinstance(scale, Factor) else scale
            for name, scale in scales.items()
        }
        for controller, scales in stage.scales.items()
    }


def _conflict(tables: Tables, figures: Json, unit: str, place: Place) -> Conflict | None:
    """Return the factors of sources that contradict each other, or None, with a diagnostic."""
    found = {source: _factor(tables, entry, unit, place) for source, entry in figures.items()}
    factors = {source: factor for source, factor in found.items() if factor}
    if len(factors) < len(found):
        return None
    values = [factor.counts_per_unit for factor in factors.values()]
    if max(values) < min(values) * _APART:
        what = f"{' and '.join(factors)} differ by less than 1 %, which is not a conflict"
        hint = "keep one of them, and name the other in its `note`"
        tables.diagnostics.add(place, "SW037", what, hint)
        return None
    return Conflict(factors)


def _factor(tables: Tables, entry: Json, unit: str, place: Place) -> Factor | None:
    """Return the exact factor of a scale, or None, with a diagnostic, if it has none or several.

    :param unit: the unit that its key must name; empty if unknown.
    """
    keys = [key for key in entry if FACTOR.match(key)]
    if len(keys) != 1:
        what = f"expected one factor, counts_per_UNIT or UNIT_per_count, found {len(keys)}"
        tables.diagnostics.add(place, "SW037", what)
        return None
    text = str(entry[keys[0]])
    if not RATIONAL.match(text):
        what = f"{keys[0]}: {text} is not an exact positive rational"
        tables.diagnostics.add(place, "SW037", what)
        return None
    spelled = unit.lower().replace("/", "_per_").replace("^", "")
    if unit and keys[0] not in (f"counts_per_{spelled}", f"{spelled}_per_count"):
        hint = f"write counts_per_{spelled} or {spelled}_per_count, or correct the unit"
        what = f"{keys[0]} does not match the unit {unit}"
        tables.diagnostics.add(place, "SW037", what, hint)
        return None
    return Factor(
        keys[0],
        Fraction(text),
        str(entry.get("printed", "")),
        entry.get("source", ""),
        entry.get("page"),
        entry.get("note", ""),
    )


def _scale(tables: Tables, scale: Json, unit: str, place: Place) -> Factor | Json:
    """Return an exact factor, or the rule of a dependent scale with exact factors."""
    if "by" not in scale and "unknown" not in scale:
        return _factor(tables, scale, unit, place) or {}
    rule = dict(scale)
    if "units" in rule:
        factors = {
            device: _factor(tables, entry, unit, place) for device, entry in rule["units"].items()
        }
        rule["units"] = {device: factor for device, factor in factors.items() if factor}
    if "cases" in rule:
        rule["cases"] = {
            name: {**case, "scale": _scale(tables, case["scale"], case["unit"], place)}
            for name, case in rule["cases"].items()
        }
    return rule
