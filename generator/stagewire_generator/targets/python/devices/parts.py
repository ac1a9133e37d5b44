"""Parts of device classes: the calls that units share, and which class of a unit has them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby

from stagewire_generator.model import Json, Protocol
from stagewire_generator.targets.python.devices.framing import (
    DEVICE,
    DeviceFraming,
    Shape,
    device_framing_of,
)
from stagewire_generator.targets.python.devices.naming import METHODS, apart
from stagewire_generator.targets.python.devices.plan import Call, Plan, camel_words


@dataclass(frozen=True, slots=True)
class Part:
    """A class with the methods of one parameter set, or of one message in all its forms.

    :param verbs: what its methods begin with; of a set perhaps fewer than the set has.
    """

    name: str
    calls: tuple[Call, ...]
    verbs: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class ClassPlan:
    """A class of a unit.

    :param base: the class of the runtime that it is made from.
    :param element: the class of its bays, channels or axes; empty if it has none.
    """

    name: str
    level: str
    base: str
    element: str
    parts: tuple[Part, ...]


@dataclass(frozen=True, slots=True)
class UnitPlan:
    """A unit and its classes, the device itself the last."""

    name: str
    entry: Json
    messages: frozenset[str]
    classes: tuple[ClassPlan, ...]


@dataclass(frozen=True, slots=True)
class Parts:
    """All parts that units have, in the order of the document, and the units.

    :param names: constant of a call -> what its methods are called, behind their verbs.
    """

    parts: tuple[Part, ...]
    units: tuple[UnitPlan, ...]
    names: Mapping[str, str]


def parts_of(plan: Plan) -> Parts:
    """Return the parts that the units of a protocol need, and the classes of the units."""
    protocol = plan.protocol
    entries = dict(sorted(protocol.units.get("units", {}).items()))
    messages = {name: _messages(protocol, entry) for name, entry in entries.items()}
    groups = [tuple(calls) for _, calls in groupby(plan.calls, key=lambda c: c.message.name)]
    needed = [
        (calls, verbs)
        for calls in groups
        for verbs in sorted({_verbs(calls[0], known) for known in messages.values()} - {()})
    ]
    parts = _named(needed)
    units = tuple(
        UnitPlan(
            name, entry, messages[name], _classes(protocol, name, entry, messages[name], parts)
        )
        for name, entry in entries.items()
    )
    return Parts(parts, units, _method_names([c.parts for unit in units for c in unit.classes]))


def _messages(protocol: Protocol, entry: Json) -> frozenset[str]:
    """Return what a unit answers and sends: its printed list, or what its family has instead."""
    units = protocol.units
    key = entry.get("list")
    if key is None:
        family = units["families"][entry["family"]]
        if "messages" in family:
            return frozenset(family["messages"])
        key = units["units"][family["like"]]["list"]
    printed = units["lists"][key]
    return frozenset({*printed["messages"], *printed.get("completes", ())})


def _verbs(call: Call, known: frozenset[str]) -> tuple[str, ...]:
    """Return the methods of a call that a unit with these messages has."""
    have = {role for role, message in call.members.items() if message.name in known}
    if call.kind != "set":
        answers = call.message.exchange.get("answered_by", ())
        return call.methods if have and (not answers or known & {*answers}) else ()
    needs = {"get_": {"req", "get"}, "set_": {"set"}, "change_": {"set", "req", "get"}}
    return tuple(verb for verb in call.methods if needs[verb] <= have)


def _named(needed: Sequence[tuple[tuple[Call, ...], tuple[str, ...]]]) -> tuple[Part, ...]:
    names = []
    for calls, verbs in needed:
        call = calls[0]
        whole = verbs == call.methods
        head = "With" if whole and verbs[0] else f"Can{camel_words([verbs[0].rstrip('_')])}"
        names.append([head + camel_words(call.words), head + camel_words(call.long_words)])
    found = zip(needed, apart(names, (), "Message"), strict=True)
    return tuple(Part(name, calls, verbs) for (calls, verbs), name in found)


def _classes(
    protocol: Protocol, name: str, entry: Json, known: frozenset[str], parts: Iterable[Part]
) -> tuple[ClassPlan, ...]:
    framing = device_framing_of(protocol)
    shape = framing.shape(protocol, entry)
    taken: dict[str, list[Part]] = {level: [] for level in shape}
    for part in parts:
        if part.verbs == _verbs(part.calls[0], known):
            for level in _takers(framing, protocol, part.calls, shape):
                taken[level].append(part)
    classes: list[ClassPlan] = []
    for level, (suffix, base) in shape.items():
        element = classes[-1].name if classes else ""
        classes.append(ClassPlan(name + suffix, level, base, element, tuple(taken[level])))
    return tuple(classes)


def _takers(
    framing: DeviceFraming, protocol: Protocol, calls: Sequence[Call], shape: Shape
) -> tuple[str, ...]:
    """Return the levels whose classes get a call: where its message goes, and whose channel it names."""
    message, controller = calls[0].message, "bay" if "bay" in shape else DEVICE
    if framing.names_channel(protocol, calls):
        return ("channel",) if "channel" in shape else (controller,)
    if message.addressee == "every":
        return tuple(dict.fromkeys((controller, DEVICE)))
    return (DEVICE,) if message.addressee else (controller,)


def _method_names(classes: Iterable[Sequence[Part]]) -> Mapping[str, str]:
    """Return what the methods of each call are called, such that no class has two of one name.

    Of two calls of one class that are alike both get the word of their group in front.
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
                for n, constant in enumerate(constants):
                    if len(choices[constant]) > 1:
                        del choices[constant][0]
                        changed = True
                    elif n or method in METHODS:
                        choices[constant][0] += "_message"
                        changed = True
    return {constant: names[0] for constant, names in choices.items()}
