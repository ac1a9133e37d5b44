"""Mixins of device classes: the calls that units share, their methods, and the classes with each call."""

from __future__ import annotations

from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import groupby
from typing import NamedTuple

from stagewire_generator.model import STATES, Json, Protocol
from stagewire_generator.model_fields import Field
from stagewire_generator.naming import camel
from stagewire_generator.targets.python.brackets import Nested, Source
from stagewire_generator.targets.python.devices.arguments import (
    METHODS,
    Argument,
    apart,
    table_class,
)
from stagewire_generator.targets.python.devices.documentation import method_doc
from stagewire_generator.targets.python.devices.plan import (
    DEVICE,
    Call,
    DeviceFraming,
    Plan,
    Shape,
    camel_words,
    device_framing_of,
    new_groups,
)

_TYPES = {"integer": "int", "text": "str", "bytes": "bytes", "array": "tuple[int, ...]"}
_PRIMITIVES = {"get_": "_get", "set_": "_set", "change_": "_change", "start_": "_start"}
_OF_KIND = {"query": "_ask", "action": "_act", "halt": "_halt", "command": "_tell"}
_MOTIONS = {"": "MotionEnd[{}]", "start_": "Motion[{}]"}


class MethodView(NamedTuple):
    """A method."""

    name: str
    signature: Nested
    doc: str
    body: Nested
    returns: str
    decorator: str = ""


def method_view(protocol: Protocol, call: Call, verb: str, name: str, end: str) -> MethodView:
    """Make the view of a method.

    :param end: type of the values at the end of a motion; see :mod:`.motion_types`.

    :param verb: the prefix of its name; empty for a name that is only the words of the call.
    """
    timeout = verb != "start_"
    arguments = call.arguments
    asked: tuple[Argument, ...] = ()
    positional: tuple[Argument, ...] = ()
    if call.kind == "set":
        asked = call.asked if verb in ("get_", "change_") else ()
        arguments = () if verb == "get_" else _without(call.arguments, asked)
    else:
        positional = _positional(arguments)
    primitive = _PRIMITIVES.get(verb) if call.kind in ("set", "action") else None
    primitive = primitive or _OF_KIND[call.kind]
    if verb == "set_" and "get" not in call.members:
        primitive = "_tell"  # it cannot be read, so it is a command
    returns = "None"
    if call.kind in ("action", "halt"):
        returns = _MOTIONS[verb].format(end) + (" | None" if call.kind == "halt" else "")
    elif verb != "set_" and call.values:
        returns = f"v.{call.values.name}"
    some = verb == "change_"
    mover = "self: Mover[Reported]" if "Reported" in returns else "self"
    items: list[Source] = [mover, *(_parameter(a, False) for a in positional)]
    keywords = [p for a in asked for p in _keywords(a, False)]
    keywords += [
        p for a in _without(arguments, positional) for p in _keywords(a, some or a.is_partial)
    ]
    if timeout:
        keywords.append("timeout: float | None = None")
    if keywords:
        items += ["*", *keywords]
    signature = Nested(f"def {name}(", tuple(items), f") -> {returns}:")
    given: list[Source] = [f"t.{call.constant}"]
    if timeout:
        given.append("timeout")
    given += [
        f"{k}={k}" for a in (*asked, *arguments) for k in (a.keyword, *(w.keyword for w in a.ways))
    ]
    result = "" if returns == "None" else "return "
    body = Nested(f"{result}self.{primitive}(", tuple(given), ")")
    doc = method_doc(protocol, call, verb, (*asked, *arguments), timeout)
    return MethodView(name, signature, doc, body, returns)


def also_views(protocol: Protocol, call: Call, verb: str, end: str) -> Iterator[MethodView]:
    """Make the views of the further methods of a call; each has one argument, the raw value."""
    if len(call.arguments) != 1:
        return  # another form of the message has the argument
    [argument] = call.arguments
    for name, word in call.message.call.get("also", {}).items():
        only = replace(call, arguments=(argument._replace(keyword=word, ways=()),))
        view = method_view(protocol, only, verb, verb + name, end)
        items = tuple(
            f"{argument.keyword}={word}" if item == f"{word}={word}" else item
            for item in view.body.items
        )
        yield view._replace(body=view.body._replace(items=items))


def asynchronous(method: MethodView) -> MethodView:
    """Return the view of a method for asyncio."""
    signature, body = method.signature, method.body
    before, called = body.opening.split("self.")
    if method.decorator:  # an attribute of what is awaited
        before, body = f"{before}(", body._replace(closing=f"){body.closing}")
    return method._replace(
        signature=signature._replace(opening=f"async {signature.opening}"),
        body=body._replace(opening=f"{before}await self.{called}"),
    )


