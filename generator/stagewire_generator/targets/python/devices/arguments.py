"""The arguments and results of one message: its fields, raw and in units, and what they are called."""

from __future__ import annotations

import keyword
from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass

from stagewire_generator.model import Field, Layout, Message, Protocol, Quantity
from stagewire_generator.naming import camel

_SYMBOLS = {"V": "volts", "N": "newtons"}
# What every device class has from the runtime, and what the modules of generated parts import.
METHODS = frozenset(keyword.kwlist) | frozenset({
    "axis", "axis_class", "bay", "bay_class", "bays", "channel", "channel_class", "channels", "close",
    "e", "f", "facts", "info", "is_moving", "low_level", "mode", "mro", "open", "reconnect", "scales",
    "serial_number", "session", "subscribe", "t", "text", "unit", "url", "v", "values"
})  # fmt: skip
# What an argument of a method, or an attribute of the values that it returns, cannot be called.
ARGUMENTS = frozenset(keyword.kwlist) | frozenset({
    "counts", "e", "exact", "f", "known", "m", "message", "mro", "names", "scales", "self", "t", "told",
    "timeout", "v"
})  # fmt: skip


def unit_words(unit: str) -> str:
    """Return a unit as the end of a name: ``mm_per_s2`` for ``mm/s^2``, ``volts`` for ``V``."""
    parts = [part.replace("^", "") for part in unit.split("/")]
    return "_per_".join(_SYMBOLS.get(part, part.lower()) for part in parts)


def short_words(message: Message) -> tuple[str, ...]:
    """Return the words of a message in small letters, without that of its group."""
    words = tuple(word.lower() for word in message.words)
    return words[1:] if message.group and can_begin(words[1:]) else words


def verbless(words: tuple[str, ...]) -> tuple[str, ...]:
    """Return words without the verb that asks or answers, if others are left."""
    return words[1:] if words[0] in ("get", "req", "read") and can_begin(words[1:]) else words


def can_begin(words: Sequence[str]) -> bool:
    """Whether a name can begin with these words: there are some, and no digit is in front."""
    return bool(words) and words[0][0].isalpha()


def apart(things: Iterable[Sequence[str]], taken: Collection[str], word: str) -> list[str]:
    """Return a name for each thing: no two alike, and none of them taken.

    :param things: the names that each may have, the best first. Of two that are alike both go on to
        their next, if they have one.
    :param word: stands behind a name for which there is no next.
    """
    choices = [list(names) for names in things]
    while True:
        count = Counter(names[0] for names in choices)
        alike = [
            names
            for names in choices
            if len(names) > 1 and (count[names[0]] > 1 or names[0] in taken)
        ]
        if not alike:
            break
        for names in alike:
            del names[0]
    used = set(taken)
    for names in choices:
        while names[0] in used:
            names[0] = f"{names[0]}_{word}"
        used.add(names[0])
    return [names[0] for names in choices]


@dataclass(frozen=True, slots=True)
class Way:
    """A unit in which a value may be given.

    :param case: the value of the setting that makes it this unit; empty where none does.
    """

    keyword: str
    unit: str
    case: str


@dataclass(frozen=True, slots=True)
class Argument:
    """A field that a caller gives or is given.

    :param keyword: what its raw value is called.
    :param ways: the units in which it may be given; none where it has none.
    :param default: what it holds if the caller does not say; None where he has to.
    """

    field: Field
    keyword: str
    ways: tuple[Way, ...]
    default: str | int | None = None


def table_class(field: Field) -> str:
    """Return the class that names the values or bits of a field; empty where it has none."""
    if field.enum:
        return f"e.{camel(field.enum.name)}"
    return f"f.{camel(field.flags.name)}" if field.flags else ""


def given_fields(protocol: Protocol, layout: Layout) -> list[Field]:
    """Return the fields that a caller gives: not the channel, and nothing that is reserved."""
    channel = protocol.framing.get("channel")
    return [f for f in layout.all_fields if f.role == "value" and f.name != channel]


def arguments_of(
    message: Message, fields: Sequence[Field], words: Sequence[str] = (), single: str = ""
) -> tuple[Argument, ...]:
    """Return the arguments of a message, in the order of its fields.

    :param words: those of the set. What a field begins with, and the set begins with too, is left out in
        front of a unit: ``jog_step_size`` of the jog parameters is ``step_size_mm``.
    :param single: what the raw value is called where only one field has a unit; empty for its own name.
    """
    units = {field.name: list(_units(field.quantity)) for field in fields}
    alone = sum(map(bool, units.values())) == 1
    things = [[single if alone and single and units[f.name] else f.name] for f in fields]
    counted = len(things)
    for field in fields:
        for unit, _ in units[field.name]:
            things.append(_names(field.name, unit_words(unit), words, alone))
    taken = ARGUMENTS - {single}
    names = apart(things, taken, "value")
    raw, rest = names[:counted], iter(names[counted:])
    defaults = message.call.get("defaults", {})
    return tuple(
        Argument(
            field,
            keyword,
            tuple(Way(next(rest), unit, case) for unit, case in units[field.name]),
            defaults.get(field.name),
        )
        for field, keyword in zip(fields, raw, strict=True)
    )


def _names(field: str, unit: str, words: Sequence[str], alone: bool) -> list[str]:
    """Return what a value in a unit may be called, the best first."""
    parts = field.split("_")
    for word in words:
        if parts[0] != word or not can_begin(parts[1:]):
            break
        del parts[0]
    names = [f"{'_'.join(parts)}_{unit}", f"{field}_{unit}", f"{field}_in_{unit}"]
    return [unit, *names] if alone else names


def _units(quantity: Quantity | None) -> Iterator[tuple[str, str]]:
    """Yield the units of a quantity, each with the case of the setting that it belongs to."""
    if quantity is None:
        return
    if "cases" in quantity.rule:
        for case, entry in quantity.rule["cases"].items():
            yield entry["unit"], case
    elif quantity.unit:
        yield quantity.unit, ""
