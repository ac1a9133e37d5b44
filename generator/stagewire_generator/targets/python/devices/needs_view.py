"""The state that motions of a unit need, and the messages that end what it does, as tables of facts."""

from __future__ import annotations

from collections.abc import Iterator

from stagewire_generator.model import STATES, Json, Message, Protocol
from stagewire_generator.targets.python.brackets import Nested, Source, mapping
from stagewire_generator.targets.python.devices.classes_view import facts_of
from stagewire_generator.targets.python.devices.parts import UnitPlan
from stagewire_generator.targets.python.devices.plan import Call
from stagewire_generator.targets.python.devices.tables_view import TableWriter, class_of
from stagewire_generator.targets.python.source import literal


def need_entries(protocol: Protocol, unit: UnitPlan, tables: TableWriter) -> Iterator[Source]:
    """Yield the state that each motion of a unit needs, and the parameters that it must receive first."""
    readers = {call.members["req"].name: call for call in tables.calls if "req" in call.members}
    motions: list[Source] = []
    otherwise = _enables_otherwise(protocol, unit)
    for message in protocol.messages:
        if message.name in unit.messages and "requires" in message.exchange:
            needs = tuple(_needs(message, unit, readers, otherwise=otherwise))
            motions += [
                Nested(f"{class_of(message, layout)}: (", needs, ")")
                for layout in message.layouts
                if needs
            ]
    if motions:
        yield mapping("needs=", motions)
    if "reports_ends_after" in unit.entry:
        name = unit.entry["reports_ends_after"]
        [call] = [
            call
            for call in tables.calls
            if "set" in call.members and call.members["set"].name == name
        ]
        yield f"reports_ends_after=t.{call.constant}"


def _enables_otherwise(protocol: Protocol, unit: UnitPlan) -> bool:
    """Return whether motions of a unit depend on more than the enabled state of their own channel."""
    enabling = facts_of(protocol, unit).get("enabling", {})
    return "channels" in enabling or "before_motions" in enabling


def _needs(
    message: Message, unit: UnitPlan, readers: dict[str, Call], *, otherwise: bool
) -> Iterator[Source]:
    for read, need in message.exchange["requires"].items():
        if read not in unit.messages:
            continue
        if otherwise and "unhindered" in need and "set" in readers[read].members:
            continue
        ignored = need.get("ignored", {"with": "", "fields": ()})
        left_out = ignored["fields"] if ignored["with"] in unit.messages else ()
        fields = [literal(name) for name in need.get("usable", ()) if name not in left_out]
        items: list[Source] = [f"t.{readers[read].constant}", Nested("(", tuple(fields), ")")]
        if need.get("each_time"):
            items.append("each_time=True")
        yield Nested("Need(", tuple(items), ")")


def farewell_entries(protocol: Protocol, unit: UnitPlan) -> Iterator[Source]:
    """Yield the messages that end what a host has started: status updates, then the connection.

    Each has the messages that start what it ends; without such a message, it ends the connection. A switch
    between the formats of a line does not.
    """
    own = [m for m in protocol.messages if m.name in unit.messages and m.direction != "to_host"]
    starters = [m for m in own if m.exchange.get("periodic_ms")]
    entries: list[Source] = []
    for message in own:
        stopped = set(message.exchange.get("stops", ()))
        if message.effect == "stream" and stopped:
            started = [m for m in starters if stopped & set(m.exchange.get("starts", ()))]
            if not started:
                continue
        elif message.effect == "connection" and not message.switches_to and _is_bare(message):
            started = []
        else:
            continue
        classes = tuple(class_of(m, m.layouts[0]) for m in started)
        entries.append(Nested(f"{class_of(message, message.layouts[0])}: (", classes, ")"))
    entries.sort(key=lambda entry: not entry.items)  # type: ignore[union-attr]  # the connection ends last
    if entries:
        yield mapping("farewell=", entries)


def position_entries(protocol: Protocol, unit: UnitPlan, tables: TableWriter) -> Iterator[Source]:
    """Yield the positions of a unit that has only a few, and how it moves to them."""
    found = protocol.units["families"][unit.entry["family"]].get("positions")
    if found is None:
        return
    calls = {message.name: call for call in tables.calls for message in call.members.values()}
    move, read = calls[found["move"]], calls[found["read"]]
    time = next(
        call
        for call in tables.calls
        if call.message.set and call.message.set[0] == found["time"]["set"]
    )
    [argument] = [field for field in move.layout.all_fields if field.name == found["argument"]]
    assert argument.enum
    assert read.values
    values = {value.name: value.value for value in argument.enum.values}
    [field] = [field for field in read.values.layout.all_fields if field.flags]
    flags = field.flags_by_unit.get(unit.name, field.flags)
    assert flags
    masks = {bit.name: f"0x{bit.mask:X}" for bit in flags.bits}
    moves = [
        Nested("(", (f"0x{values[value]:02X}", masks[bit]), ")")
        for value, bit in zip(found["values"], found["bits"], strict=True)
    ]
    items: tuple[Source, ...] = (
        *(f"t.{move.constant}", literal(argument.name)),
        *(f"t.{read.constant}", literal(field.name)),
        Nested("(", tuple(moves), ")"),
        *(f"t.{time.constant}", literal(found["time"]["field"]), literal(found["time"]["counts"])),
        *(str(found["time"]["factor"]), found["time"]["exponent"]),
    )
    yield Nested("positions=Positions(", items, ")")


def _is_bare(message: Message) -> bool:
    return bool(message.layouts) and not any(
        field.role == "value" for layout in message.layouts for field in layout.all_fields
    )


def order_entries(protocol: Protocol, unit: UnitPlan, tables: TableWriter) -> Iterator[Source]:
    """Yield the safe state and the stop state of a unit, and the stops that its `stop()` sends."""
    for key in STATES:
        orders = unit.entry.get(key, {}).get("messages", ())
        if orders:
            made = tuple(_order(protocol, unit.name, order, tables) for order in orders)
            yield Nested(f"{key}=(", made, ")")
    if halts := {call.constant: None for plan in unit.classes if plan.stops for call in plan.halts}:
        yield Nested("halts=(", tuple(f"t.{constant}" for constant in halts), ")")


def _order(protocol: Protocol, unit: str, order: Json, tables: TableWriter) -> Nested:
    [message] = [one for one in protocol.messages if one.name == order["message"]]
    [layout] = message.layouts
    fields = {field.name: field for field in layout.all_fields}
    values: list[Source] = []
    for name, value in order.get("values", {}).items():
        table = fields[name].enums_by_unit.get(unit, fields[name].enum)
        named = {entry.name: entry.value for entry in table.values} if table else {}
        values.append(f"{literal(name)}: {named.get(value, value)}")
    items: list[Source] = [class_of(message, layout)]
    if values:
        items.append(mapping("", values))
    if "kept" in order:
        [call] = [call for call in tables.calls if message in call.members.values()]
        kept = tuple(map(literal, order["kept"]))
        items += [Nested("kept=(", kept, ")"), f"read=t.{call.constant}"]
    return Nested("Order(", tuple(items), ")")
