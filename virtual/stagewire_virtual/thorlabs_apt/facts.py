"""What the registry says of the messages of a unit, looked up once for all its controllers."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from stagewire import FramedMessage
from stagewire_virtual.clock import SECOND
from stagewire_virtual.instrument import Unit

CHANNEL: Final = "chan_ident"
"""The field that names the channel, in a header or in a packet."""


@dataclass(frozen=True, slots=True)
class Value:
    """A value of a parameter set.

    :param name: of the field.
    :param default: of a new controller, if its behaviour knows none: the registry's, or else zero or what is
        nearest to it, or the first of a table that has no zero.
    :param minimum: of an integer; None for a text.
    :param maximum: of an integer; None for a text.
    :param listed: the values of a table that is complete; None where others are possible.
    """

    name: str
    default: Any
    minimum: int | None
    maximum: int | None
    listed: frozenset[int] | None

    def fault(self, value: Any) -> str:
        """Return what is wrong with a value by the document; empty if nothing is."""
        if self.listed is not None and value not in self.listed:
            return f"{self.name} is {value}, not one of {', '.join(map(str, sorted(self.listed)))}"
        if self.minimum is None or self.maximum is None or self.minimum <= value <= self.maximum:
            return ""
        return f"{self.name} is {value}, not from {self.minimum} to {self.maximum}"


@dataclass(frozen=True, slots=True)
class Message:
    """A message of a unit: its place in a parameter set and in the exchange.

    :param name: in the registry.
    :param id: on the wire.
    :param generic: whether it belongs to no kind of controller (chapter of page 15).
    :param to_controller: whether a controller takes it.
    :param set_name: the parameter set; empty where it belongs to none.
    :param role: ``set``, ``req`` or ``get`` in that set; empty where it belongs to none.
    :param values: of the set, without the channel and what is reserved.
    :param names_channel: whether it has a field for the channel.
    :param answered_by: what answers it.
    :param announces: what a set sends back, unasked, when it has been stored.
    :param starts: what it lets the controller send.
    :param stops: what it keeps the controller from sending.
    :param period: after which what it starts comes again, in nanoseconds; None where it does not.
    :param muted_by: the messages that keep it from being sent.
    :param counts: whether it counts for the keep-alive when it is sent unasked.
    """

    name: str
    id: int
    generic: bool
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
        """Whether it concerns a unit as a whole, so that one without channels has it, too."""
        return self.generic and not self.names_channel


@functools.lru_cache(maxsize=128)
def facts_of(unit: Unit) -> Mapping[str, Message]:
    """Return the messages of a unit by name."""
    return {name: _message(unit.message(name)) for name in sorted(unit.messages)}


def class_of(unit: Unit, name: str) -> type[FramedMessage]:
    """Return the class of a message of a unit that has one form."""
    found: Any = unit.protocol.message_class(name)
    cls: type[FramedMessage] = found
    return cls


def _message(entry: Mapping[str, Any]) -> Message:
    exchange = entry["exchange"]
    place = entry["set"] or {"name": "", "role": ""}
    fields = [field for layout in entry["layouts"] for field in _fields(layout)]
    return Message(
        name=entry["name"],
        id=entry["id"],
        generic=entry["chapter"] == "generic",
        to_controller=entry["direction"] != "to_host",
        set_name=place["name"],
        role=place["role"],
        values=tuple(_value(field) for field in fields if field["name"] != CHANNEL),
        names_channel=any(field["name"] == CHANNEL for field in fields),
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
    """Return the fields of a layout that carry values, header parameters first."""
    parameters = [layout[name] for name in ("param1", "param2") if layout[name]]
    return [field for field in [*parameters, *layout["fields"]] if field["role"] == "value"]


def _value(field: Mapping[str, Any]) -> Value:
    if field["kind"] != "integer":
        empty = "" if field["kind"] == "text" else bytes(field["size"])
        return Value(field["name"], empty, None, None, None)
    table = field.get("enum")
    complete = not field.get("open") and "modifiers" not in field
    minimum, maximum = field["minimum"], field["maximum"]
    nearest = min(max(0, minimum), maximum)
    if table and nearest not in table.values():
        nearest = min(table.values())
    return Value(
        name=field["name"],
        default=nearest if field["default"] is None else field["default"],
        minimum=minimum,
        maximum=maximum,
        listed=frozenset(table.values()) if table and complete else None,
    )