def _positional(arguments: Sequence[Argument]) -> tuple[Argument, ...]:
    """Return the arguments that may be positional: without a unit, and with defaults at the end."""
    found = tuple(a for a in arguments if not a.ways)
    defaults = [a.default is not None for a in found]
    return found if defaults == sorted(defaults) else ()


def _without(arguments: Sequence[Argument], others: Sequence[Argument]) -> tuple[Argument, ...]:
    known = {other.keyword for other in others}
    return tuple(argument for argument in arguments if argument.keyword not in known)


def _keywords(argument: Argument, some: bool) -> list[str]:
    """Return the parameters of a value: the raw one, and one for each unit."""
    parameter = _parameter(argument, some or bool(argument.ways))
    return [parameter, *(f"{way.keyword}: Number | None = None" for way in argument.ways)]


def _parameter(argument: Argument, optional: bool) -> str:
    """Return the parameter of a raw value."""
    field = argument.field
    head = f"{argument.keyword}: {_type(field)}"
    if argument.default is not None and not optional:
        named = f"{table_class(field)}." if isinstance(argument.default, str) else ""
        return f"{head} = {named}{argument.default}"
    return f"{head} | None = None" if optional else head


def _type(field: Field) -> str:
    table = table_class(field)
    if field.format.real:
        return "Number"
    others = dict.fromkeys(f"e.{camel(t.name)}" for t in field.enums_by_unit.values())
    return " | ".join((table, *others, "str | int")) if table else _TYPES[field.format.kind]


class Part(NamedTuple):
    """A class with the methods of one parameter set, or of one message in all its forms.

    :param verbs: prefixes of its methods; may be only some of the set's.
    """

    name: str
    calls: tuple[Call, ...]
    verbs: tuple[str, ...]


class ClassPlan(NamedTuple):
    """A class of a unit.

    :param base: its base class in the runtime.
    :param element: the class of its bays, channels or axes; empty if it has none.
    :param stops: whether it has the `stop()` of the runtime, which ends its outputs and loops.
    """

    name: str
    level: str
    base: str
    element: str
    parts: tuple[Part, ...]
    stops: bool = False

    @property
    def halts(self) -> tuple[Call, ...]:
        """Its calls that end a motion or an output."""
        return tuple(call for part in self.parts for call in part.calls if call.kind == "halt")


class UnitPlan(NamedTuple):
    """A unit and its classes; the device itself is the last."""

    name: str
    entry: Json
    messages: frozenset[str]
    classes: tuple[ClassPlan, ...]


class Parts(NamedTuple):
    """All parts in the order of the document, and the units.

    :param names: constant of a call -> name of its methods without the verb.
    """

    parts: tuple[Part, ...]
    units: tuple[UnitPlan, ...]
    names: Mapping[str, str]


def parts_of(plan: Plan) -> Parts:
    """Return the parts that the units of a protocol need, and the units with their classes."""
    protocol = plan.protocol
    entries = dict(sorted(protocol.units.get("units", {}).items()))
    messages = {name: protocol.messages_of(entry) for name, entry in entries.items()}
    groups = [tuple(calls) for _, calls in groupby(plan.calls, key=lambda c: c.message.name)]
    lists = set(messages.values())  # many units support the same messages
    verbs = {
        calls[0].constant: {some: _verbs(calls[0], some) for some in lists} for calls in groups
    }
    needed = [
        (calls, some)
        for calls in groups
        for some in sorted({*verbs[calls[0].constant].values()} - {()})
    ]
    new = new_groups(protocol)
    parts = _named(needed, new)
    of_lists = {
        some: [part for part in parts if part.verbs == verbs[part.calls[0].constant][some]]
        for some in lists
    }
    units = tuple(
        UnitPlan(
            name, entry, messages[name], _classes(protocol, name, entry, of_lists[messages[name]])
        )
        for name, entry in entries.items()
    )
    classes = [c.parts for unit in units for c in unit.classes]
    names = _method_names(classes, new)
    used = {id(part) for taken in classes for part in taken}  # a family may leave some out
    parts = tuple(part for part in parts if id(part) in used)
    return Parts(parts, tuple(_with_stops(unit, names) for unit in units), names)


