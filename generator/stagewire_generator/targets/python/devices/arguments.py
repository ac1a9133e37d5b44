"""What a caller gives and is given of one message: its fields, raw and in units, and what they are called."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from stagewire_generator.model import Field, Layout, Message, Protocol, Quantity
from stagewire_generator.naming import camel
from stagewire_generator.targets.python.devices.naming import (
    ARGUMENTS,
    apart,
    can_begin,
    unit_words,
)

__all__ = ["Argument", "Way", "arguments_of", "given_fields", "table_class"]


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
