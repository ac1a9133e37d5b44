"""Facts of the registry about the messages of a unit, looked up once for all its controllers."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from stagewire import FramedMessage
from stagewire_virtual.clock import SECOND
from stagewire_virtual.instrument import Unit

CHANNEL: Final = "chan_ident"
"""The field of the channel, in a header or in a packet."""

PLAIN: Final = "data"
"""The form of a message with packets of several lengths that is sent, unless the unit has another."""


@dataclass(frozen=True, slots=True)
class Value:
    """A value of a parameter set.

    :param name: the name of the field.
    :param default: the value in a new controller, unless its behaviour has one: the default of the registry,
        or else the valid value nearest to zero, or the lowest of a table without it.
    :param minimum: the minimum of an integer; None for text.
    :param maximum: the maximum of an integer; None for text.
    :param listed: the values of a complete table; None if others are possible.
    :param is_mask: whether its bits have names.
    :param names: the numbers of its values on the unit by name; None if they have no names.
    """

    name: str
    default: Any
    minimum: int | None
    maximum: int | None
    listed: frozenset[int] | None
    is_mask: bool = False
    names: Mapping[str, int] | None = None

    def fault(self, value: Any) -> str:
        """Return why the document does not allow a value; empty if it does."""
        if self.listed is not None and value not in self.listed:
            known = ", ".join(map(str, sorted(self.listed)))
            return f"{self.name} must be one of {known}, not {value}"
        if self.minimum is None or self.maximum is None or self.minimum <= value <= self.maximum:
            return ""
        return f"{self.name} must be from {self.minimum} to {self.maximum}, not {value}"


@dataclass(frozen=True, slots=True)
class Message:
    """A message of a unit: its role in a parameter set and in exchanges.

    :param name: its name in the registry.
    :param id: its id on the wire.
    :param generic: whether it is independent of the kind of controller (chapter of page 15).
    :param addressee: its recipient in a rack; empty for the controller in a bay.
    :param to_controller: whether controllers receive it.
    :param set_name: its parameter set; empty if it has none.
    :param role: ``set``, ``req`` or ``get`` in that set; empty if it has none.
    :param values: its values, in any of its forms, without the channel and reserved fields.
    :param names_channel: whether it has a field for the channel.
    :param answered_by: the messages that answer it.
    :param announces: the messages that a controller sends after storing this SET.
    :param starts: the messages that it starts or unmutes.
    :param stops: the messages that it stops or mutes.
    :param period: the period of the messages that it starts, in nanoseconds; None if they are not periodic.
    :param muted_by: the messages that mute it.
    :param counts: whether it counts for the keep-alive when it is sent unsolicited.
    """

    name: str
    id: int
    generic: bool
    addressee: str
    to_controller: bool
    set_name: str
    role: str
    values: tuple[Value, ...]
    names_channel: bool
    answered_by: tuple[str, ...]
    announces: tuple[str, ...]
    starts: frozenset[str]
    stops: frozenset[str]
    period: int | None
    muted_by: frozenset[str]
    counts: bool

    @property
    def of_the_unit(self) -> bool:
        """Whether it concerns the unit as a whole, so that units without channels also have it."""
        return self.generic and not self.names_channel


@functools.lru_cache(maxsize=128)
def facts_of(unit: Unit) -> Mapping[str, Message]:
    """Return the messages of a unit by name."""
    return {name: _message(unit.message(name), unit) for name in sorted(unit.messages)}


def class_of(unit: Unit, name: str) -> type[FramedMessage]:
    """Return the class of a message in the form that the unit sends."""
    form = None
    if len(unit.message(name)["layouts"]) > 1:
        own = unit.facts.get("sends", {}).get(name)
        form = PLAIN if own is None else own["form"].replace("_", ":", 1)
    found: Any = unit.protocol.message_class(name, form)
    cls: type[FramedMessage] = found
    return cls


def _message(entry: Mapping[str, Any], unit: Unit) -> Message:
    exchange = entry["exchange"]
    place = entry["set"] or {"name": "", "role": ""}
    layouts = sorted(entry["layouts"], key=lambda layout: layout["form"] != PLAIN)
    fields = {field["name"]: field for layout in reversed(layouts) for field in _fields(layout)}
    return Message(
        name=entry["name"],
        id=entry["id"],
        generic=entry["chapter"] == "generic",
        addressee=entry.get("addressee") or "",
        to_controller=entry["direction"] != "to_host",
        set_name=place["name"],
        role=place["role"],
        values=tuple(_value(field, unit) for name, field in fields.items() if name != CHANNEL),
        names_channel=CHANNEL in fields,
        answered_by=tuple(exchange.get("answered_by", ())),
        announces=tuple(exchange.get("announces", ())),
        starts=frozenset(exchange.get("starts", ())),
        stops=frozenset(exchange.get("stops", ())),
        period=_nanoseconds(exchange.get("periodic_ms")),
        muted_by=frozenset(exchange.get("muted_by", ())),
        counts=exchange.get("counts_for_keep_alive", False),
    )


def _nanoseconds(ms: int | None) -> int | None:
    return None if ms is None else ms * SECOND // 1000


def _fields(layout: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """Return the value fields of a layout, header parameters first."""
    parameters = [layout[name] for name in ("param1", "param2") if layout[name]]
    return [field for field in [*parameters, *layout["fields"]] if field["role"] == "value"]


def _value(field: Mapping[str, Any], unit: Unit) -> Value:
    if field["kind"] != "integer":
        empty = "" if field["kind"] == "text" else bytes(field["size"])
        return Value(field["name"], empty, None, None, None)
    table, complete = _table(field, unit)
    ranges = field.get("ranges_by_unit", {})
    limits = ranges.get(unit.name, ranges.get("others", field))
    minimum, maximum = limits["minimum"], limits["maximum"]
    nearest = min(max(0, minimum), maximum)
    if table and nearest not in table.values():
        nearest = min(table.values())
    return Value(
        name=field["name"],
        default=nearest if field["default"] is None else field["default"],
        minimum=minimum,
        maximum=maximum,
        listed=frozenset(table.values()) if table and complete else None,
        is_mask="flags" in field,
        names=table or None,
    )


def _table(field: Mapping[str, Any], unit: Unit) -> tuple[Mapping[str, int], bool]:
    """Return the values of a field on a unit by name, and whether no others are possible."""
    if own := field.get("enums_by_unit", {}).get(unit.name):
        enumeration = unit.registry["enumerations"][own]
        values = {name: entry["value"] for name, entry in enumeration["values"].items()}
        return values, not enumeration.get("open")
    by_unit = "enums_by_unit" in field  # then "open" means that units have other tables
    closed = by_unit and not unit.registry["enumerations"][field["enumeration"]].get("open")
    complete = (closed or not field.get("open")) and "modifiers" not in field
    return field.get("enum") or {}, complete
