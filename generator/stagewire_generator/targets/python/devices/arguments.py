"""The arguments and results of a message: its fields, raw and in units, and their names."""

from __future__ import annotations

import keyword
from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Sequence
from typing import NamedTuple

from stagewire_generator.model import Layout, Message, Protocol
from stagewire_generator.model_fields import Field
from stagewire_generator.model_scales import (
    Quantity,
)
from stagewire_generator.naming import camel

_SYMBOLS = {"V": "volts", "N": "newtons"}
# Attributes that every device class inherits from the runtime, and imports of the generated modules.
METHODS = frozenset(keyword.kwlist) | frozenset({
    "apply_stage_defaults", "axis", "axis_class", "bay", "bay_class", "bays", "channel", "channel_class",
    "channels", "close", "disable", "e", "enable", "f", "facts", "info", "is_enabled", "is_homed",
    "is_moving", "left_moving", "low_level", "mode", "move_to", "mro", "open", "position", "position_counts",
    "position_deg", "position_mm", "reconnect", "record", "restore", "scales", "serial_number",
    "session", "set_transit_time", "shows_motion", "snapshot", "subscribe", "t", "text", "transit_time",
    "travel", "unit", "url", "v", "values", "wait_for"
})  # fmt: skip
# Names that arguments of methods, and attributes of the values they return, cannot have.
ARGUMENTS = frozenset(keyword.kwlist) | frozenset({
    "asdict", "counts", "e", "exact", "f", "in_units", "known", "m", "message", "mro", "names", "quantities",
    "received", "received_at", "scales", "self", "t", "told", "timeout", "v"
})  # fmt: skip


def unit_words(unit: str) -> str:
    """Return a unit as the end of a name: ``mm_per_s2`` for ``mm/s^2``, ``volts`` for ``V``."""
    parts = [part.replace("^", "") for part in unit.split("/")]
    return "_per_".join(_SYMBOLS.get(part, part.lower()) for part in parts)


def short_words(message: Message) -> tuple[str, ...]:
    """Return the words of a message in lower case, without the word of its group."""
    words = tuple(word.lower() for word in message.words)
    return words[1:] if message.group and can_begin(words[1:]) else words


def verbless(words: tuple[str, ...]) -> tuple[str, ...]:
    """Return words without a leading ``get``, ``req`` or ``read``, if others are left."""
    return words[1:] if words[0] in ("get", "req", "read") and can_begin(words[1:]) else words


def can_begin(words: Sequence[str]) -> bool:
    """Whether a name can begin with these words: there is one, and it begins with a letter."""
    return bool(words) and words[0][0].isalpha()


def apart(
    things: Iterable[Sequence[str]], taken: Collection[str], word: str, new: Sequence[bool] = ()
) -> list[str]:
    """Return a unique name for each thing; none of them is taken.

    :param things: candidate names of each thing, the best first. If two things have the same name, both
        use their next candidate, if there is one.
    :param word: appended to a name without a next candidate.
    :param new: which things are new; these never change the name of another thing.
    """
    choices = [list(names) for names in things]
    if any(new):
        olds = [names for names, late in zip(choices, new, strict=True) if not late]
        news = [names for names, late in zip(choices, new, strict=True) if late]
        kept = apart(olds, taken, word)
        first, second = iter(kept), iter(apart(news, {*taken, *kept}, word))
        return [next(second if late else first) for late in new]
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


class Way(NamedTuple):
    """A unit in which a value may be given.

    :param case: the value of the setting with which the unit applies; empty if no setting decides.
    :param rotary: whether it is the unit on a rotary stage; None if the stage does not matter.
    """

    keyword: str
    unit: str
    case: str
    rotary: bool | None = None


class Argument(NamedTuple):
    """A field that is an argument or a result of a method.

    :param keyword: name of the argument for the raw value.
    :param ways: units in which the value may be given.
    :param default: value if the argument is left out; None if it is required.
    :param is_partial: whether a form that is sent in some contexts does not have the field.
    """

    field: Field
    keyword: str
    ways: tuple[Way, ...]
    default: str | int | None = None
    is_partial: bool = False


def table_class(field: Field) -> str:
    """Return the class of the named values or bits of a field; empty if it has none."""
    if field.enum:
        return f"e.{camel(field.enum.name)}"
    return f"f.{camel(field.flags.name)}" if field.flags else ""


def given_fields(protocol: Protocol, layout: Layout) -> list[Field]:
    """Return the fields that are arguments: all but the channel, constants and reserved fields."""
    channel = protocol.framing.get("channel")
    return [f for f in layout.all_fields if f.role == "value" and f.name != channel]


def arguments_of(
    message: Message, fields: Sequence[Field], words: Sequence[str] = (), single: str = ""
) -> tuple[Argument, ...]:
    """Return the arguments of a message, in the order of its fields.

    :param words: the words of the set. A prefix that a field shares with its set is dropped in names with
        a unit: ``jog_step_size`` of the jog parameters becomes ``step_size_mm``.
    :param single: name of the raw value if only one field has a unit; empty for the name of the field.
    """
    units = {field.name: list(_units(field.quantity)) for field in fields}
    alone = sum(map(bool, units.values())) == 1
    things = [[single if alone and single and units[f.name] else f.name] for f in fields]
    counted = len(things)
    for field in fields:
        for unit, _, _ in units[field.name]:
            things.append(_names(field.name, unit_words(unit), words, alone))
    taken = ARGUMENTS - {single}
    names = apart(things, taken, "value")
    raw, rest = names[:counted], iter(names[counted:])
    defaults = message.call.get("defaults", {})
    partial = [{f.name for f in x.fields} for x in message.layouts if x.sent_when]
    return tuple(
        Argument(
            field,
            keyword,
            tuple(Way(next(rest), *unit) for unit in units[field.name]),
            defaults.get(field.name),
            any(field.name not in names for names in partial),
        )
        for field, keyword in zip(fields, raw, strict=True)
    )


def _names(field: str, unit: str, words: Sequence[str], alone: bool) -> list[str]:
    """Return candidate names for a value in a unit, the best first."""
    parts = field.split("_")
    for word in words:
        if parts[0] != word or not can_begin(parts[1:]):
            break
        del parts[0]
    names = [f"{'_'.join(parts)}_{unit}", f"{field}_{unit}", f"{field}_in_{unit}"]
    return [unit, *names] if alone else names


def _units(quantity: Quantity | None) -> Iterator[tuple[str, str, bool | None]]:
    """Yield the units of a quantity, each with its value of the setting, and whether the stage is rotary."""
    if quantity is None:
        return
    if "cases" in quantity.rule:
        cases = quantity.rule["cases"]
        count = Counter(entry["unit"] for entry in cases.values())
        for case, entry in cases.items():
            if count[entry["unit"]] == 1:
                yield entry["unit"], case, None
        yield from ((unit, "", None) for unit, times in count.items() if times > 1)
    elif quantity.rotary_unit:
        yield quantity.unit, "", False
        yield quantity.rotary_unit, "", True
    elif quantity.unit:
        yield quantity.unit, "", None
