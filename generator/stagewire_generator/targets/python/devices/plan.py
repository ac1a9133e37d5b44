"""The calls of a protocol: one for each message that a host sends, or for a whole parameter set."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Final, NamedTuple, TypeAlias

from stagewire_generator.framing import part
from stagewire_generator.model import Json, Layout, Message, ParameterSet, Protocol
from stagewire_generator.model_fields import Field
from stagewire_generator.naming import message_classes
from stagewire_generator.targets.python.brackets import Source
from stagewire_generator.targets.python.devices.arguments import (
    Argument,
    apart,
    arguments_of,
    can_begin,
    given_fields,
    short_words,
    verbless,
)

_CONSTANTS = frozenset({"FACTS", "UNITS", "VALUES"})
_VALUES = frozenset({
    "Any", "Bits", "BitsByUnit", "False", "InUnits", "Message", "Named", "NamedByUnit", "None", "Raw",
    "RawBytes", "RawIntegers", "RawText", "Real", "True", "Values"
})  # fmt: skip


class ValuesPlan(NamedTuple):
    """A class for the values that a controller reports in one layout of a message."""

    name: str
    message: Message
    layout: Layout
    arguments: tuple[Argument, ...]

    @property
    def message_class(self) -> str:
        """Name of the class of the message."""
        return message_classes(self.message)[self.layout.form]


@dataclass(frozen=True)  # without slots, to remember the methods
class Call:
    """A table and its methods.

    :param kind: set, query, action, halt or command.
    :param words: words of its name: ``vel params``, ``move absolute``.
    :param members: role -> message: ``set``, ``req`` and ``get`` of a set, else ``message``.
    :param layout: layout of the message that is sent.
    :param asked: arguments of the request of a set, without its channel.
    """

    kind: str
    words: tuple[str, ...]
    constant: str
    members: Mapping[str, Message]
    layout: Layout
    arguments: tuple[Argument, ...]
    asked: tuple[Argument, ...] = ()
    values: ValuesPlan | None = None

    @property
    def message(self) -> Message:
        """The message that represents the call and decides who receives it."""
        return next(iter(self.members.values()))

    @cached_property
    def methods(self) -> tuple[str, ...]:
        """The verbs of its methods; an empty verb means that the name is only the words."""
        if self.kind == "set":
            readable = {"req", "get"} <= self.members.keys()
            verbs = (("get_", readable), ("set_", "set" in self.members))
            found = [verb for verb, there in verbs if there]
            return tuple([*found, "change_"] if len(found) == 2 and self._reads_all else found)
        if self.kind == "query":
            return ("get_",) if self.message.words[len(self._group) :][:1] == ("req",) else ("",)
        return ("", "start_") if self.kind == "action" else ("",)

    @property
    def _reads_all(self) -> bool:
        """Whether the GET of a set contains all values of the SET, so that some of them can be changed."""
        get = plain_layout(self.members["get"])
        assert get
        read = {field.name: (field.quantity, field.format.kind) for field in get.all_fields}
        return all(
            read.get(a.field.name) == (a.field.quantity, a.field.format.kind)
            for a in self.arguments
        )

    @property
    def long_words(self) -> tuple[str, ...]:
        """Its words with the word of its group in front."""
        return (*self._group, *self.words)

    @property
    def _group(self) -> tuple[str, ...]:
        return (self.message.group,) if self.message.group else ()


class Plan(NamedTuple):
    """All calls of a protocol, and the classes of their results."""

    protocol: Protocol
    values: tuple[ValuesPlan, ...]
    calls: tuple[Call, ...]


def camel_words(words: Sequence[str]) -> str:
    """Return words as the name of a class."""
    return "".join(word[:1].upper() + word[1:] for word in words)


def plan_of(protocol: Protocol) -> Plan:
    """Return the calls, without messages that have no layout and without dummies."""
    values = tuple(_values(protocol))
    answers = {
        v.message.name: v
        for v in values
        if v.layout.form == "reply" or v.layout is plain_layout(v.message)
    }
    calls = [*_sets(protocol, answers), *_messages(protocol, answers)]
    order = {c.name: n for n, c in enumerate(protocol.chapters)}
    calls.sort(key=lambda c: (order[c.message.chapter], c.message.id or 0))
    new = new_groups(protocol)
    names = apart(
        [["_".join(c.words).upper(), "_".join(c.long_words).upper()] for c in calls],
        _CONSTANTS,
        "MESSAGE",
        [c.message.group in new for c in calls],
    )
    named = (_named(call, name) for call, name in zip(calls, names, strict=True))
    return Plan(protocol, values, tuple(named))


def new_groups(protocol: Protocol) -> frozenset[str]:
    """Return the groups of messages that only overlays have.

    Their messages get the longer name if another message has the same one, so that an overlay does not change
    the names of others.
    """
    own = {message.group for message in protocol.messages if not message.overlay}
    return frozenset(message.group for message in protocol.messages) - own


def plain_layout(message: Message) -> Layout | None:
    """Return the layout of a message that is sent, if it needs no choice.

    It is the only layout, or the plain form of a message whose packets differ in their length only. Return
    None if forms depend on a context, or on whether there is a packet.
    """
    if len(message.layouts) == 1:
        return message.layouts[0]
    if any(layout.when or not layout.form.startswith("data") for layout in message.layouts):
        return None
    return next((layout for layout in message.layouts if layout.form == "data"), None)


def other_lengths(message: Message) -> tuple[Layout, ...]:
    """Return the layouts of a message with other lengths than its plain form."""
    plain = plain_layout(message)
    return tuple(layout for layout in message.layouts if plain and layout is not plain)


def _named(call: Call, constant: str) -> Call:
    return Call(
        call.kind,
        call.words,
        constant,
        call.members,
        call.layout,
        call.arguments,
        call.asked,
        call.values,
    )


def _values(protocol: Protocol) -> Iterator[ValuesPlan]:
    """Yield the classes of values, each with a unique name."""
    sets = {s.name: s for s in protocol.sets}
    answering = {name for m in protocol.messages for name in m.exchange.get("answered_by", ())}
    found: list[tuple[Message, Layout, tuple[Argument, ...]]] = []
    for message in protocol.messages:
        for layout in message.layouts if message.id is not None and not message.dummy else ():
            if message.direction != "to_host" and layout.form != "reply":
                continue
            fields = _reported(message, layout)
            if message.name not in answering and not given_fields(protocol, layout):
                continue  # it has no values
            words = _set_words(sets[message.set[0]], message) if message.set else ()
            found.append((message, layout, arguments_of(message, fields, words)))
    new = new_groups(protocol)
    candidates = [list(_values_names(m, x)) for m, x, _ in found]
    names = apart(candidates, _VALUES, "Values", [m.group in new for m, _, _ in found])
    for (message, layout, arguments), name in zip(found, names, strict=True):
        yield ValuesPlan(name, message, layout, arguments)


def _reported(message: Message, layout: Layout) -> list[Field]:
    """Return the values of a layout; after those of the plain one, those that only other lengths have."""
    others = other_lengths(message) if layout is plain_layout(message) else ()
    fields = {f.name: f for x in reversed((layout, *others)) for f in x.all_fields}
    ordered = dict.fromkeys(f.name for x in (layout, *others) for f in x.all_fields)
    return [fields[name] for name in ordered if fields[name].role == "value"]


def _values_names(message: Message, layout: Layout) -> Iterator[str]:
    form = message_classes(message)[layout.form].removeprefix(message.class_name)
    suffix = "" if form == "Reply" else form
    words = verbless(short_words(message))
    yield camel_words(words) + suffix
    yield camel_words([*filter(None, [message.group]), *words]) + suffix


def _set_words(owner: ParameterSet, member: Message) -> tuple[str, ...]:
    words = tuple(word.lower() for word in owner.words)
    return words[1:] if member.group and can_begin(words[1:]) else words


def _sets(protocol: Protocol, answers: Mapping[str, ValuesPlan]) -> Iterator[Call]:
    messages = {message.name: message for message in protocol.messages}
    for owner in protocol.sets:
        members = {role: messages[name] for role, name in owner.members.items()}
        first = next(iter(members.values()))
        words = _set_words(owner, first)
        content, request = members.get("set") or members.get("get") or first, members.get("req")
        layout = plain_layout(content)
        if layout is None or any(plain_layout(member) is None for member in members.values()):
            continue  # a table cannot choose between several forms
        asked = given_fields(protocol, request.layouts[0]) if request else []
        yield Call(
            kind="set",
            words=words,
            constant="",
            members=members,
            layout=layout,
            arguments=arguments_of(content, given_fields(protocol, layout), words)
            if "set" in members
            else (),
            asked=arguments_of(first, asked),
            values=answers.get(members["get"].name) if "get" in members else None,
        )


def _messages(protocol: Protocol, answers: Mapping[str, ValuesPlan]) -> Iterator[Call]:
    halting = {name for m in protocol.messages for name in m.exchange.get("halted_by", ())}
    for message in protocol.messages:
        if message.id is None or message.set or message.dummy or message.direction == "to_host":
            continue
        for layout in sorted(
            message.layouts, key=lambda x: x.form != "data"
        ):  # the plain form first
            if layout.form == "reply":
                continue
            kind, answer = _kind(message, halting), _answer(message, answers)
            if kind == "query" and answer is None:
                kind = "command"  # several messages answer, or one without a layout
            words = short_words(message)
            if kind == "query" and words[0] == "req":
                words = verbless(words)
            if "name" in message.call:
                words = tuple(message.call["name"].split("_"))
            single = "counts" if kind == "action" else ""
            yield Call(
                kind=kind,
                words=(*words, *_form_words(message, layout)),
                constant="",
                members={"message": message},
                layout=layout,
                arguments=arguments_of(message, given_fields(protocol, layout), (), single),
                values=answer if kind == "query" else None,
            )


def _kind(message: Message, halting: set[str]) -> str:
    exchange = message.exchange
    if message.name in halting:
        return "halt"
    if "completes_with" in exchange or "ends_when" in exchange:
        return "action"
    replies = any(layout.form == "reply" for layout in message.layouts)
    return "query" if replies or "answered_by" in exchange else "command"


def _form_words(message: Message, layout: Layout) -> tuple[str, ...]:
    """Return the words for a form of a message; a header form uses the stored value."""
    suffix = message_classes(message)[layout.form].removeprefix(message.class_name).lower()
    return () if not suffix else ("stored",) if suffix == "header" else (suffix,)


def _answer(message: Message, answers: Mapping[str, ValuesPlan]) -> ValuesPlan | None:
    """Return the values of the answer to a message: its reply, or the only message that answers it."""
    named = message.exchange.get("answered_by", [message.name])
    return answers.get(named[0]) if len(named) == 1 else None


Shape: TypeAlias = Mapping[str, tuple[str, str]]
"""Level (channel, bay, device) -> suffix of the name of its class, and its base class in the runtime."""

DEVICE: Final = "device"
"""The level of the device itself."""


class DeviceFraming(NamedTuple):
    """Parts of device classes that depend on the framing.

    :param shape: returns the levels of the classes of a unit from its entry.
    :param addresses: yields the addresses of a unit as arguments of its facts.
    :param names_channel: returns whether a call has a channel.
    """

    shape: Callable[[Protocol, Json], Shape]
    addresses: Callable[[Protocol, Json], Iterator[Source]]
    names_channel: Callable[[Protocol, Sequence[Call]], bool]


def device_framing_of(protocol: Protocol) -> DeviceFraming:
    """Return the :class:`DeviceFraming` of a protocol."""
    framing: DeviceFraming = part(protocol.framing["kind"], "devices")
    return framing
