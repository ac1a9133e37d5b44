"""Enumerations, flag tables and stages."""

from __future__ import annotations

from dataclasses import dataclass
from decimal import Decimal
from fractions import Fraction

from stagewire_generator.model import (
    Enumeration,
    Factor,
    FlagTable,
    Limit,
    Protocol,
    Quantity,
    Stage,
)
from stagewire_generator.naming import camel
from stagewire_generator.targets.documentation import sentence
from stagewire_generator.targets.python.source import (
    WIDTH,
    call,
    docstring,
    literal,
    long_text,
    paragraph,
    tuple_of,
    where,
)


@dataclass(frozen=True, slots=True)
class NamedView:
    """An enumeration or a flag table."""

    name: str
    doc: str
    members: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class QuantityView:
    """A quantity whose scale depends on nothing."""

    name: str
    source: str
    doc: str


@dataclass(frozen=True, slots=True)
class StageView:
    """A stage."""

    name: str
    source: str


def enumeration_view(protocol: Protocol, enumeration: Enumeration) -> NamedView:
    """Make the view of an enumeration."""
    members = []
    for value in enumeration.values:
        sign = "-" if value.value < 0 else ""
        members.append(f"{value.name} = {sign}0x{abs(value.value):02X}")
        if value.note:
            members.append(f'"""{docstring(paragraph(sentence(value.note), 4))}"""')
    doc = _named_doc(protocol, "Values", enumeration)
    return NamedView(camel(enumeration.name), doc, tuple(members))


def flag_table_view(protocol: Protocol, table: FlagTable) -> NamedView:
    """Make the view of a flag table."""
    members = []
    digits = 2 * table.format.size
    for bit in table.bits:
        arguments = [f"0x{bit.mask:0{digits}X}"]
        if bit.note:
            arguments.append(literal(bit.note))
        members.append(call(f"{bit.name} = Bit", arguments, "", 4))
    doc = _named_doc(protocol, "Bits", table)
    return NamedView(camel(table.name), doc, tuple(members))


def _named_doc(protocol: Protocol, kind: str, table: Enumeration | FlagTable) -> str:
    head = f"{kind} of ``{table.name}`` ({where(protocol, [table.page], table.overlay)})."
    more = [
        table.summary,
        f"The list may be incomplete: {sentence(table.open)}" if table.open else "",
    ]
    text = "\n\n    ".join(paragraph(part, 4) for part in more if part)
    return docstring(f"{head}\n\n    {text}\n    " if text else head)


def quantity_view(protocol: Protocol, quantity: Quantity, factor: Factor) -> QuantityView:
    """Make the view of a quantity whose factor depends on nothing."""
    name = quantity.name.upper()
    source = call(f"{name} = {_method(factor)}", _arguments(factor, quantity.unit, 4), "", 0)
    found = where(protocol, [factor.page or quantity.page], quantity.overlay)
    text = f"{quantity.summary.rstrip('.')} ({found})"
    return QuantityView(name, source, docstring(paragraph(sentence(text), 0)))


def stage_view(protocol: Protocol, stage: Stage) -> StageView:
    """Make the view of a stage."""
    units = {quantity.name: quantity.unit for quantity in protocol.quantities}
    controllers = {controller.name: controller.members for controller in protocol.controllers}
    scales = []
    families = []
    for controller, factors in stage.scales.items():
        lines = "".join(
            f"            {_scale(name, factor, units[name])}\n" for name, factor in factors.items()
        )
        scales.append(f"        {literal(controller)}: {{\n{lines}        }},\n")
        names = [literal(unit) for unit in controllers[controller]]
        listed = tuple_of(names)
        if len(f"        {literal(controller)}: {listed},") > WIDTH:
            listed = call("", names, "", 8, 0)
        families.append(f"        {literal(controller)}: {listed},\n")
    remark = f"# The page is one of the overlay {stage.overlay}.\n" if stage.overlay else ""
    source = (
        f"{remark}{stage.name} = Stage(\n"
        f"    {literal(stage.name)},\n"
        f"    {literal(stage.title)},\n"
        f"    page={stage.page},\n"
        f"    scales={{\n{''.join(scales)}    }},\n"
        f"    controllers={{\n{''.join(families)}    }},\n"
        f"{_limits(stage)}"
        ")"
    )
    return StageView(stage.name, source)


def _limits(stage: Stage) -> str:
    """Return the argument with the limits of a stage; empty where it has none."""
    if not stage.limits:
        return ""
    lines = []
    for name, limit in stage.limits.items():
        if isinstance(limit, str):
            reason = long_text("", " ".join(limit.split()), 12)
            lines.append(call(f"{literal(name)}: UnknownLimit", [reason], ",", 8))
        else:
            arguments = [literal(_decimal(limit.value)), literal(limit.unit)]
            arguments.append(long_text("source=", _source(stage, limit), 12))
            lines.append(call(f"{literal(name)}: Limit.of", arguments, ",", 8))
    entries = "".join(f"        {line}\n" for line in lines)
    return f"    limits={{\n{entries}    }},\n"


def _source(stage: Stage, limit: Limit) -> str:
    page = f"page {limit.page} of {stage.overlay or 'the document'}" if limit.page else ""
    return "; ".join(filter(None, [page, limit.source]))


def _decimal(value: Fraction) -> str:
    return str(Decimal(value.numerator) / Decimal(value.denominator))


def _scale(name: str, factor: Factor | str, unit: str) -> str:
    """Return the entry of a quantity in the table of a controller."""
    if isinstance(factor, str):
        reason = long_text("", " ".join(factor.split()), 16)
        return call(f"{literal(name)}: UnknownScale", [literal(unit), reason], ",", 12, 0)
    return call(f"{literal(name)}: {_method(factor)}", _arguments(factor, unit, 16), ",", 12)


def _method(factor: Factor) -> str:
    return f"Scale.{'unit_per' if factor.key.endswith('_per_count') else 'counts_per'}"


def _arguments(factor: Factor, unit: str, indent: int) -> list[str]:
    value = factor.value
    arguments = [literal(unit), str(value.numerator), str(value.denominator)]
    if factor.printed:
        arguments.append(f"printed={literal(factor.printed)}")
    if factor.source:
        arguments.append(long_text("source=", factor.source, indent))
    return arguments
