"""Exact arithmetic on text such as ``512 * 67``: integers, decimals, ``+ - * /`` and parentheses.

``//`` cuts a quotient off to an integer and ``%`` is what remains, as documents take numbers apart.
Nothing is evaluated by Python; every number is a fraction, decimals exactly as they are written.
"""

from __future__ import annotations

import ast
import operator
from collections.abc import Callable
from fractions import Fraction

from stagewire.quantities import round_half_away

__all__ = ["evaluate", "rounded"]

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

    Raises :class:`ValueError` with a plain sentence for anything that is none.
    """
    if len(text) > _MAXIMUM_TEXT:
        raise ValueError(f"arithmetic of more than {_MAXIMUM_TEXT} characters")
    try:
        return _value(ast.parse(text.strip(), mode="eval").body, text.strip())
    except SyntaxError:
        raise ValueError(f"{text!r} is not arithmetic") from None
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
    raise ValueError(f"{text!r} holds more than numbers, + - * / // % and parentheses")


def rounded(value: Fraction, step: Fraction) -> Fraction:
    """Return ``value`` rounded to a multiple of ``step``, ties away from zero."""
    if step <= 0:
        raise ValueError("a rounding step is positive")
    return round_half_away(value / step) * step
