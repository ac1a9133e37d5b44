"""Views of enumerations, flag tables, quantities and stages."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from decimal import Decimal
from typing import NamedTuple

from stagewire_generator.model import Protocol
from stagewire_generator.model_fields import Enumeration, FlagTable
from stagewire_generator.model_scales import (
    Conflict,
    Factor,
    Limit,
    Quantity,
    Stage,
)
from stagewire_generator.naming import camel
from stagewire_generator.targets.documentation import evidence_text, sentence, where
from stagewire_generator.targets.python.brackets import (
    Nested,
    Source,
    Text,
    call,
    keyed,
    mapping,
    strings,
)
from stagewire_generator.targets.python.source import docstring, literal, paragraph


class MemberView(NamedTuple):
    """A named value, or a bit.

    :param note: its description, or empty; escaped for a docstring if it belongs to a value.
    """

    name: str
    value: str
    note: str


class NamedView(NamedTuple):
    """An enumeration or a flag table."""

    name: str
    doc: str
    members: tuple[MemberView, ...]


class QuantityView(NamedTuple):
    """A quantity with a constant scale."""

    name: str
    scale: Nested
    doc: str


class SharedView(NamedTuple):
    """A constant of several stages: a table of scales, or the units of a family of controllers."""

    name: str
    type: str
    made: Nested


class StageView(NamedTuple):
    """A stage."""

    name: str
    place: str  # the page in one of several documents, and the evidence; may be empty
    made: Nested  # the call that creates it


def enumeration_view(protocol: Protocol, enumeration: Enumeration) -> NamedView:
    """Make the view of an enumeration."""
    members = []
    for value in enumeration.values:
        sign = "-" if value.value < 0 else ""
        note = docstring(paragraph(sentence(value.note), 4)) if value.note else ""
        members.append(MemberView(value.name, f"{sign}0x{abs(value.value):02X}", note))
    doc = _named_doc(protocol, "Values", "enumerations", enumeration)
    return NamedView(camel(enumeration.name), doc, tuple(members))


def flag_table_view(protocol: Protocol, table: FlagTable) -> NamedView:
    """Make the view of a flag table."""
    digits = 2 * table.format.size
    members = tuple(
        MemberView(bit.name, f"0x{bit.mask:0{digits}X}", bit.note) for bit in table.bits
    )
    return NamedView(camel(table.name), _named_doc(protocol, "Bits", "flags", table), members)


def _named_doc(protocol: Protocol, kind: str, section: str, table: Enumeration | FlagTable) -> str:
    head = f"{kind} of ``{table.name}`` ({where(protocol, [table.page], table.overlay)})."
    more = [
        table.summary,
        f"The list may be incomplete: {sentence(table.open)}" if table.open else "",
        f"{found}." if (found := evidence_text(protocol, section, table.name)) else "",
    ]
    text = "\n\n    ".join(paragraph(part, 4) for part in more if part)
    return docstring(f"{head}\n\n    {text}\n    " if text else head)


def quantity_view(protocol: Protocol, quantity: Quantity, factor: Factor) -> QuantityView:
    """Make the view of a quantity with a constant factor."""
    found = (
        where(protocol, [factor.page], factor.overlay)
        if factor.page
        else where(protocol, [quantity.page], quantity.overlay)
    )
    text = f"{quantity.summary.rstrip('.')} ({found})"
    doc = docstring(paragraph(sentence(text), 0))
    return QuantityView(quantity.name.upper(), scale_of(factor, quantity.unit), doc)


def scale_of(factor: Factor, unit: str) -> Nested:
    """Return the call that creates a scale."""
    method = "unit_per" if factor.key.endswith("_per_count") else "counts_per"
    value = factor.value
    arguments: list[Source] = [literal(unit), str(value.numerator), str(value.denominator)]
    if factor.printed:
        arguments.append(f"printed={literal(factor.printed)}")
    if factor.source:
        arguments.append(Text("source=", factor.source))
    return call(f"Scale.{method}", arguments)


def stage_views(protocol: Protocol) -> tuple[tuple[SharedView, ...], tuple[StageView, ...]]:
    """Make the views of all stages, and of the constants that several of them share.

    Most stages share their scales with others of the same lead screw and motor. A shared table is named after
    the first stage and controller that have it.
    """
    stages = sorted(protocol.stages, key=lambda stage: stage.name)
    members = {c.name: strings("", c.members) for c in protocol.controllers}
    scales = {stage.name: _scale_tables(protocol, stage) for stage in stages}
    tables: dict[Nested, list[SharedView]] = {}
    families: dict[Nested, list[SharedView]] = {}
    for stage in stages:
        for controller, made in scales[stage.name].items():
            kinds = " | ".join(sorted({_kind(f) for f in stage.scales[controller].values()}))
            table = SharedView(f"_{stage.name}_ON_{controller}", f"dict[str, {kinds}]", made)
            tables.setdefault(made, []).append(table)
            family = SharedView(f"_{controller}_UNITS", "tuple[str, ...]", members[controller])
            families.setdefault(family.made, []).append(family)
    shared = [
        views[0]
        for made, views in (*families.items(), *tables.items())
        if len(views) > 1 and len(made.items) > 1
    ]
    names = {view.made: view.name for view in shared}

    def named(made: Mapping[str, Nested], stage: Stage) -> list[Source]:
        """Return an item for each family of controllers that drives a stage."""
        return [keyed(literal(c), names.get(made[c], made[c])) for c in stage.scales]

    return tuple(shared), tuple(
        _stage_view(protocol, stage, named(scales[stage.name], stage), named(members, stage))
        for stage in stages
    )


def _scale_tables(protocol: Protocol, stage: Stage) -> dict[str, Nested]:
    """Return the scales of a stage on each controller."""
    units = {quantity.name: quantity.unit_on(stage) for quantity in protocol.quantities}
    return {
        controller: mapping(
            "",
            [
                keyed(literal(name), _scale(_placed(protocol, stage, factor), units[name]))
                for name, factor in factors.items()
            ],
            broken=True,
        )
        for controller, factors in stage.scales.items()
    }


def _kind(factor: Factor | Conflict | str) -> str:
    """Return the class of a scale."""
    if isinstance(factor, Factor):
        return "Scale"
    return "ScaleConflict" if isinstance(factor, Conflict) else "UnknownScale"


def _stage_view(
    protocol: Protocol, stage: Stage, scales: Sequence[Source], families: Sequence[Source]
) -> StageView:
    """Make the view of a stage.

    :param scales: its scales, an item for each family of controllers.
    :param families: the units of these families.
    """
    arguments: list[Source] = [
        literal(stage.name),
        literal(stage.title),
        f"page={stage.page}",
        mapping("scales=", scales, broken=True),
        mapping("controllers=", families, broken=True),
    ]
    if stage.limits:
        limits = [
            keyed(literal(name), _limit(protocol, limit)) for name, limit in stage.limits.items()
        ]
        arguments.append(mapping("limits=", limits, broken=True))
    if stage.defaults:
        defaults = [
            keyed(
                literal(name),
                mapping("", [f"{literal(f)}: {literal(value)}" for f, value in values.items()]),
            )
            for name, values in stage.defaults.items()
        ]
        arguments.append(mapping("defaults=", defaults, broken=True))
        arguments.append(Text("defaults_source=", stage.defaults_source))
    if stage.catalogue:
        arguments.append(strings("catalogue=", stage.catalogue))
    if stage.rotary:
        arguments.append("rotary=True")
    if stage.ids:
        ids = [keyed(literal(name), f"0x{found.id:02X}") for name, found in stage.ids.items()]
        arguments.append(mapping("ids=", ids))
    found = where(protocol, [stage.page], stage.overlay) if protocol.overlays else ""
    shown = evidence_text(protocol, "stages", stage.name)
    place = f"{found}; {shown[0].lower()}{shown[1:]}" if found and shown else found or shown
    return StageView(stage.name, place, call("Stage", arguments, broken=True))


def _limit(protocol: Protocol, limit: Limit | str) -> Nested:
    if isinstance(limit, str):
        return call("UnknownLimit", [Text("", " ".join(limit.split()))])
    page = where(protocol, [limit.page], limit.overlay) if limit.page else ""
    if page and not protocol.overlays:
        page += " of the document"
    source = "; ".join(filter(None, [page, limit.source]))
    if limit.value is None:
        return call("EndlessTravel", [Text("", source)])
    value = Decimal(limit.value.numerator) / Decimal(limit.value.denominator)
    return call("Limit.of", [literal(str(value)), literal(limit.unit), Text("source=", source)])


def _placed(
    protocol: Protocol, stage: Stage, scale: Factor | Conflict | str
) -> Factor | Conflict | str:
    """Return a scale whose source names its page, and the document if there are several.

    With one document, the page of a scale without a source is that of the stage.
    """
    if isinstance(scale, Conflict):
        factors = {name: _sourced(protocol, factor) for name, factor in scale.factors.items()}
        return Conflict(factors)
    if isinstance(scale, str) or not protocol.overlays:
        return scale
    if scale.page is None and not scale.source:
        scale = replace(scale, page=stage.page, overlay=stage.overlay)
    return _sourced(protocol, scale)


def _scale(factor: Factor | Conflict | str, unit: str) -> Nested:
    """Return the scale of a quantity in the table of a controller."""
    if isinstance(factor, Conflict):
        sources = [keyed(literal(s), scale_of(f, unit)) for s, f in factor.factors.items()]
        figures = mapping("", sources, broken=True)
        return call("ScaleConflict.of", [literal(unit), figures], broken=True)
    if isinstance(factor, str):
        reason = Text("", " ".join(factor.split()))
        return call("UnknownScale", [literal(unit), reason], broken=True)
    return scale_of(factor, unit)


def _sourced(protocol: Protocol, factor: Factor) -> Factor:
    """Return a factor whose source begins with its page."""
    page = where(protocol, [factor.page], factor.overlay) if factor.page else ""
    return replace(factor, source="; ".join(filter(None, [page, factor.source])))