def _with_stops(unit: UnitPlan, names: Mapping[str, str]) -> UnitPlan:
    """Return a unit whose classes have the `stop()` of the runtime if they have something else to end.

    A class with a method `stop` of a message keeps that one.
    """
    controller = "bay" if any(plan.level == "bay" for plan in unit.classes) else DEVICE
    classes = []
    for plan in unit.classes:
        own = {names[call.constant] for part in plan.parts for call in part.calls}
        ordered = plan.level == controller and any(key in unit.entry for key in STATES)
        stops = "stop" not in own and bool(ordered or plan.halts)
        classes.append(plan._replace(stops=stops))
    return unit._replace(classes=tuple(classes))


_NEEDS = {"get_": {"req", "get"}, "set_": {"set"}, "change_": {"set", "req", "get"}}
"""Verb of a method of a parameter set -> the messages that it needs."""


def _verbs(call: Call, known: frozenset[str]) -> tuple[str, ...]:
    """Return the verbs of a call that a unit with these messages supports."""
    have = {role for role, message in call.members.items() if message.name in known}
    if call.kind != "set":
        answers = call.message.exchange.get("answered_by", ())
        return call.methods if have and (not answers or known & {*answers}) else ()
    return tuple(verb for verb in call.methods if _NEEDS[verb] <= have) if have else ()


def _named(
    needed: Sequence[tuple[tuple[Call, ...], tuple[str, ...]]], new: Container[str]
) -> tuple[Part, ...]:
    names = []
    for calls, verbs in needed:
        call = calls[0]
        whole = verbs == call.methods
        head = "With" if whole and verbs[0] else f"Can{camel_words([verbs[0].rstrip('_')])}"
        names.append([head + camel_words(call.words), head + camel_words(call.long_words)])
    late = [calls[0].message.group in new for calls, _ in needed]
    found = zip(needed, apart(names, (), "Message", late), strict=True)
    return tuple(Part(name, calls, verbs) for (calls, verbs), name in found)


def _classes(
    protocol: Protocol, name: str, entry: Json, parts: Iterable[Part]
) -> tuple[ClassPlan, ...]:
    """Return the classes of a unit that supports these parts."""
    framing = device_framing_of(protocol)
    shape = framing.shape(protocol, entry)
    taken: dict[str, list[Part]] = {level: [] for level in shape}
    family = protocol.units["families"][entry["family"]]
    without = family.get("classes", {}).get("without", {})
    for part in parts:
        if part.calls[0].message.name not in without:
            for level in _takers(framing, protocol, part.calls, shape):
                taken[level].append(part)
    classes: list[ClassPlan] = []
    for level, (suffix, base) in shape.items():
        if "positions" in family and level == DEVICE:
            base = "PositionsDevice"
        element = classes[-1].name if classes else ""
        classes.append(ClassPlan(name + suffix, level, base, element, tuple(taken[level])))
    return tuple(classes)


def _takers(
    framing: DeviceFraming, protocol: Protocol, calls: Sequence[Call], shape: Shape
) -> tuple[str, ...]:
    """Return the levels whose classes get a call; they depend on its addressee and its channel."""
    message, controller = calls[0].message, "bay" if "bay" in shape else DEVICE
    if framing.names_channel(protocol, calls):
        return ("channel",) if "channel" in shape else (controller,)
    if message.addressee == "every":
        return tuple(dict.fromkeys((controller, DEVICE)))
    return (DEVICE,) if message.addressee else (controller,)


def _method_names(classes: Iterable[Sequence[Part]], new: Container[str]) -> Mapping[str, str]:
    """Return the names of the methods of each call, unique within each class.

    If two calls of a class have the same name, both are prefixed with the word of their group. If only one of
    them belongs to a group that is not new, it keeps its name.
    """
    made = list(classes)
    calls = {call.constant: call for parts in made for part in parts for call in part.calls}
    choices = {
        constant: ["_".join(call.words), "_".join(call.long_words)]
        for constant, call in calls.items()
    }
    changed = True
    while changed:
        changed = False
        for parts in made:
            seen: dict[str, list[str]] = {}
            for call in (call for part in parts for call in part.calls):
                for verb in call.methods:
                    seen.setdefault(verb + choices[call.constant][0], []).append(call.constant)
            for method, constants in seen.items():
                if len(constants) < 2 and method not in METHODS:
                    continue
                old = [one for one in constants if calls[one].message.group not in new]
                kept = old[0] if len(old) == 1 and method not in METHODS else ""
                for n, constant in enumerate(constants):
                    if constant == kept:
                        continue
                    if len(choices[constant]) > 1:
                        del choices[constant][0]
                        changed = True
                    elif n or kept or method in METHODS:
                        choices[constant][0] += "_message"
                        changed = True
    return {constant: names[0] for constant, names in choices.items()}
