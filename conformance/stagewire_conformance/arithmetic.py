"""Worked examples with numbers: encoded, and scaled.

Documents print arithmetic such as ``512 * 67``: integers, decimals, ``+ - * /`` and parentheses. ``//``
truncates a quotient to an integer and ``%`` is the remainder, as in documents that split a number into bytes.
Expressions are not evaluated by Python: every number is a fraction, and decimals are exact.
"""

from __future__ import annotations

import ast
import operator
from collections.abc import Callable, Mapping
from fractions import Fraction
from typing import Any

from stagewire.errors import StagewireError
from stagewire.quantities import Scale, exact, round_half_away
from stagewire_conformance.notation import octets, spaced
from stagewire_conformance.registry import Registry
from stagewire_conformance.scales import in_unit, printed_factor, scale_of
from stagewire_conformance.verdict import Findings

_MAXIMUM_TEXT = 200
_BINARY: dict[type[ast.operator], Callable[[Fraction, Fraction], Fraction]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.FloorDiv: lambda left, right: Fraction(left // right),
    ast.Mod: operator.mod,
}


def evaluate(text: str) -> Fraction:
    """Return the exact value of an arithmetic expression.

    Raises :class:`ValueError` with a plain message for an invalid expression.
    """
    if len(text) > _MAXIMUM_TEXT:
        raise ValueError(f"the expression has more than {_MAXIMUM_TEXT} characters")
    try:
        return _value(ast.parse(text.strip(), mode="eval").body, text.strip())
    except SyntaxError:
        raise ValueError(f"{text!r} is not an arithmetic expression") from None
    except ZeroDivisionError:
        raise ValueError(f"{text!r} divides by zero") from None


def _value(node: ast.expr, text: str) -> Fraction:
    if isinstance(node, ast.BinOp) and type(node.op) in _BINARY:
        return _BINARY[type(node.op)](_value(node.left, text), _value(node.right, text))
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        return -_value(node.operand, text)
    if isinstance(node, ast.Constant) and type(node.value) is int:
        return Fraction(node.value)
    if isinstance(node, ast.Constant) and type(node.value) is float:
        return Fraction(ast.get_source_segment(text, node) or "")  # as written, not as a float
    raise ValueError(
        f"{text!r} contains something other than numbers, + - * / // % and parentheses"
    )


def rounded(value: Fraction, step: Fraction) -> Fraction:
    """Return ``value`` rounded to a multiple of ``step``, ties away from zero."""
    if step <= 0:
        raise ValueError("a rounding step must be positive")
    return round_half_away(value / step) * step


def check_number(registry: Registry, entry: Mapping[str, Any], findings: Findings) -> None:
    """Check a number in a stated format against its bytes, in both directions."""
    size, signed = _format(registry, entry["format"], findings)
    if not size:
        return
    value, printed = entry["value"], octets(entry, "printed")
    if not isinstance(value, int):
        findings.problems.append(f"{entry['format']} requires an integer, not {value}")
        return
    try:
        made = value.to_bytes(size, "little", signed=signed)
    except OverflowError:
        findings.problems.append(f"{value} does not fit into {entry['format']}")
        return
    if "encoded" in entry:
        findings.expect(made != printed, "unexpected pass: the printed bytes match the value")
        printed = octets(entry, "encoded")
    elif entry["verdict"] == "erratum":
        findings.problems.append("`encoded` does not match the value")
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
    """Check that arithmetic gives the stated value, exactly or with the rounding of the document."""
    try:
        result = evaluate(entry["arithmetic"])
    except ValueError as error:
        findings.problems.append(str(error))
        return
    value = entry.get("equals", entry.get("value"))
    if value is None:
        findings.problems.append("neither `equals` nor `value` states the result of the arithmetic")
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
    """Check the counts of a stated value with the exact factor, and find how the document computed its own.

    The difference is noted in counts.
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
        if findings.expect(way != "", f"{what}: no printed number gives {stated} counts"):
            findings.notes.append(
                f"{what}: {counts} counts exactly, {stated} {way} ({stated - counts:+d})"
            )
    held = entry.get("fields", {}).get(name)
    if isinstance(held, int):
        findings.expect(held in (counts, stated), f"{what} is {counts} counts, the field {held}")


def _way(
    scale: Scale, value: Fraction, stated: int, printed_is: Mapping[str, Any], name: str
) -> str:
    """Return how the document computed its counts; empty if unknown."""
    factor = printed_factor(scale)
    if factor is not None and stated == round_half_away(value * factor):
        return "by the printed factor"
    factors = [scale.counts_per_unit, *([factor] if factor is not None else [])]
    if stated in [int(value * factor) for factor in factors]:
        return "truncated instead of rounded"
    if stated == printed_is.get("decodes", {}).get("fields", {}).get(name):
        return "in the printed bytes"
    return ""
