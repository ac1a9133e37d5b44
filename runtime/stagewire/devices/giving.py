"""From the keywords of a call to the fields of a message, checked before a byte is made.

Of each value exactly one keyword is given: the counts, or the value in units. A number in units is exact
(:func:`stagewire.quantities.exact`) and rounded to the nearest count. A quantity of pint is taken where it
can be converted to the unit of the keyword; pint itself is never imported.
"""

from __future__ import annotations

import operator
from collections.abc import Mapping
from typing import Any, NoReturn

from stagewire.devices.scales import Scales
from stagewire.devices.tables import Given
from stagewire.errors import BadValueError, MissingFieldError, OutOfRangeError
from stagewire.quantities import Number, Scale, exact

__all__ = ["fields_of", "in_unit"]


def fields_of(
    what: str,
    entries: tuple[Given, ...],
    given: Mapping[str, object],
    scales: Scales,
    *,
    some: bool = False,
) -> dict[str, Any]:
    """Return the fields that a user gave, in counts.

    :param what: the call, for errors.
    :param given: keyword -> value; None is not given.
    :param some: whether values may be left out, but not all of them.

    Raises :class:`~stagewire.errors.MissingFieldError`, :class:`~stagewire.errors.OutOfRangeError`,
    :class:`~stagewire.errors.BadValueError` and :class:`~stagewire.errors.UnknownScaleError`.
    """
    fields: dict[str, Any] = {}
    missing: list[Given] = []
    for entry in entries:
        used = [keyword for keyword in entry.keywords if given.get(keyword) is not None]
        if len(used) > 1:
            raise BadValueError(
                f"{what}: {' and '.join(used)} are the same value; give one of them"
            )
        if not used:
            missing.append(entry)
        elif used[0] == entry.keyword:
            fields[entry.field] = _checked(what, entry, given[used[0]])
        else:
            fields[entry.field] = _converted(what, entry, used[0], given[used[0]], scales)
    if missing and not (some and fields):
        lacking = ", ".join(" or ".join(entry.keywords) for entry in missing)
        raise MissingFieldError(f"{what} lacks {'at least one of ' if some else ''}{lacking}")
    return fields


def in_unit(value: object, unit: str, keyword: str) -> Number:
    """Return the number that ``value`` is in ``unit``.

    Raises :class:`~stagewire.errors.BadValueError` for what is none.
    """
    convert = getattr(value, "to", None)
    if callable(convert) and hasattr(value, "magnitude"):
        try:
            value = convert(unit).magnitude
        except Exception as error:  # of pint, which is not imported here
            raise BadValueError(f"{keyword} is in {unit}: {error}") from None
    if hasattr(value, "item") and not hasattr(value, "__len__"):  # a number of NumPy
        value = value.item()
    try:
        exact(value)  # type: ignore[arg-type]  # it says what it does not take
    except BadValueError as error:
        raise BadValueError(f"{keyword} takes a number in {unit}: {error}") from None
    return value  # type: ignore[return-value]


def _checked(what: str, entry: Given, value: object) -> object:
    """Return a raw value; of a number the range is checked here, so that nothing is asked before."""
    if entry.minimum is None or entry.maximum is None:
        return value
    if not isinstance(value, int) and hasattr(value, "__index__"):  # of NumPy
        value = operator.index(value)
    if isinstance(value, bool) or not isinstance(value, int):
        raise BadValueError(
            f"{what}: {entry.keyword} takes an integer from {entry.minimum} to {entry.maximum}, not {value!r}"
        )
    if not entry.minimum <= value <= entry.maximum:
        raise OutOfRangeError(
            f"{what}: {entry.keyword} takes {entry.minimum} to {entry.maximum} (raw counts), not {value}"
        )
    return value


def _converted(what: str, entry: Given, keyword: str, value: object, scales: Scales) -> int:
    [(unit, case)] = [(unit, case) for name, unit, case in entry.ways if name == keyword]
    number = in_unit(value, unit, f"{what}: {keyword}")
    scale = scales.of(entry.quantity, unit, case)
    counts = scale.to_counts(number)
    minimum, maximum = entry.minimum, entry.maximum
    if minimum is not None and maximum is not None and not minimum <= counts <= maximum:
        _refuse(f"{what}: {keyword}", number, counts, scale, minimum, maximum)
    return counts


def _refuse(
    name: str, number: Number, counts: int, scale: Scale, minimum: int, maximum: int
) -> NoReturn:
    low, high = (float(scale.from_counts(end)) for end in (minimum, maximum))
    raise OutOfRangeError(
        f"{name} takes {low:.10g} to {high:.10g} {scale.unit}, not {number} "
        f"({counts} counts, where {minimum} to {maximum} fit)"
    )
