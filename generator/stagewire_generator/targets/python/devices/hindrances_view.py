"""States that prevent a motion, as tables in the module of facts, and the requests that read them."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache

from stagewire_generator.model import Layout, Message, Protocol
from stagewire_generator.model_fields import Enumeration, EnumValue, Field, FlagBit, FlagTable
from stagewire_generator.targets.python.brackets import Nested, Source
from stagewire_generator.targets.python.devices.parts import UnitPlan
from stagewire_generator.targets.python.devices.plan import Call
from stagewire_generator.targets.python.devices.tables_view import TableWriter, class_of
from stagewire_generator.targets.python.source import literal


def said_by(protocol: Protocol, unit: UnitPlan) -> Iterator[tuple[Message, Layout]]:
    """Yield the messages and replies that a unit sends, in the layouts that it uses.

    A status of several channels is left out: it is not the status of the channel that is asked for it. On a
    unit with several channels, this applies to all forms of the message.
    """
    status, several = unit.entry.get("status"), unit.entry.get("channels", 1) > 1
    joint_forms = _joint_forms(protocol)
    for message, layout in _said(protocol):
        if message.name in unit.messages:
            joint = joint_forms.get(message.name, frozenset())
            if (
                not (several and joint)
                and layout.form not in joint
                and layout.when.get("status", status) == status
            ):
                yield message, layout


@lru_cache(maxsize=1)
def _said(protocol: Protocol) -> list[tuple[Message, Layout]]:
    """Return the messages to the host and the replies, with their layouts."""
    return [
        (message, layout)
        for message in protocol.messages
        for layout in message.layouts
        if message.direction == "to_host" or layout.form == "reply"
    ]


def has_joint_status(protocol: Protocol, unit: UnitPlan) -> bool:
    """Whether a unit with several channels reports their status together."""
    several = unit.entry.get("channels", 1) > 1
    return several and not _joint_forms(protocol).keys().isdisjoint(unit.messages)


@lru_cache(maxsize=1)
def _joint_forms(protocol: Protocol) -> dict[str, frozenset[str]]:
    """Return the forms that have the status of several channels: name of the message -> forms."""
    found = {
        message.name: frozenset(layout.form for layout in message.layouts if _is_joint(layout))
        for message in protocol.messages
    }
    return {name: forms for name, forms in found.items() if forms}


def _is_joint(layout: Layout) -> bool:
    """Whether a layout has the status of several channels."""
    tables = [field.flags for field in layout.all_fields if field.flags]
    moving = [table for table in tables if any(bit.motion for bit in table.bits)]
    return len(moving) > 1


def hindrance_lists(protocol: Protocol) -> tuple[Nested, ...]:
    """Return a statement for each table with states that prevent a motion."""
    every: tuple[FlagTable | Enumeration, ...] = (*protocol.flags, *protocol.enumerations)
    tables = [table for table in every if _states(table)]
    return tuple(
        Nested(f"{_name(table)} = (", tuple(map(_hindrance, _states(table))), ")")
        for table in sorted(tables, key=_name)
    )


def hindrance_entries(protocol: Protocol, unit: UnitPlan, tables: TableWriter) -> Iterator[Source]:
    """Yield the fields of a unit that report such states, and the requests that read them."""
    own = [message for message in protocol.messages if message.name in unit.messages]
    moves = any(map(_moves, own))
    if not moves and not any("requires" in message.exchange for message in own):
        return
    found: dict[str, tuple[int, FlagTable | Enumeration]] = {}
    entries: list[Source] = []
    for message, layout in said_by(protocol, unit):
        for field in layout.all_fields:
            table = _table(field, unit.name)
            if table is not None and _states(table):
                found[message.name] = (layout.length, table)
                entries.append(
                    f"{class_of(message, layout)}: ({literal(field.name)}, {_name(table)})"
                )
    if entries:
        yield Nested("hindrances={", tuple(entries), "}")
    asked = [
        (*found[call.values.message.name], call.constant)
        for call in tables.calls
        if call.values and call.values.message.name in found and _can_be_asked(call, unit)
    ]
    known: set[str] = set()
    questions: list[Source] = []
    knows_status = False
    for _, table, constant in sorted(
        asked, key=lambda x: (-x[0], x[2])
    ):  # the longest has most states
        causes = {state.hinders["cause"] for state in _states(table)}
        is_status = isinstance(table, FlagTable)
        if causes <= known or (is_status and knows_status):  # one status word is enough
            continue
        known |= causes
        knows_status = knows_status or is_status
        questions.append(f"t.{constant}")
    if questions and moves:
        yield Nested("diagnosis=(", tuple(questions), ")")


def _moves(message: Message) -> bool:
    """Whether a message starts a motion whose end is awaited."""
    exchange = message.exchange
    return "ends_when" in exchange or {"completes_with", "halted_by"} <= exchange.keys()


def _can_be_asked(call: Call, unit: UnitPlan) -> bool:
    """Whether a unit supports the request of a call and the request has no arguments."""
    if call.kind == "set":
        return (
            "req" in call.members and call.members["req"].name in unit.messages and not call.asked
        )
    return call.kind == "query" and call.message.name in unit.messages and not call.arguments


def _table(field: Field, unit: str) -> FlagTable | Enumeration | None:
    flags = field.flags_by_unit.get(unit, field.flags)
    return flags or field.enums_by_unit.get(unit, field.enum)


def _states(table: FlagTable | Enumeration) -> list[FlagBit] | list[EnumValue]:
    if isinstance(table, FlagTable):
        return [bit for bit in table.bits if bit.hinders]
    return [value for value in table.values if value.hinders]


def _name(table: FlagTable | Enumeration) -> str:
    return f"_{table.name.upper()}_HINDRANCES"


def _hindrance(state: FlagBit | EnumValue) -> Nested:
    if isinstance(state, FlagBit):
        mask = f"0x{state.mask:08X}"
        value = "0" if state.hinders.get("when") == "clear" else mask
    else:
        mask, value = "-1", f"0x{state.value:02X}"
    items = [literal(state.hinders["cause"]), literal(state.name), mask, value]
    if state.hinders.get("limit"):
        items.append("limit=True")
    return Nested("Hindrance(", tuple(items), ")")
