"""Views of enumerations, flag tables, and the header of conversions with its scales."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import NamedTuple

from stagewire_generator.model import Json, Protocol
from stagewire_generator.model_evidence import spelled
from stagewire_generator.model_fields import Enumeration, FlagTable
from stagewire_generator.model_scales import (
    Factor,
)
from stagewire_generator.scales import ScaleEntry, scales_of
from stagewire_generator.targets.c.source import (
    Names,
    bits_of,
    comment,
    comment_lines,
    definition,
    integer,
    names_of,
    plain,
    unsigned,
)
from stagewire_generator.targets.documentation import evidence_text, sentence, where

_ENUM_LEAST, _ENUM_GREATEST = -0x8000, 0x7FFF  # the range of int on every platform


class MemberView(NamedTuple):
    """A named value, or a bit; ``doc`` may be empty."""

    name: str
    value: str
    doc: str


class TableView(NamedTuple):
    """An enumeration or a flag table.

    :param is_enum: whether it is an ``enum``; otherwise its comment opens a group of macros.
    """

    name: str
    doc: str
    members: tuple[MemberView, ...]
    is_enum: bool


def enumeration_view(names: Names, protocol: Protocol, enumeration: Enumeration) -> TableView:
    """Make the view of an enumeration: an ``enum`` if its values fit an int everywhere, else macros."""
    name, head = names.table(enumeration), _head(protocol, "Values", enumeration)
    text = _described(protocol, "enumerations", enumeration)
    values = [value.value for value in enumeration.values]
    if all(_ENUM_LEAST <= value <= _ENUM_GREATEST for value in values):
        members = tuple(
            MemberView(
                name=f"{name}_{value.name}".upper(),
                value=str(value.value),
                doc=comment([sentence(value.note)], 4) if value.note else "",
            )
            for value in enumeration.values
        )
        return TableView(
            name,
            comment([f"{head}.", text]),
            members,
            is_enum=True,
        )
    signed = min(values) < 0
    size = 4 if max(values) < 1 << (32 - signed) and min(values) >= -(1 << 31) else 8
    members = tuple(
        MemberView(
            name=f"{name}_{value.name}".upper(),
            value=integer(value.value, size, signed),
            doc=_numbered("Value", value.value, value.note),
        )
        for value in enumeration.values
    )
    return TableView(
        name,
        _group(head, text),
        members,
        is_enum=False,
    )


def flag_table_view(names: Names, protocol: Protocol, table: FlagTable) -> TableView:
    """Make the view of a flag table: one macro per bit."""
    name, size = names.table(table), table.format.size
    members = tuple(
        MemberView(
            name=f"{name}_{bit.name}".upper(),
            value=unsigned(bit.mask, size, 2 * size),
            doc=_numbered("Bit", bit.bit, bit.note),
        )
        for bit in table.bits
    )
    doc = _group(_head(protocol, "Bits", table), _described(protocol, "flags", table))
    return TableView(name, doc, members, is_enum=False)


def _head(protocol: Protocol, kind: str, table: Enumeration | FlagTable) -> str:
    return f"{kind} of {table.name} ({where(protocol, [table.page], table.overlay)})"


def _described(protocol: Protocol, section: str, table: Enumeration | FlagTable) -> str:
    """Return the summary of a table, and its evidence."""
    found = evidence_text(protocol, section, table.name)
    parts = [sentence(table.summary) if table.summary and found else table.summary]
    return " ".join(filter(None, [*parts, f"{found}." if found else ""]))


def _numbered(kind: str, number: int, note: str) -> str:
    """Return the comment on a macro; it has one even if the registry has no note."""
    return comment([sentence(f"{kind} {number}: {note}" if note else f"{kind} {number}")])


def _group(head: str, summary: str) -> str:
    """Return the comment that opens a group of macros; the template closes the group."""
    lines = [f" * @name {plain(head)}", *([" *", *comment_lines([summary])] if summary else ())]
    return "\n".join(["/**", *lines, " * @{", " */"])


_GREATEST = 2**63 - 1  # largest numerator or denominator of a scale


class TypeView(NamedTuple):
    """An integer type that counts are converted to."""

    name: str  # int32
    named: str  # an int32_t
    minimum: str
    maximum: str


class ScaleView(NamedTuple):
    """A constant scale. An unknown scale has no name; its comment gives the reason.

    :param definition: the definition of a macro with its name and value.
    """

    comment: str
    name: str = ""
    definition: str = ""
    heading: str = ""  # a comment on this scale and the following ones


class SettingView(NamedTuple):
    """A scale that depends on a setting of the controller; counts are a fraction of the setting."""

    comment: str
    name: str
    full_scale: int


class QuantitiesView(NamedTuple):
    """The parts of the header that differ between protocols."""

    types: tuple[TypeView, ...]
    scales: tuple[ScaleView, ...]
    settings: tuple[SettingView, ...]
    example: str  # the name of a constant, or empty


def quantities_view(protocol: Protocol) -> QuantitiesView:
    """Make the view of all scales of a protocol."""
    names = names_of(protocol)
    classes_of = cache(protocol.evidence.classes_of)  # most scales share their texts with others
    scales: list[ScaleView] = []
    settings: list[SettingView] = []
    headed = ""
    for entry in scales_of(protocol):
        heading = _remark(entry.controller) if entry.controller != headed else ""
        headed = entry.controller
        if isinstance(entry.scale, Factor):
            classes = classes_of(entry.scale.source, entry.scale.note)
            scales.append(_constant(names, protocol, entry, entry.scale, classes, heading))
        elif entry.is_known:
            settings.append(_setting(names, protocol, entry, entry.scale))
        else:
            scales.append(_unknown(protocol, entry, entry.scale["unknown"], heading))
    return QuantitiesView(
        types=_types(protocol),
        scales=tuple(scales),
        settings=tuple(settings),
        example=next((scale.name for scale in scales if scale.name), ""),
    )


def _types(protocol: Protocol) -> tuple[TypeView, ...]:
    """Return the types of the fields with a quantity, up to 32 bits; conversion itself uses 64 bits."""
    fields = (f for m in protocol.messages for layout in m.layouts for f in layout.all_fields)
    counted = (f for f in fields if f.quantity and f.format.kind == "integer")
    found = {(bits_of(f), f.format.signed) for f in counted if f.format.size <= 4}
    return tuple(_type(bits, signed) for bits, signed in sorted(found))


def _type(bits: int, signed: bool) -> TypeView:
    if signed:
        return TypeView(f"int{bits}", f"an int{bits}_t", f"INT{bits}_MIN", f"INT{bits}_MAX")
    return TypeView(f"uint{bits}", f"a uint{bits}_t", "0", f"(int64_t)UINT{bits}_MAX")


def _constant(
    names: Names,
    protocol: Protocol,
    entry: ScaleEntry,
    factor: Factor,
    classes: Sequence[str],
    heading: str,
) -> ScaleView:
    counts = factor.counts_per_unit
    if max(counts.numerator, counts.denominator) > _GREATEST:
        reason = f"{factor.key} {factor.value} needs more than 64 bits"
        return _unknown(protocol, entry, f"its factor {reason}", heading)
    facts = [f"{factor.key} {factor.value}"]
    facts += [f"printed as “{factor.printed}”"] if factor.printed else []
    facts += [f"source: {factor.source}"] if factor.source else []
    facts += [f"evidence: {spelled(classes)}"] if classes else []
    facts += [f"note: {factor.note}"] if factor.note else []
    name = names.macro(f"scale_{entry.name}")
    parts = [f"INT64_C({part})" for part in (counts.numerator, counts.denominator)]
    return ScaleView(
        comment([f"{_subject(protocol, entry, factor.page, factor.overlay)}: {'; '.join(facts)}."]),
        name,
        definition(name, f"{names.macro_prefix}_BRACED({', '.join(parts)})"),
        heading,
    )


def _unknown(protocol: Protocol, entry: ScaleEntry, reason: str, heading: str) -> ScaleView:
    text = f"{_subject(protocol, entry)}: no scale. {sentence(reason)}"
    return ScaleView(_remark(text), heading=heading)


def _setting(names: Names, protocol: Protocol, entry: ScaleEntry, rule: Json) -> SettingView:
    setting, counts = rule["setting"], rule["counts_at_setting"]
    printed = f"; printed as “{rule['printed']}”" if "printed" in rule else ""
    return SettingView(
        comment([
            f"{_subject(protocol, entry, rule.get('page'))}: "
            f"{counts} counts equal the setting {setting}, in {rule['setting_unit']}{printed}.",
            f"Has the same errors as {names.prefix}_scale_of_share().",
        ]),
        f"{names.prefix}_scale_{entry.name}",
        counts,
    )  # fmt: skip


def _subject(
    protocol: Protocol, entry: ScaleEntry, page: int | None = None, overlay: str | None = None
) -> str:
    """Return the subject of a scale: the quantity, what it depends on, the unit and the page."""
    name = f"{entry.quantity.name} {entry.of}" if entry.of else entry.quantity.summary.rstrip(".")
    unit = f", in {entry.unit}" if entry.unit else ""
    if page is None:
        page, overlay = entry.page, entry.overlay
    found = where(protocol, [page], entry.overlay if overlay is None else overlay)
    return f"{name}{unit} ({found})"


def _remark(text: str) -> str:
    """Return a comment that Doxygen does not attach to the next name."""
    return comment([text]).replace("/**", "/*", 1)
