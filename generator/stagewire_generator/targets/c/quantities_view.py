"""The header of conversions: scales that are constants, scales by a setting, and what has no scale."""

from __future__ import annotations

from dataclasses import dataclass

from stagewire_generator.model import Factor, Field, Json, Protocol
from stagewire_generator.scales import ScaleEntry, scales_of
from stagewire_generator.targets.c.documentation import where
from stagewire_generator.targets.c.names import Names, names_of
from stagewire_generator.targets.c.source import comment
from stagewire_generator.targets.documentation import sentence

__all__ = ["QuantitiesView", "ScaleView", "SettingView", "TypeView", "quantities_view"]

_GREATEST = 2**63 - 1  # that a part of a scale can be


@dataclass(frozen=True, slots=True)
class TypeView:
    """A type of fields that counts are converted for."""

    name: str  # int32
    named: str  # an int32_t
    minimum: str
    maximum: str


@dataclass(frozen=True, slots=True)
class ScaleView:
    """A scale that is a constant; without a name it is none, and the comment says why."""

    comment: str
    name: str = ""
    value: str = ""
    heading: str = ""  # a comment on it and on those that follow


@dataclass(frozen=True, slots=True)
class SettingView:
    """A scale that a setting of the controller decides; what is on the wire is a share of it."""

    comment: str
    name: str
    full_scale: int


@dataclass(frozen=True, slots=True)
class QuantitiesView:
    """Everything that differs between the headers of protocols."""

    types: tuple[TypeView, ...]
    scales: tuple[ScaleView, ...]
    settings: tuple[SettingView, ...]
    example: str  # the name of a constant, or none


def quantities_view(protocol: Protocol) -> QuantitiesView:
    """Make the view of all scales of a protocol."""
    names = names_of(protocol)
    scales: list[ScaleView] = []
    settings: list[SettingView] = []
    headed = ""
    for entry in scales_of(protocol):
        heading = _remark(entry.controller) if entry.controller != headed else ""
        headed = entry.controller
        if isinstance(entry.scale, Factor):
            scales.append(_constant(names, protocol, entry, entry.scale, heading))
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
    """Return the types of the fields with a quantity; 64 bits are what conversion makes anyway."""
    fields = (f for m in protocol.messages for layout in m.layouts for f in layout.all_fields)
    counted = (f for f in fields if f.quantity and f.format.kind == "integer")
    found = {(_bits(f), f.format.signed) for f in counted if f.format.size <= 4}
    return tuple(_type(bits, signed) for bits, signed in sorted(found))


def _bits(field: Field) -> int:
    return {1: 8, 2: 16}.get(field.format.size, 32)


def _type(bits: int, signed: bool) -> TypeView:
    if signed:
        return TypeView(f"int{bits}", f"an int{bits}_t", f"INT{bits}_MIN", f"INT{bits}_MAX")
    return TypeView(f"uint{bits}", f"a uint{bits}_t", "0", f"(int64_t)UINT{bits}_MAX")


def _constant(
    names: Names, protocol: Protocol, entry: ScaleEntry, factor: Factor, heading: str
) -> ScaleView:
    counts = factor.counts_per_unit
    if max(counts.numerator, counts.denominator) > _GREATEST:
        reason = f"{factor.key} {factor.value} takes more than 64 bits"
        return _unknown(protocol, entry, f"its factor, {reason}", heading)
    facts = [f"{factor.key} {factor.value}"]
    facts += [f"printed as “{factor.printed}”"] if factor.printed else []
    facts += [f"source: {factor.source}"] if factor.source else []
    return ScaleView(
        comment([f"{_subject(protocol, entry, factor.page)}: {'; '.join(facts)}."]),
        names.macro(f"scale_{entry.name}"),
        f"{names.macro_prefix}_BRACED(INT64_C({counts.numerator}), INT64_C({counts.denominator}))",
        heading,
    )


def _unknown(protocol: Protocol, entry: ScaleEntry, reason: str, heading: str) -> ScaleView:
    text = f"{_subject(protocol, entry)}: there is no scale. {sentence(reason)}"
    return ScaleView(_remark(text), heading=heading)


def _setting(names: Names, protocol: Protocol, entry: ScaleEntry, rule: Json) -> SettingView:
    setting, counts = rule["setting"], rule["counts_at_setting"]
    printed = f"; printed as “{rule['printed']}”" if "printed" in rule else ""
    return SettingView(
        comment([
            f"{_subject(protocol, entry, rule.get('page'))}: "
            f"{counts} counts are the setting {setting}, given in {rule['setting_unit']}{printed}.",
            f"Refuses as {names.prefix}_scale_of_share() does.",
        ]),
        f"{names.prefix}_scale_{entry.name}",
        counts,
    )  # fmt: skip


def _subject(protocol: Protocol, entry: ScaleEntry, page: int | None = None) -> str:
    """Return what a scale is the scale of: the quantity, what decides, the unit, and the page."""
    name = f"{entry.quantity.name} {entry.of}" if entry.of else entry.quantity.summary.rstrip(".")
    unit = f", in {entry.unit}" if entry.unit else ""
    return f"{name}{unit} ({where(protocol, [page or entry.page], entry.overlay)})"


def _remark(text: str) -> str:
    """Return a comment that belongs to nothing: Doxygen must not take it for that of the next name."""
    return comment([text]).replace("/**", "/*", 1)
