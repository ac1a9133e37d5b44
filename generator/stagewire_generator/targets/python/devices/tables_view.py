"""The module of tables: one per call, shared by the classes for threads and for asyncio.

Also the modules of values, with a class for each reply of a controller.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

from stagewire_generator.model import Layout, Message, Protocol
from stagewire_generator.model_fields import Field
from stagewire_generator.naming import camel, message_classes
from stagewire_generator.targets.documentation import sentence, title_of, where
from stagewire_generator.targets.python.brackets import Nested, Source, mapping
from stagewire_generator.targets.python.devices.arguments import Argument, table_class
from stagewire_generator.targets.python.devices.documentation import raw_text, unit_text
from stagewire_generator.targets.python.devices.plan import (
    Call,
    Plan,
    ValuesPlan,
    other_lengths,
    plain_layout,
)
from stagewire_generator.targets.python.source import docstring, literal, paragraph

_ENDS = ("completes_with", "stops_with")
_RANK = {"set": 0, "query": 0, "halt": 1}  # tables that others refer to come first


def class_of(message: Message, layout: Layout) -> str:
    """Return the class of a layout, as the modules of devices refer to it."""
    return f"m.{message_classes(message)[layout.form]}"


def default_value(argument: Argument) -> int | None:
    """Return the raw value of a default, which the registry may give by name."""
    found, table = argument.default, argument.field.enum
    if isinstance(found, str):
        assert table  # a lint rule ensures it
        return next(value.value for value in table.values if value.name == found)
    return found


class TableWriter:
    """Writes the tables of a protocol."""

    def __init__(self, plan: Plan) -> None:
        self._messages = {message.name: message for message in plan.protocol.messages}
        self.calls = sorted(plan.calls, key=lambda call: _RANK.get(call.kind, 2))
        self._of: dict[str, Call] = {}
        for call in self.calls:
            for message in call.members.values():
                self._of.setdefault(message.name, call)

    def tables(self) -> tuple[Nested, ...]:
        """Return the statements of the tables, ordered so that none refers to a later one."""
        return tuple(self._table(call) for call in self.calls)

    def poll(self, ends_when: dict[str, str]) -> Nested:
        """Return the poll for the end of an action."""
        message = self._messages[ends_when["read"]]
        forms = {layout.form: layout for layout in message.layouts}
        field = next(f for f in forms["reply"].fields if f.name == ends_when["field"])
        assert field.enum  # a lint rule ensures it
        value = next(v.value for v in field.enum.values if v.name == ends_when["value"])
        items = (
            class_of(message, forms["request"]),
            class_of(message, forms["reply"]),
            literal(field.name),
            f"0x{value:02X}",
        )
        return Nested("Poll(", items, ")")

    def _table(self, call: Call) -> Nested:
        kind = {"set": "ParameterSet", "query": "Query", "command": "Command"}.get(
            call.kind, "Action"
        )
        if call.kind == "set" and "get" not in call.members:
            kind = "Command"  # it cannot be read
        parts = {"ParameterSet": self._set, "Query": self._query}.get(kind, self._told)
        items = [literal("_".join(call.words)), *parts(call)]
        if call.message.addressee == "motherboard":
            items.append("motherboard=True")
        return Nested(f"{call.constant} = {kind}(", tuple(items), ")")

    def _set(self, call: Call) -> Iterator[Source]:
        assert call.values
        yield f"values=v.{call.values.name}"
        for role in ("set", "req", "get"):
            member = call.members.get(role)
            yield f"{role}={_plain_class(member)}" if member else f"{role}=None"
        yield from _given("given", call.arguments)
        yield from _given("asked", call.asked)
        if "get" in call.members:
            others = tuple(_others(call.members["get"], call.members.get("set")))
            if others:
                yield Nested("others=(", others, ")")
        if "set" in call.members:
            forms = tuple(_sent(call.members["set"]))
            if forms:
                yield Nested("forms=(", forms, ")")
            effect = call.members["set"].effect
            if call.message.tells == "counter":
                effect = "counter"
            if effect != "settings":
                yield f"effect={literal(effect)}"

    def _query(self, call: Call) -> Iterator[Source]:
        assert call.values
        yield f"values=v.{call.values.name}"
        yield f"req={class_of(call.message, call.layout)}"
        answer = call.values.message
        forms = [call.values.layout, *other_lengths(answer)]
        yield _tuple("gets=", [class_of(answer, form) for form in forms])
        yield from _given("asked", call.arguments)

    def _told(self, call: Call) -> Iterator[Source]:
        exchange = call.message.exchange
        yield f"message={class_of(call.message, call.layout)}"
        yield from _given("given", call.arguments)
        if any(key in exchange for key in _ENDS):
            ends = [_tuple("", self._classes(exchange.get(key, ()))) for key in _ENDS]
            yield Nested("ends=Ends(", tuple(ends), ")")
        if "ends_when" in exchange:
            yield Nested("poll=Poll(", self.poll(exchange["ends_when"]).items, ")")
        halts = [self._of[name].constant for name in exchange.get("halted_by", ())]
        if halts:
            yield f"halted_by={halts[0]}"
        if halts[1:]:
            yield _tuple("or_halted_by=", halts[1:])
        targets = [a.field.target for a in call.arguments if a.field.target]
        stored = exchange.get("stored")
        if stored and not targets:
            source = self._of[stored["read"]]
            assert source.values  # a lint rule ensures it
            fields = source.values.layout.all_fields
            items = [source.constant, literal(stored["field"])]
            if "when" in stored:
                items.append(f"when={_state(stored['when'], fields)}")
            yield Nested("stored=Stored(", tuple(items), ")")
            targets = [f.target for f in fields if f.name == stored["field"] and f.target]
        if targets and call.kind == "action":
            yield f"target={literal(targets[0])}"
        for key in ("stops", "starts"):
            if key in exchange and call.kind == "command":
                yield _tuple(f"{key}=", self._classes(exchange[key]))

    def _classes(self, names: Iterable[str]) -> Iterator[str]:
        """Yield the classes of messages in all their forms."""
        for message in (self._messages[name] for name in names):
            layouts = sorted(message.layouts, key=lambda layout: layout.form)
            yield from (class_of(message, layout) for layout in layouts)
            if any(layout.when for layout in message.layouts):
                yield f"m.{message.class_name}Undecided"


def _plain_class(message: Message) -> str:
    layout = plain_layout(message)
    assert layout  # otherwise the plan has no such call
    return class_of(message, layout)


def _others(get: Message, set: Message | None) -> Iterator[Source]:
    """Yield the replies of other lengths, each with the message that writes the set in that length."""
    writing = {layout.form: class_of(set, layout) for layout in other_lengths(set)} if set else {}
    for layout in other_lengths(get):
        yield _tuple("", (class_of(get, layout), writing.get(layout.form, "None")))


def _sent(message: Message) -> Iterator[Source]:
    """Yield the forms that are sent in some contexts, each with its context."""
    for layout in message.layouts:
        if layout.sent_when:
            context = mapping(
                "", [f"{literal(k)}: {literal(v)}" for k, v in layout.sent_when.items()]
            )
            yield _tuple("", (class_of(message, layout), context))


def _given(key: str, arguments: Sequence[Argument]) -> Iterator[Nested]:
    if arguments:
        yield _tuple(f"{key}=", [_argument(argument) for argument in arguments])


def _state(when: dict[str, str], fields: Sequence[Field]) -> str:
    """Return a field and its number in a state."""
    enum = next(field.enum for field in fields if field.name == when["field"])
    assert enum  # a lint rule ensures it
    value = next(v.value for v in enum.values if v.name == when["value"])
    return f"({literal(when['field'])}, 0x{value:02X})"


def _tuple(head: str, items: Iterable[Source]) -> Nested:
    return Nested(f"{head}(", tuple(items), ")")


def _argument(argument: Argument) -> Nested:
    field = argument.field
    items: list[Source] = [literal(field.name), literal(argument.keyword)]
    if argument.ways:
        assert field.quantity
        items.append(f"quantity={literal(field.quantity.name)}")
        ways = [
            _tuple("", [literal(w.keyword), literal(w.unit), literal(w.case) if w.case else "None"])
            for w in argument.ways
        ]
        items.append(_tuple("ways=", ways))
    if field.enum or field.flags:
        items.append(f"choices={table_class(field)}")
        if field.enum and field.enum.modifiers:
            items.append(f"modifiers=0x{sum(v.value for v in field.enum.modifiers):02X}")
        if field.open or (
            field.enum.open if field.enums_by_unit and field.enum else not field.lists_all
        ):
            items.append("open=True")
    if field.format.kind == "integer":
        low, high = field.own_range
        items += [f"minimum={low}", f"maximum={high}"]
    if field.format.real:
        items.append(f"real={field.format.size}")
    if field.ranges_by_unit:
        ranges = (f"{literal(u)}: {limits}" for u, limits in field.ranges_by_unit.items())
        items.append(Nested("ranges={", tuple(ranges), "}"))
    if field.enums_by_unit:
        names = (
            f"{literal(u)}: (e.{camel(t.name)}, {bool(field.open or t.open)})"
            for u, t in field.enums_by_unit.items()
        )
        items.append(Nested("names={", tuple(names), "}"))
    if field.target:
        items.append(f"target={literal(field.target)}")
    default = default_value(argument)
    if default is not None:
        items.append(f"default={default}")
    return Nested("Given(", tuple(items), ")")


_KINDS = {"integer": "Raw", "text": "RawText", "bytes": "RawBytes", "array": "RawIntegers"}


class ValueView(NamedTuple):
    """A value: its statement and its docstring."""

    made: Nested
    doc: str


class ValuesView(NamedTuple):
    """A class of values.

    :param kinds: the classes of the runtime that its members need.
    """

    name: str
    message: str
    head: Nested
    doc: str
    members: tuple[ValueView, ...]
    kinds: tuple[str, ...]


def values_view(protocol: Protocol, plan: ValuesPlan) -> ValuesView:
    """Make the view of a class of values."""
    members: list[ValueView] = []
    kinds: set[str] = set()
    for argument in plan.arguments:
        for kind, made, text in _members(argument):
            kinds.add(kind)
            members.append(ValueView(made, docstring(paragraph(sentence(text), 4))))
    message = plan.message
    found = where(protocol, message.pages, message.overlay)
    classes = [f"m.{plan.message_class}"]
    if plan.layout is plain_layout(message):
        classes += [class_of(message, layout) for layout in other_lengths(message)]
    first = (
        f"The {title_of(message)} reported by ``{message.name}``."
        if message.set
        else f"Values of ``{message.name}``."
    )
    doc = f"{first}\n\n    {paragraph(f'{sentence(message.summary)} {sentence(found)}', 4)}\n    "
    return ValuesView(
        name=plan.name,
        message=f"m.{plan.message_class}",
        head=Nested(f"class {plan.name}(", (f"Values[{' | '.join(classes)}]",), "):"),
        doc=docstring(doc),
        members=tuple(members),
        kinds=tuple(kinds),
    )


def _members(argument: Argument) -> Iterator[tuple[str, Nested, str]]:
    """Yield class, statement and text of each value of a field."""
    field = argument.field
    kind, items = _kind(field)
    head = f"{argument.keyword} = {kind}("
    yield kind, Nested(head, (literal(field.name), *items), ")"), raw_text(field)
    for way in argument.ways:
        assert field.quantity
        parts = (literal(field.name), literal(field.quantity.name), literal(way.unit))
        made = Nested(f"{way.keyword} = InUnits(", parts, ")")
        yield "InUnits", made, unit_text(argument, way)


def _kind(field: Field) -> tuple[str, tuple[str | Nested, ...]]:
    if field.enum and field.enums_by_unit:
        units = (f"{literal(u)}: e.{camel(t.name)}" for u, t in field.enums_by_unit.items())
        return "NamedByUnit", (f"e.{camel(field.enum.name)}", Nested("{", tuple(units), "}"))
    if field.enum:
        return "Named", (f"e.{camel(field.enum.name)}",)
    if field.flags_by_unit and field.flags:
        units = (f"{literal(u)}: f.{camel(t.name)}" for u, t in field.flags_by_unit.items())
        return "BitsByUnit", (f"f.{camel(field.flags.name)}", Nested("{", tuple(units), "}"))
    if field.flags:
        return "Bits", (f"f.{camel(field.flags.name)}",)
    if field.format.real:
        return "Real", (str(field.format.size),)
    return _KINDS[field.format.kind], ()
