"""Check the positions of units that have only a few: their messages, fields, values and bits exist."""

from __future__ import annotations

from collections.abc import Iterator

from stagewire_generator.model import Json, Message


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
