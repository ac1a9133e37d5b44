"""From the keywords of a call to the fields of a message, checked before a byte is made.

Of each value exactly one keyword is given: the counts, or the value in units. A number in units is exact
(:func:`stagewire.quantities.exact`) and rounded to the nearest count. A quantity of pint is taken where it
can be converted to the unit of the keyword; pint itself is never imported.

A value with named choices is given as a member, as a name in any case, or as an integer. Where the list of
choices is complete, nothing else is sent.
"""

from __future__ import annotations

import operator
from collections.abc import Mapping
from functools import reduce
from typing import Any, NoReturn

from stagewire._codec.flags import Enumeration, Flags
from stagewire._devices.scales import Scales
from stagewire._devices.tables import Given, Named
from stagewire.errors import BadValueError, MissingFieldError, OutOfRangeError
from stagewire.quantities import Number, Scale, exact


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


def number_of(choices: Named | None, value: object, modifiers: int = 0) -> int | None:
    """Return the number that a member, a name or an integer stands for; None for anything else.

    Names of bits are joined by ``|``, and so is the name of a value with those of its modifiers. An integer
    of NumPy is an integer; a bool is not, nor is a member of another table.

    :param choices: the class that has the names; None where only integers are accepted.
    :param modifiers: the values of an enumeration that may be added to another, as a mask.
    """
    if isinstance(value, str):
        return None if choices is None else _by_name(choices, value, modifiers)
    if isinstance(value, Enumeration | Flags) and not (choices and isinstance(value, choices)):
        return None
    if isinstance(value, bool) or getattr(getattr(value, "dtype", None), "kind", "") == "b":
        return None
    try:
        return operator.index(value)  # type: ignore[arg-type]  # raises TypeError for what is not an integer
    except TypeError:
        return None


def check_held(entry: Given, value: object) -> None:
    """Raise for a value that a controller holds and a complete list of choices does not contain.

    Unknown bits are left alone: they are written back as they came.

    Raises :class:`~stagewire.errors.OutOfRangeError`.
    """
    table = entry.choices
    if table is None or entry.open or issubclass(table, Flags):
        return
    if isinstance(value, int) and not _is_listed(entry, table, value):
        raise OutOfRangeError(_not_listed(entry.keyword, entry, table, value))


def _checked(what: str, entry: Given, value: object) -> object:
    """Return a raw value; of a number the range is checked here, so that nothing is asked before."""
    if entry.minimum is None or entry.maximum is None:
        return value
    table = entry.choices
    number = number_of(table, value, entry.modifiers)
    if table is not None and (
        number is None or not (entry.open or _is_listed(entry, table, number))
    ):
        error = BadValueError if number is None else OutOfRangeError
        raise error(_not_listed(f"{what} {entry.keyword}", entry, table, value))
    if number is None:
        raise BadValueError(
            f"{what}: {entry.keyword} takes an integer from {entry.minimum} to {entry.maximum}, not {value!r}"
        )
    if not entry.minimum <= number <= entry.maximum:
        raise OutOfRangeError(
            f"{what}: {entry.keyword} takes {entry.minimum} to {entry.maximum} (raw counts), not {number}"
        )
    return number


def _by_name(choices: Named, text: str, modifiers: int) -> int | None:
    known = {name.upper(): number for name, number in _names(choices).items()}
    parts = [part.strip().upper() for part in text.split("|")]
    if any(part not in known for part in parts):
        return None
    numbers = [known[part] for part in parts]
    if issubclass(choices, Enumeration) and sum(not n & modifiers for n in numbers) != 1:
        return None  # two values of an enumeration never make a third
    return reduce(operator.or_, numbers)


def _names(choices: Named) -> dict[str, int]:
    if issubclass(choices, Flags):
        return choices.bits
    return {name: member.value for name, member in choices.__members__.items()}


def _is_listed(entry: Given, table: Named, number: int) -> bool:
    if issubclass(table, Flags):
        return not table(number).unnamed
    alone = {n for n in _names(table).values() if not n & entry.modifiers}
    return number & ~entry.modifiers in alone


def _not_listed(name: str, entry: Given, table: Named, value: object) -> str:
    """Return what is wrong with a choice, and all choices; where a number was given, with their numbers."""
    named = isinstance(value, str)
    listed: list[str] = []
    added: list[str] = []
    for choice, number in _names(table).items():
        shown = choice if named else f"{choice} ({number if 0 <= number < 10 else hex(number)})"
        (added if number & entry.modifiers else listed).append(shown)
    text = ", ".join(listed)
    if issubclass(table, Flags):
        text += ", or several of them joined by |"
    if added:
        text += f", alone or with {', '.join(added)} added by |"
    if entry.open:
        text += f", nor an integer from {entry.minimum} to {entry.maximum}"
    given = repr(value)
    if isinstance(value, Enumeration):
        given = f"{type(value).__name__}.{value.name}"
    return f"{name} {given} is not one of {text}"


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
