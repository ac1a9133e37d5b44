"""Real numbers of IEEE 754, which messages carry as bit patterns."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import Any

from stagewire.devices import number_of, pattern_of
from stagewire_cli.errors import CalledWronglyError

Json = dict[str, Any]

_PATTERN = re.compile(r"0[xX][0-9A-Fa-f]+\Z")


def parse_real(name: str, text: str, field: Mapping[str, Any]) -> int:
    """Return the bit pattern of a decimal such as 0.5 or 1e-9; text in hex is a bit pattern.

    Raises :class:`CalledWronglyError` if it is invalid or out of the range of its field.
    """
    size = field["size"]
    if _PATTERN.match(text):
        pattern = int(text, 16)
        if pattern >> 8 * size:
            raise CalledWronglyError(f"{name}: the bit pattern {text} has more than {size} bytes")
        return pattern
    try:
        pattern = pattern_of(float(text), size)
    except ValueError:
        raise CalledWronglyError(
            f"{name} must be a number such as 0.5 or 1e-9, or a bit pattern such as 0x3F000000, "
            f"not {text!r}"
        ) from None
    except OverflowError:
        raise CalledWronglyError(f"{name}: {text} is too large for {size} bytes") from None
    if not field["minimum"] <= pattern <= field["maximum"]:
        raise CalledWronglyError(f"{name} must be {range_text(field)}, not {text}")
    return pattern


def real_of(field: Mapping[str, Any], pattern: int) -> float:
    """Return the number with the bit pattern of a field."""
    return number_of(pattern, field["size"])


def real_text(field: Mapping[str, Any], pattern: int) -> str:
    """Return the shortest decimal of the number with the bit pattern of a field."""
    return str(real_of(field, pattern)).removesuffix(".0")


def range_text(field: Mapping[str, Any]) -> str:
    """Return the range of a field."""
    ends = (field["minimum"], field["maximum"])
    low, high = (real_text(field, end) if field.get("real") else str(end) for end in ends)
    return f"{low} to {high}"


def with_numbers(known: Mapping[str, Json], answer: Json) -> Json:
    """Return an answer with numbers in place of bit patterns; NaN and infinity, which JSON lacks, are text.

    :param known: the fields of its layout by name.
    """
    fields = {
        name: _json(real_of(known[name], value)) if known.get(name, {}).get("real") else value
        for name, value in answer["fields"].items()
    }
    return answer | {"fields": fields}


def _json(number: float) -> float | str:
    return number if math.isfinite(number) else str(number)
