"""Classes of units, made of parts."""

from __future__ import annotations

from dataclasses import dataclass

from stagewire_generator.model import Json, Protocol
from stagewire_generator.targets.documentation import sentence
from stagewire_generator.targets.python.brackets import Nested
from stagewire_generator.targets.python.devices.facts_view import messages_from
from stagewire_generator.targets.python.devices.parts import ClassPlan, UnitPlan
from stagewire_generator.targets.python.source import docstring, literal, paragraph, where

_ELEMENTS = {
    "RackDevice": "bay_class",
    "ChannelsDevice": "channel_class",
    "ModuleDevice": "channel_class",
    "ChannelsBay": "channel_class",
    "AxesDevice": "axis_class",
}
_WHAT = {
    "Channel": "One channel of a {}.",
    "Bay": "One bay of a {}: a controller with one channel.",
    "ChannelsBay": "One bay of a {}: a controller with channels.",
    "Axis": "One axis of a {}.",
}


@dataclass(frozen=True, slots=True)
class UnitClassView:
    """One class of a unit."""

    name: str
    head: Nested
    doc: str
    members: tuple[str, ...]


def unit_class_views(protocol: Protocol, unit: UnitPlan, kind: str) -> list[UnitClassView]:
    """Make the views of the classes of a unit, the device itself the last.

    :param kind: what their docstrings say of them.
    """
    return [_view(protocol, unit, plan, kind) for plan in unit.classes]


def _view(protocol: Protocol, unit: UnitPlan, plan: ClassPlan, kind: str) -> UnitClassView:
    base = f"{plan.base}[{plan.element}]" if plan.element else plan.base
    parts = [f"{part.calls[0].message.chapter}.{part.name}" for part in plan.parts]
    head = Nested(f"class {plan.name}(", (base, *parts), "):")
    members = []
    if plan.level == "device":
        members += ["facts = FACTS", f"unit = UNITS[{literal(unit.name)}]"]
    if plan.element:
        members.append(f"{_ELEMENTS[plan.base]} = {plan.element}")
    return UnitClassView(plan.name, head, _doc(protocol, unit, plan, kind), tuple(members))


def _doc(protocol: Protocol, unit: UnitPlan, plan: ClassPlan, kind: str) -> str:
    entry = unit.entry
    if plan.level != "device":
        first = _WHAT[plan.base].format(unit.name + kind)
        bays = paragraph(_bays(protocol, entry), 4) if plan.level == "bay" else ""
        return docstring(f"{first}\n\n    {bays}\n    " if bays else first)
    texts = [
        f"{unit.name}, {where(protocol, [entry['page']])}. Its messages are {messages_from(protocol, entry)}",
        entry.get("note", ""),
    ]
    parts = [
        paragraph(sentence(entry["title"].rstrip(".") + kind), 4),
        *(paragraph(sentence(text), 4) for text in texts if text),
    ]
    return docstring("\n\n    ".join(parts) + "\n    ")


def _bays(protocol: Protocol, entry: Json) -> str:
    """Return where the bays of a rack are: numbered as the document's addresses, from 1 on."""
    known = protocol.units.get("addresses", {}).get("bays")
    if not known:
        return ""
    count = entry.get("bays", known["last"] - known["first"] + 1)
    places = (f"bay {n + 1} is at 0x{known['first'] + n:02X}" for n in range(count))
    return sentence(", ".join(places))
