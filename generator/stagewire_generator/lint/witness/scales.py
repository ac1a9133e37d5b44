"""Compare the exact factors of scales with the numbers in their printed texts."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from fractions import Fraction

from stagewire_generator.lint.witness.comparison import Comparison
from stagewire_generator.model import Json
from stagewire_generator.scales import FACTOR, RATIONAL
from stagewire_generator.strict_yaml import Document, KeyPath

_NUMBER = re.compile(
    r"(?P<whole>[0-9][0-9,]*)(?:/(?P<divisor>[1-9][0-9]*)|\.(?P<decimals>[0-9]+))?"
    r"(?:\s*(?P<prefix>[nuµμmk]?)(?P<base>[a-zA-Z])(?![a-zA-Z/]))?"
)
_POWERS = {"n": -9, "u": -6, "µ": -6, "μ": -6, "m": -3, "": 0, "k": 3}
_UNIT = re.compile(r"([num]?)([a-z])\Z")

Range = tuple[Fraction, Fraction]  # what a printed number may be rounded from


def compare_scales(comparison: Comparison, files: Mapping[str, list[Document]]) -> None:
    """Compare each scale that has a printed text with numbers, as places ``scales/PATH``.

    One of the numbers must be the factor or its reciprocal, rounded to the printed digits, or two of them
    must have that ratio. A text without numbers is not compared. An overlay may also add scales to entries of
    the protocol, in its file of additions.
    """
    for kind in ("quantities", "stages"):
        for document in (*files.get(kind, ()), *files.get("additions", ())):
            comparison.document = document
            for path, scale, key in _printed(document.data.get(kind, {}), (kind,)):
                factor, unit = str(scale[key]), key.replace("counts_per_", "")
                found = list(_ranges(str(scale["printed"]), unit.removesuffix("_per_count")))
                if not found or not RATIONAL.match(factor):
                    continue
                comparison.compared += 1
                exact = Fraction(factor)
                if not any(
                    low <= value <= high for value in (exact, 1 / exact) for low, high in found
                ):
                    place = "/".join(("scales", *map(str, path[1:])))
                    comparison.differs(place, path, scale["printed"], factor)


def _printed(node: Json, path: KeyPath) -> Iterator[tuple[KeyPath, Json, str]]:
    """Yield the path of each scale with a printed text, the scale, and the key of its number."""
    if "printed" in node:
        for key in node:
            if FACTOR.match(key) or key == "counts_at_setting":
                yield path, node, key
    for key, inner in node.items():
        if isinstance(inner, dict):
            yield from _printed(inner, (*path, key))


def _ranges(text: str, unit: str) -> Iterator[Range]:
    """Yield what the numbers of a text may be rounded from, in a unit, and the ratios of any two above 1."""
    numbers: list[tuple[Range, Fraction]] = []
    for match in _NUMBER.finditer(text):
        whole, decimals = match["whole"].replace(",", ""), match["decimals"] or ""
        value = Fraction(f"{whole}.{decimals or 0}")
        half = Fraction(1, 2 * 10 ** len(decimals))
        if match["divisor"]:
            value, half = value / int(match["divisor"]), Fraction(0)
        if not value:
            continue
        times = _times(match["prefix"] or "", match["base"] or "", unit)
        numbers.append((((value - half) * times, (value + half) * times), value * times))
    for index, ((low, high), _) in enumerate(numbers):
        yield low, high
        if unit == "percent":  # the number stands for the whole
            yield low / 100, high / 100
        for other, (_, divisor) in enumerate(numbers):
            if other != index and low > divisor:
                yield low / divisor, high / divisor


def _times(prefix: str, base: str, unit: str) -> Fraction:
    """Return by what a number with a metric unit is multiplied to be in another unit of the same base."""
    own = _UNIT.match(unit)
    if own is None or own[2] != base.lower():
        return Fraction(1)
    return Fraction(10) ** (_POWERS[prefix] - _POWERS[own[1]])
