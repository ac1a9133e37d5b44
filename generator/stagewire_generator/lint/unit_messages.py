"""Check the messages that units name for their positions, and to switch their outputs off."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Final

from stagewire_generator.model import STATES, Json, Layout, Message, Protocol
from stagewire_generator.model_fields import Field

_EXPLAINED: Final = ("stop", "settings")
"""Effects of messages that need no reason."""

_DANGEROUS: Final = ("laser", "heater")
"""Hazards of outputs that a unit must be able to switch off."""


def wrong_orders(protocol: Protocol, unit: str) -> Iterator[tuple[tuple[str | int, ...], str]]:
    """Yield each part of the states of a unit that is wrong: its path in the entry, and what is wrong.

    Unknown messages are reported elsewhere.
    """
    entry = protocol.units["units"][unit]
    of_name = {message.name: message for message in protocol.messages}
    supported = protocol.messages_of(entry)
    if "safe_state" not in entry:
        hazards = protocol.units["families"][entry["family"]].get("hazards", {})
        for name in sorted(supported & of_name.keys()):
            hazard = hazards.get(name, of_name[name].hazard)
            if hazard in _DANGEROUS:
                yield (), f"{name} has the hazard {hazard}, so the unit needs a `safe_state`"
                break
    for key in STATES:
        for index, order in enumerate(entry.get(key, {}).get("messages", ())):
            name = order["message"]
            if name not in of_name:
                continue
            for part, what in _wrong(protocol, of_name, unit, order, supported):
                yield (key, "messages", index, *part), what


def _wrong(
    protocol: Protocol,
    of_name: Mapping[str, Message],
    unit: str,
    order: Json,
    supported: frozenset[str],
) -> Iterator[tuple[tuple[str, ...], str]]:
    message = of_name[order["message"]]
    if message.name not in supported:
        yield ("message",), f"{message.name} is not one of its messages"
        return
    if message.direction == "to_host" or len(message.layouts) != 1 or message.not_sent:
        yield ("message",), f"{message.name} is not a message in one form that a host sends"
        return
    if message.effect not in _EXPLAINED and "because" not in order:
        what = f"{message.name} has the effect {message.effect}"
        yield ("message",), f"{what}, so `because` must state why it is sent"
    channel = protocol.framing.get("channel")
    [layout] = message.layouts
    fields = {
        f.name: f
        for f in layout.all_fields
        if f.role == "value" and f.name != channel and f.omitted is None
    }
    values, kept = order.get("values", {}), order.get("kept", ())
    if missing := sorted({*fields} - {*values, *kept}):
        yield ("message",), f"{message.name} has fields without a value: {', '.join(missing)}"
    for name in values:
        if name not in fields:
            yield ("values", name), f"{message.name} has no field {name}"
        elif what := _misfit(fields[name], values[name], unit):
            yield ("values", name), what
    for name in kept:
        if name not in fields or name in values:
            yield ("kept",), f"{name} is not a field of {message.name} without a value"
        elif name not in _reported(of_name, message, supported):
            yield ("kept",), f"{unit} does not report {name} with a request for this set"


def _misfit(field: Field, value: int | str, unit: str) -> str:
    """Return why a field cannot have a value on a unit; empty if it can."""
    table = field.enums_by_unit.get(unit, field.enum)
    names = {entry.name: entry.value for entry in table.values} if table else {}
    if isinstance(value, str):
        if value not in names:
            return f"unknown value {value}"
        value = names[value]
    low, high = field.ranges_by_unit.get(unit, field.own_range)
    if not low <= value <= high:
        return f"{value} is not in the range from {low} to {high}"
    if names and value not in names.values() and field.lists_all:
        return f"{value} is not one of its values"
    return ""


def _reported(
    of_name: Mapping[str, Message], message: Message, supported: frozenset[str]
) -> set[str]:
    """Return the fields that a unit reports of the parameter set that a message writes."""
    if message.set is None or message.set[1] != "set":
        return set()
    members = {
        m.set[1]: m
        for m in of_name.values()
        if m.set and m.set[0] == message.set[0] and m.name in supported
    }
    if not {"req", "get"} <= members.keys():
        return set()
    layouts: tuple[Layout, ...] = members["get"].layouts
    return {field.name for layout in layouts for field in layout.all_fields}


def unknown_positions(
    entry: Json | None, messages: dict[str, Message]
) -> Iterator[tuple[str, str]]:
    """Yield each part of the positions of a unit that does not exist, and what is wrong with it."""
    if entry is None:
        return
    move, read = messages.get(entry["move"]), messages.get(entry["read"])
    moved = [field for layout in move.layouts for field in layout.all_fields] if move else []
    tables = [field.enum for field in moved if field.name == entry["argument"] and field.enum]
    if not tables:
        yield "argument", f"{entry['move']} has no field {entry['argument']} with an enumeration"
    elif unknown := {*entry["values"]} - {value.name for value in tables[0].values}:
        yield "values", f"unknown value {', '.join(sorted(unknown))}"
    replies = [
        m for m in messages.values() if read and m.set == (*(read.set or ("", ""))[:1], "get")
    ]
    flags = [f.flags for m in replies for x in m.layouts for f in x.all_fields if f.flags]
    if len(flags) != 1:
        yield "read", f"the reply to {entry['read']} has no field with flags, or several"
    elif unknown := {*entry["bits"]} - {bit.name for bit in flags[0].bits}:
        yield "bits", f"unknown bit {', '.join(sorted(unknown))}"
    if len(entry["bits"]) != len(entry["values"]):
        yield "bits", "there must be as many bits as values"
    owned = [m for m in messages.values() if m.set == (entry["time"]["set"], "get")]
    fields = {field.name for m in owned for x in m.layouts for field in x.all_fields}
    for name in (entry["time"]["field"], entry["time"]["counts"]):
        if name not in fields:
            yield "time", f"{entry['time']['set']} has no field {name}"
