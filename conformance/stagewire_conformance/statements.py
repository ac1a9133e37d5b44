"""Worked examples that are no frames: numbers in bytes, scalings, and what prose claims."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from typing import Any

from stagewire.errors import StagewireError
from stagewire.quantities import Scale, exact, round_half_away
from stagewire_conformance.arithmetic import evaluate, rounded
from stagewire_conformance.hexes import spaced
from stagewire_conformance.registry import Registry
from stagewire_conformance.scales import in_unit, printed_factor, scale_of
from stagewire_conformance.verdict import Findings

__all__ = ["check_claim", "check_number", "check_scaling", "check_stated"]

Json = dict[str, Any]


def check_number(registry: Registry, entry: Mapping[str, Any], findings: Findings) -> None:
    """Check a number in a stated format against its bytes, in both directions."""
    size, signed = _format(registry, entry["format"], findings)
    if not size:
        return
    value, printed = entry["value"], bytes.fromhex(entry["printed"])
    if not isinstance(value, int):
        findings.problems.append(f"{entry['format']} holds integers, not {value}")
        return
    try:
        made = value.to_bytes(size, "little", signed=signed)
    except OverflowError:
        findings.problems.append(f"{entry['format']} does not hold {value}")
        return
    if "encoded" in entry:
        findings.expect(
            made != printed, "unexpected pass: the printed bytes are those of the value"
        )
        printed = bytes.fromhex(entry["encoded"])
    elif entry["verdict"] == "erratum":
        findings.problems.append("`encoded` does not say what the value gives")
    findings.expect(made == printed, f"{value} is {spaced(made)}, not {spaced(printed)}")
    read = int.from_bytes(printed, "little", signed=signed)
    findings.expect(read == value, f"{spaced(printed)} is {read}, not {value}")


def _format(registry: Registry, name: str, findings: Findings) -> tuple[int, bool]:
    for message in registry.messages.values():
        for layout in message["layouts"]:
            for field in layout["fields"]:
                if field["format"] == name:
                    return field["size"], field["signed"]
    findings.problems.append(f"no field of the registry has the format {name}")
    return 0, False


def check_scaling(registry: Registry, entry: Mapping[str, Any], findings: Findings) -> None:
    """Check a scaling statement: stated values, or arithmetic with its printed result."""
    for item in entry.get("stated", []):
        check_stated(registry, item["quantity"], item, {}, findings)
    if "arithmetic" in entry:
        _arithmetic(entry, findings)


def _arithmetic(entry: Mapping[str, Any], findings: Findings) -> None:
    """Expect that arithmetic gives the value, exactly or as the document rounds it."""
    try:
        result = evaluate(entry["arithmetic"])
    except ValueError as error:
        findings.problems.append(str(error))
        return
    value = entry.get("equals", entry.get("value"))
    if value is None:
        findings.problems.append("neither `equals` nor `value` says what the arithmetic gives")
        return
    right = {result}
    if "rounded_to" in entry:
        right.add(rounded(result, exact(entry["rounded_to"])))
    text = f"{entry['arithmetic']} = {_decimal(result)}"
    findings.expect(exact(value) in right, f"{text}, not {value}")
    if "printed_value" in entry:
        printed = entry["printed_value"]
        findings.expect(exact(printed) != exact(value), f"unexpected pass: {text}, as printed")
        text += f"; printed is {printed}"
    findings.notes.append(text)


def _decimal(value: Fraction) -> str:
    return str(value.numerator) if value.denominator == 1 else f"{float(value):.9g}"


def check_stated(
    registry: Registry,
    name: str,
    item: Mapping[str, Any],
    entry: Mapping[str, Any],
    findings: Findings,
) -> None:
    """Check a stated value: its counts by the exact factor, and how the document got its own.

    The difference between the two is noted in counts.
    """
    what = f"{name} {item['value']} {item['unit']}"
    try:
        scale = scale_of(registry, item)
        value = in_unit(exact(item["value"]), item["unit"], scale.unit)
    except StagewireError as error:
        findings.problems.append(f"{what}: {error}")
        return
    counts, stated = scale.to_counts(value), item["counts"]
    findings.expect(counts == item["exact"], f"{what} is {counts} counts, not {item['exact']}")
    if item["factor"] == "exact":
        findings.expect(stated == counts, f"{what} is {counts} counts, not {stated}")
    else:
        way = _way(scale, value, stated, entry.get("printed_is", {}), name)
        if findings.expect(way != "", f"{what}: nothing that is printed gives {stated} counts"):
            findings.notes.append(
                f"{what}: {counts} counts exactly, {stated} {way} ({stated - counts:+d})"
            )
    held = entry.get("fields", {}).get(name)
    if isinstance(held, int):
        findings.expect(held in (counts, stated), f"{what} is {counts} counts, the field {held}")


def _way(
    scale: Scale, value: Fraction, stated: int, printed_is: Mapping[str, Any], name: str
) -> str:
    """Return how the document got its counts; empty when nothing that it prints gives them."""
    factor = printed_factor(scale)
    if factor is not None and stated == round_half_away(value * factor):
        return "by the printed factor"
    factors = [scale.counts_per_unit, *([factor] if factor is not None else [])]
    if stated in [int(value * factor) for factor in factors]:
        return "cut off instead of rounded"
    if stated == printed_is.get("decodes", {}).get("fields", {}).get(name):
        return "in the printed bytes"
    return ""


def check_claim(registry: Registry, entry: Mapping[str, Any], findings: Findings) -> None:
    """Check that the registry holds what a statement is taken to mean, where a program can."""
    claim = entry["claim"]
    if "prose" in claim:
        findings.checked = False
        findings.notes.append("prose; nothing that a program could check")
        return
    try:
        holds, truth = _claim(registry, claim)
    except LookupError as error:
        findings.problems.append(str(error.args[0]))
        return
    findings.expect(holds, f"{truth}: not what the statement is taken to mean")
    findings.notes.append(truth)


def _claim(registry: Registry, claim: Mapping[str, Any]) -> tuple[bool, str]:
    """Return whether a claim holds in the registry, and what the registry says."""
    if "flag" in claim:
        table, _, bit = claim["flag"].partition(".")
        bits = _entry(registry, "flags", table)["bits"]
        if bit not in bits:
            raise LookupError(f"{table} has no bit {bit}")
        number = bits[bit]["bit"] + 1  # the document counts from one
        return number == claim["bit_number"], f"{claim['flag']} is bit {number} counted from one"
    if "range" in claim:
        field = _field(registry, claim["range"])
        ends = {key: claim[key] for key in ("minimum", "maximum") if key in claim}
        if not ends:
            raise LookupError(f"the claim says no end of the range of {claim['range']}")
        truth = f"{claim['range']} takes {field['minimum']} to {field['maximum']}"
        return all(field[key] == value for key, value in ends.items()), truth
    if "undefined" in claim:
        name = claim["undefined"]
        message = registry.messages.get(name)
        defined = message is not None and bool(message["layouts"])
        return not defined, f"{name} has {'a' if defined else 'no'} layout in the registry"
    if "enum" in claim:
        values = _entry(registry, "enumerations", claim["enum"])["values"]
        return claim["missing"] not in values, f"{claim['enum']} has {', '.join(values)}"
    raise LookupError(f"no such claim is known: {', '.join(claim)}")


def _entry(registry: Registry, kind: str, name: str) -> Json:
    found = registry.table(kind).get(name)
    if found is None:
        raise LookupError(f"the registry has no {name} among its {kind}")
    return found


def _field(registry: Registry, name: str) -> Json:
    message, _, field = name.partition(".")
    for layout in registry.messages.get(message, {}).get("layouts", []):
        fields = registry.fields(message, layout["form"])
        if field in fields:
            return fields[field]
    raise LookupError(f"the registry has no field {name}")
