"""Convert and check the keywords of a call before its message is encoded.

Exactly one keyword gives each value, in counts or in units. A number in units is exact
(:func:`stagewire.quantities.exact`) and rounded to the nearest count. Quantities of pint are accepted if they
can be converted to the unit of the keyword; pint itself is never imported.

A value with named choices is a member, a name in any case, or an integer. If the list of choices is complete,
other values are refused.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Iterable, Mapping
from functools import reduce, wraps
from inspect import Parameter, iscoroutinefunction, signature
from typing import Any, NoReturn

from stagewire._codec.flags import Enumeration, Flags
from stagewire._codec.message import Layout, Message
from stagewire._devices import reals
from stagewire._devices.scales import Range, Scales
from stagewire._devices.tables import Given, Named
from stagewire.errors import (
    BadValueError,
    MissingFieldError,
    OutOfRangeError,
    UnknownScaleError,
)
from stagewire.quantities import Number, Scale, exact


def with_keywords(method: Callable[..., Any]) -> Callable[..., Any]:
    """Return a method whose error for wrong arguments lists those that fit."""

    def begin(*given: Any, **named: Any) -> Any:
        try:
            return method(*given, **named)
        except TypeError as error:
            known = signature(method)
            try:
                known.bind(*given, **named)
            except TypeError as mismatch:
                reason = mismatch
            else:
                raise error
        raise BadValueError(f"{method.__name__}: {reason}{_fitting(known.parameters.values())}")

    if not iscoroutinefunction(method):
        return wraps(method)(begin)

    @wraps(method)
    async def call(*given: Any, **named: Any) -> Any:
        return await begin(*given, **named)

    return call


def _fitting(parameters: Iterable[Parameter]) -> str:
    _, *others = parameters
    shown = [f"{one.name}=" if one.kind is Parameter.KEYWORD_ONLY else one.name for one in others]
    return f" (it takes {', '.join(shown) or 'no arguments'})"


def fields_of(
    what: str,
    entries: tuple[Given, ...],
    given: Mapping[str, object],
    scales: Scales,
    *,
    of: type[Message],
    some: bool = False,
) -> dict[str, Any]:
    """Return the fields that a user gave, in counts.

    :param what: name of the call, for messages.
    :param of: class of the message with the fields.
    :param given: keyword -> value; None means missing.
    :param some: whether one value is enough.

    Raise :class:`~stagewire.errors.MissingFieldError`, :class:`~stagewire.errors.OutOfRangeError`,
    :class:`~stagewire.errors.BadValueError` and :class:`~stagewire.errors.UnknownScaleError`.
    """
    fields: dict[str, Any] = {}
    missing: list[Given] = []
    for entry in (entry.on(scales.controllers) for entry in entries):
        used = [keyword for keyword in entry.keywords if given.get(keyword) is not None]
        if len(used) > 1:
            raise BadValueError(
                f"{what}: {' and '.join(used)} set the same value; use only one of them"
            )
        if not used:
            missing.append(entry)
        elif used[0] == entry.keyword:
            fields[entry.field] = _checked(what, entry, given[used[0]], scales, of.layout)
        else:
            fields[entry.field] = _converted(
                what, entry, used[0], given[used[0]], scales, of.layout
            )
    if missing and not (some and fields):
        lacking = ", ".join(" or ".join(_usable(entry, scales)) for entry in missing)
        raise MissingFieldError(f"{what} requires {'at least one of ' if some else ''}{lacking}")
    return fields


def _usable(entry: Given, scales: Scales) -> list[str]:
    """Return the keywords for a value, without those for stages of the other kind."""
    ways = entry.ways
    return [
        entry.keyword,
        *(name for name, unit, _ in ways if not scales.unit_instead(entry.quantity, unit)),
    ]


def in_unit(value: object, unit: str, keyword: str) -> Number:
    """Return ``value`` as a number in ``unit``.

    Raise :class:`~stagewire.errors.BadValueError` for a value that is not a number or has another dimension.
    """
    convert = getattr(value, "to", None)
    if callable(convert) and hasattr(value, "magnitude"):
        try:
            value = convert(unit).magnitude
        except Exception as error:  # of pint, which is not imported here
            raise BadValueError(f"{keyword} must be in {unit}: {error}") from None
    if hasattr(value, "item") and not hasattr(value, "__len__"):  # a number of NumPy
        value = value.item()
    try:
        exact(value)  # type: ignore[arg-type]  # exact checks the type
    except BadValueError as error:
        raise BadValueError(f"{keyword} must be a number in {unit}: {error}") from None
    return value  # type: ignore[return-value]


def number_of(choices: Named | None, value: object, modifiers: int = 0) -> int | None:
    """Return the number of a member, a name or an integer; None for anything else.

    Join several names by ``|``: bits, or a value of an enumeration and its modifiers. Integers of NumPy are
    accepted, and so are members of a table with the same names and values: a request and its set can have
    tables of different sizes. Bools and members of other tables are not.

    :param choices: class with the names; None to accept only integers.
    :param modifiers: mask of the values of an enumeration that can be combined with another value.
    """
    if isinstance(value, str):
        return None if choices is None else _by_name(choices, value, modifiers)
    if isinstance(value, Enumeration | Flags) and not (choices and _is_member(value, choices)):
        return None
    if isinstance(value, bool) or getattr(getattr(value, "dtype", None), "kind", "") == "b":
        return None
    try:
        return operator.index(value)  # type: ignore[arg-type]  # raises TypeError for what is not an integer
    except TypeError:
        return None


def _is_member(value: Enumeration | Flags, choices: Named) -> bool:
    """Return whether a value is a member of a table, or of one with the same names and values."""
    return isinstance(value, choices) or (
        issubclass(choices, Flags) == isinstance(value, Flags)
        and _names(type(value)) == _names(choices)
    )


def check_held(entry: Given, value: object) -> None:
    """Raise an error for a stored value of a controller that is missing from a complete list of choices.

    Unknown bits are accepted and written back unchanged.

    Raise :class:`~stagewire.errors.OutOfRangeError`.
    """
    table = entry.choices
    if table is None or entry.open or issubclass(table, Flags):
        return
    if isinstance(value, int) and not _is_listed(entry, table, value):
        raise OutOfRangeError(_not_listed(entry.keyword, entry, table, value))


def _checked(what: str, entry: Given, value: object, scales: Scales, layout: Layout) -> object:
    """Return a raw value; check the range of a number before anything is sent."""
    if entry.minimum is None or entry.maximum is None:
        return value
    if entry.real:
        return _pattern(what, entry, value, layout)
    table = entry.choices
    number = number_of(table, value, entry.modifiers)
    if table is not None and (
        number is None or not (entry.open or _is_listed(entry, table, number))
    ):
        error = BadValueError if number is None else OutOfRangeError
        place = layout.source_of(entry.field, named=True)
        raise error(_not_listed(f"{what} {entry.keyword}", entry, table, value) + place)
    if number is None:
        raise BadValueError(
            f"{what}: {entry.keyword} must be an integer from {entry.minimum} to {entry.maximum}, "
            f"not {value!r}"
        )
    now = scales.range_of(entry.quantity, entry.minimum, entry.maximum)
    if not now.minimum <= number <= now.maximum:
        raise OutOfRangeError(
            f"{what}: {entry.keyword} must be {now.minimum} to {now.maximum} "
            f"({layout.counts_of(entry.field)}){now.condition}, not {number}{now.remedy}"
            f"{layout.source_of(entry.field, named=True)}"
        )
    return number


def _pattern(what: str, entry: Given, value: object, layout: Layout) -> int:
    """Return the bit pattern of a real number; check its range before anything is sent."""
    assert entry.minimum is not None  # every number has a range
    assert entry.maximum is not None
    if hasattr(value, "item") and not hasattr(value, "__len__"):  # a number of NumPy
        value = value.item()
    try:
        number = float(exact(value))  # type: ignore[arg-type]  # exact checks the type
        pattern = reals.pattern_of(number, entry.real)
    except BadValueError as error:
        raise BadValueError(f"{what}: {entry.keyword} must be a number: {error}") from None
    except OverflowError:
        pattern = -1
    if value == 0:
        pattern = 0  # zero has no sign
    if not entry.minimum <= pattern <= entry.maximum:
        source = layout.source_of(entry.field, named=True)
        raise OutOfRangeError(
            f"{what}: {entry.keyword} must be {_reach(entry)}, not {value}{source}"
        )
    return pattern


def _reach(entry: Given) -> str:
    """Return the range of a real number, for messages."""
    assert entry.minimum is not None
    assert entry.maximum is not None
    if entry.maximum >> (8 * entry.real - 1):
        return f"a number of {entry.real} bytes"
    low, high = (reals.number_of(end, entry.real) for end in (entry.minimum, entry.maximum))
    return f"{low:.10g} to {high:.10g}"


def _by_name(choices: Named, text: str, modifiers: int) -> int | None:
    known = {name.upper(): number for name, number in _names(choices).items()}
    parts = [part.strip().upper() for part in text.split("|")]
    if any(part not in known for part in parts):
        return None
    numbers = [known[part] for part in parts]
    if issubclass(choices, Enumeration) and sum(not n & modifiers for n in numbers) != 1:
        return None  # an enumeration has one value; only modifiers can be added
    return reduce(operator.or_, numbers)


def _names(choices: Named) -> dict[str, int]:
    if issubclass(choices, Flags):
        return choices.bits
    return {name: member.value for name, member in choices.__members__.items()}


def _is_listed(entry: Given, table: Named, number: int) -> bool:
    if issubclass(table, Flags):
        return not table(number).unnamed
    alone = {n for n in _names(table).values() if not n & entry.modifiers and _fits(entry, n)}
    return number & ~entry.modifiers in alone


def _fits(entry: Given, number: int) -> bool:
    """Return whether a value of an enumeration is in the range of the unit."""
    return (
        entry.minimum is None or entry.maximum is None or entry.minimum <= number <= entry.maximum
    )


def _not_listed(name: str, entry: Given, table: Named, value: object) -> str:
    """Return a message with all valid choices; if a number was given, with their numbers."""
    named = isinstance(value, str)
    listed: list[str] = []
    added: list[str] = []
    for choice, number in _names(table).items():
        if issubclass(table, Enumeration) and not _fits(entry, number):
            continue
        shown = choice if named else f"{choice} ({number if 0 <= number < 10 else hex(number)})"
        (added if number & entry.modifiers else listed).append(shown)
    text = ", ".join(listed)
    if issubclass(table, Flags):
        text += ", or several of them joined by |"
    if added:
        text += f", optionally joined with {', '.join(added)} by |"
    if entry.open:
        text += f", nor an integer from {entry.minimum} to {entry.maximum}"
    given = repr(value)
    if isinstance(value, Enumeration):
        given = f"{type(value).__name__}.{value.name}"
    return f"{name} {given} is not one of {text}"


def _converted(
    what: str, entry: Given, keyword: str, value: object, scales: Scales, layout: Layout
) -> int:
    [(unit, case)] = [(unit, case) for name, unit, case in entry.ways if name == keyword]
    if instead := scales.unit_instead(entry.quantity, unit):
        [right] = [name for name, other, _ in entry.ways if other == instead]
        raise UnknownScaleError(
            f"{what}: {keyword}: {scales.other_unit(entry.quantity, unit)}; use {right}=",
            instead=right,
        )
    number = in_unit(value, unit, f"{what}: {keyword}")
    scale = scales.of(entry.quantity, unit, case)
    counts = scale.to_counts(number)
    if entry.minimum is None or entry.maximum is None:
        return counts
    now = scales.range_of(entry.quantity, entry.minimum, entry.maximum, case)
    if not now.minimum <= counts <= now.maximum:
        source = layout.source_of(entry.field, named=True)
        if scales.by_setting(entry.quantity) and not now.condition:
            source = f"; {scales.source(entry.quantity, scale)}{source}"
        _refuse(f"{what}: {keyword}", number, counts, scale, now, source)
    return counts


def _refuse(
    name: str, number: Number, counts: int, scale: Scale, now: Range, source: str
) -> NoReturn:
    low, high = (float(scale.from_counts(end)) for end in (now.minimum, now.maximum))
    holds = "the range is" if now.condition else "the field holds"
    raise OutOfRangeError(
        f"{name} must be {low:.10g} to {high:.10g} {scale.unit}{now.condition}, not {number} "
        f"({counts} counts; {holds} {now.minimum} to {now.maximum}){now.remedy}{source}"
    )
