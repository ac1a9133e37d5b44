"""The limits of a user in the options of ``open``: travels, velocities, accelerations, tolerances."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from fractions import Fraction
from typing import Any, Final

from stagewire._devices.arguments import in_unit
from stagewire._devices.limits import CEILINGS, Ceiling, ceiling_of
from stagewire._devices.travel import TRAVELS, Travel, parse_travel
from stagewire.errors import BadValueError
from stagewire.quantities import exact

__all__ = ["TOLERANCES", "by_name", "ceilings_in", "positive", "tolerances_in", "travels_in"]

TOLERANCES: Final = {
    "mm": "target_tolerance_mm",
    "deg": "target_tolerance_deg",
    "counts": "target_tolerance_counts",
}
"""Unit of a tolerance -> its keyword."""


def by_name(
    option: str, several: Mapping[Any, Any] | None, one: Any, names: tuple[Any, ...]
) -> dict[Any, Any]:
    """Return the value for each name: its own value if given, or else the common value."""
    chosen = {} if one is None else dict.fromkeys(names, one)
    if not isinstance(several or {}, Mapping):
        raise BadValueError(
            f"{option} must be a mapping, such as {{{names[0]!r}: …}}, not {several!r}"
        )
    for name, value in (several or {}).items():
        name = name.upper() if isinstance(name, str) else name
        if name not in names:
            there = ", ".join(map(str, names))
            raise BadValueError(f"{option}: unknown key {name!r} (choose {there})")
        chosen[name] = value
    return chosen


def _one_or_several(option: str, value: object, names: tuple[Any, ...]) -> dict[Any, Any]:
    """Return the value for each name, given one value or a mapping."""
    several = value if isinstance(value, Mapping) else None
    return by_name(option, several, None if several is not None else value, names)


def _limits(
    given: Mapping[str, object], names: tuple[Any, ...], options: Mapping[str, str]
) -> Iterator[tuple[Any, str, Any]]:
    """Yield name, unit and value of each limit that options for linear and for rotary stages set.

    :param options: unit -> keyword.
    """
    taken: dict[Any, str] = {}
    for unit, option in options.items():
        for name, value in _one_or_several(option, given.get(option), names).items():
            if name in taken:
                raise BadValueError(
                    f"{taken[name]} and {option} limit the same stage; use the one for its kind, or a "
                    f"mapping for each, such as {{{name!r}: …}}"
                )
            taken[name] = option
            yield name, unit, value


def travels_in(given: Mapping[str, object], names: tuple[Any, ...]) -> dict[Any, Travel]:
    """Return the travels that the options set, by channel, bay or axis."""
    return {name: parse_travel(value, unit) for name, unit, value in _limits(given, names, TRAVELS)}


def ceilings_in(
    given: Mapping[str, object], names: tuple[Any, ...]
) -> dict[Any, dict[str, Ceiling]]:
    """Return the other limits that the options set, by channel, bay or axis, and by name."""
    found: dict[Any, dict[str, Ceiling]] = {}
    for limit, (_, options) in CEILINGS.items():
        for name, unit, value in _limits(given, names, options):
            number = positive(options[unit], value, unit)
            if number is not None:
                found.setdefault(name, {})[limit] = ceiling_of(limit, unit, number)
    return found


def positive(keyword: str, value: object, unit: str) -> Fraction | None:
    """Return an option that must be above 0; None if it was not given."""
    if value is None:
        return None
    number = exact(in_unit(value, unit, keyword))
    if number <= 0:
        raise BadValueError(f"{keyword} must be above 0, not {value}")
    return number


def tolerances_in(given: Mapping[str, object]) -> dict[str, Fraction]:
    """Return the tolerances by unit, and check the tolerance in counts."""
    tolerances = {unit: given.get(option) for unit, option in TOLERANCES.items()}
    counts = tolerances.pop("counts")
    found: dict[str, Fraction] = {}
    for unit, value in tolerances.items():
        option = TOLERANCES[unit]
        if value is None:
            continue
        if counts is not None:
            both = f"{option} and {TOLERANCES['counts']}"
            raise BadValueError(f"{both} set the same limit; use only one of them")
        found[unit] = exact(in_unit(value, unit, option))
        if found[unit] < 0:
            raise BadValueError(f"{option} must be 0 or more, not {value}")
    if counts is not None and (
        isinstance(counts, bool) or not isinstance(counts, int) or counts < 0
    ):
        raise BadValueError(
            f"target_tolerance_counts must be an integer, 0 or more, not {counts!r}"
        )
    return found
