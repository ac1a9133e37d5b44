"""The packages ``devices`` and ``aio``: their modules and the contents of each."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import NamedTuple

from stagewire_generator.framing import FRAMINGS
from stagewire_generator.model import Json, Protocol
from stagewire_generator.model_scales import Conflict, Stage
from stagewire_generator.targets.documentation import evidence_text, sentence, where
from stagewire_generator.targets.python.brackets import Import, Nested
from stagewire_generator.targets.python.devices.attributes_view import further_views
from stagewire_generator.targets.python.devices.classes_view import member_sources
from stagewire_generator.targets.python.devices.documentation import part_doc
from stagewire_generator.targets.python.devices.facts_view import (
    FactsView,
    facts_view,
    messages_from,
)
from stagewire_generator.targets.python.devices.imports import (
    facts_imports,
    names_in,
    parts_imports,
    tables_imports,
    units_imports,
    values_imports,
)
from stagewire_generator.targets.python.devices.motion_types import MotionTypes
from stagewire_generator.targets.python.devices.parts import (
    ClassPlan,
    MethodView,
    Part,
    Parts,
    UnitPlan,
    also_views,
    asynchronous,
    method_view,
    parts_of,
)
from stagewire_generator.targets.python.devices.plan import Plan, plan_of
from stagewire_generator.targets.python.devices.tables_view import (
    TableWriter,
    ValuesView,
    values_view,
)
from stagewire_generator.targets.python.source import docstring, literal, paragraph

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


class UnitClassView(NamedTuple):
    """A class of a unit."""

    name: str
    head: Nested
    doc: str
    members: tuple[str, ...]


def unit_class_views(
    protocol: Protocol, unit: UnitPlan, kind: str, types: MotionTypes
) -> list[UnitClassView]:
    """Make the views of the classes of a unit; the device itself is the last.

    :param kind: words for their docstrings, such as ``" for asyncio"``.
    """
    return [view for plan in unit.classes for view in _views(protocol, unit, plan, kind, types)]


def _views(
    protocol: Protocol, unit: UnitPlan, plan: ClassPlan, kind: str, types: MotionTypes
) -> Iterator[UnitClassView]:
    base = f"{plan.base}[{plan.element}]" if plan.element else plan.base
    parts = [f"{part.calls[0].message.chapter}.{part.name}" for part in plan.parts]
    bases = (base, *(["Stoppable"] if plan.stops else []), *parts)
    reported = types.of_unit(unit, plan)
    typed = [f"if TYPE_CHECKING:\n        _reported: {reported}"] if reported else []
    members = []
    own = [*member_sources(protocol, unit, plan, aio=bool(kind))]
    if plan.level == "device":
        if parts:  # help() begins with the bases of a class: one instead of thirty
            calls = f"_{plan.name}Calls"
            doc = docstring(f"The calls of a {unit.name}{kind}.")
            head = Nested(f"class {calls}(", bases, "):")
            yield UnitClassView(calls, head, doc, _spaced([*typed, *own]))
            bases, typed, own = (calls,), [], []
        members += ["facts = FACTS", f"unit = UNITS[{literal(unit.name)}]"]
    if plan.element:
        members.append(f"{_ELEMENTS[plan.base]} = {plan.element}")
    spaced = _spaced([*typed, *own])
    members += ["", *spaced] if members and spaced else spaced
    head = Nested(f"class {plan.name}(", bases, "):")
    yield UnitClassView(plan.name, head, _doc(protocol, unit, plan, kind), tuple(members))


def _spaced(members: Sequence[str]) -> tuple[str, ...]:
    """Return members of a class with empty lines between them."""
    return tuple(line for member in members for line in ("", member.rstrip("\n")))[1:]


def _doc(protocol: Protocol, unit: UnitPlan, plan: ClassPlan, kind: str) -> str:
    entry = unit.entry
    if plan.level != "device":
        first = _WHAT[plan.base].format(unit.name + kind)
        bays = paragraph(_bays(protocol, entry), 4) if plan.level == "bay" else ""
        return docstring(f"{first}\n\n    {bays}\n    " if bays else first)
    texts = [
        f"{unit.name}, {_place(protocol, entry)}. Its messages: {messages_from(protocol, entry)}",
        entry.get("note", ""),
        evidence_text(protocol, "units", unit.name),
    ]
    parts = [
        paragraph(sentence(entry["title"].rstrip(".") + kind), 4),
        *_example(protocol, unit, waits="await " if kind else ""),
        *(paragraph(sentence(text), 4) for text in texts if text),
    ]
    return docstring("\n\n    ".join(parts) + "\n    ")


def _example(protocol: Protocol, unit: UnitPlan, waits: str) -> Iterator[str]:
    """Yield the first lines of a program that moves a motor, to a position that every stage has.

    :param waits: the keyword before a call that waits; empty for threads.
    """
    calls = {part.name for plan in unit.classes for part in plan.parts}
    if not {"CanHome", "CanMoveAbsolute"} <= calls:
        return
    names = unit.entry.get("built_in") or unit.entry.get("stages", ())
    known = [s for s in protocol.stages if s.name in names and not _contradicting(s)]
    chosen = next((stage for stage in known if stage.catalogue), (*known, None)[0])
    option, target, position = "", "counts=1000", "position_counts"
    if chosen is not None:
        target, position = ("deg=1" if chosen.rotary else "mm=1"), "position"
        if "built_in" not in unit.entry:
            option = f", stage={literal(next(iter(chosen.catalogue), chosen.name))}"
    device = unit.name.lower()
    inner = [plan.level for plan in unit.classes if plan.level != "device"]
    part = ".".join((device, *(f"{level}(1)" for level in reversed(inner))))
    asynchronous = "async " if waits else ""
    # Documents require it before units that name channels by bits move.
    enabling = f"            {waits}{part}.enable()\n" if "channel_idents" in unit.entry else ""
    yield (
        f'::\n\n        {asynchronous}with {unit.name}.open("COM3"{option}) as {device}:\n'
        f"{enabling}            {waits}{part}.home()\n"
        f"            {waits}{part}.move_absolute({target})\n"
        f"            print({waits}{part}.{position})"
    )


def _contradicting(stage: Stage) -> bool:
    """Return whether sources contradict each other on a scale of a stage, so that one must be chosen."""
    return any(
        isinstance(scale, Conflict) for scales in stage.scales.values() for scale in scales.values()
    )


def _place(protocol: Protocol, entry: Json) -> str:
    return where(protocol, [entry["page"]], entry.get("overlay", ""))


def _bays(protocol: Protocol, entry: Json) -> str:
    """Return a sentence with the addresses of the bays of a rack, counted from 1 as in the document."""
    known = protocol.units.get("addresses", {}).get("bays")
    if not known:
        return ""
    count = entry.get("bays", known["last"] - known["first"] + 1)
    places = (f"bay {n + 1} is at 0x{known['first'] + n:02X}" for n in range(count))
    return sentence(", ".join(places))


class PartView(NamedTuple):
    """A mixin of device classes."""

    name: str
    doc: str
    methods: tuple[MethodView, ...]


class ModuleView(NamedTuple):
    """A module: its imports and its classes."""

    name: str
    imports: tuple[Import, ...]
    names: tuple[str, ...]
    classes: tuple[ValuesView, ...] | tuple[PartView, ...] | tuple[UnitClassView, ...]


class SideView(NamedTuple):
    """The classes for threads, or those for asyncio.

    :param package: ``devices`` or ``aio``.
    :param kind: words for docstrings: empty or ``" for asyncio"``.
    :param typed: whether classes have types of the values at the end of a motion.
    """

    package: str
    kind: str
    parts: tuple[ModuleView, ...]
    units: ModuleView
    typed: bool


class DevicesView(NamedTuple):
    """All views of device classes.

    :param names: the classes of the units.
    :param values_table: pairs of a message class and the class of its values.
    """

    names: tuple[str, ...]
    values: tuple[ModuleView, ...]
    values_table: tuple[str, ...]
    tables: tuple[Nested, ...]
    tables_imports: tuple[Import, ...]
    tables_names: tuple[str, ...]
    facts: FactsView
    facts_imports: tuple[Import, ...]
    sides: tuple[SideView, ...]


def devices_view(protocol: Protocol) -> DevicesView | None:
    """Make the view; return None for a protocol without units or a framing without sessions."""
    if not FRAMINGS[protocol.framing["kind"]].devices or not protocol.units.get("units"):
        return None
    plan = plan_of(protocol)
    parts, tables, package = parts_of(plan), TableWriter(plan), protocol.package
    values = _values(plan)
    every = [view for m in values for view in m.classes if isinstance(view, ValuesView)]
    statements = tables.tables()
    facts = facts_view(protocol, parts.units, tables)
    types = MotionTypes(plan, tables)
    made = _parts(protocol, parts, types)
    used = {
        chapter: names_in(method for view in views for method in view.methods)
        for chapter, views in made.items()
    }
    return DevicesView(
        names=tuple(unit.name for unit in parts.units),
        values=values,
        values_table=tuple(f"{view.message}: {view.name}" for view in every),
        tables=statements,
        tables_imports=tables_imports(package, statements),
        tables_names=tuple(call.constant for call in plan.calls),
        facts=facts,
        facts_imports=facts_imports(package, facts.statements),
        sides=(
            _side(protocol, parts, made, used, types, "devices", "", aio=False),
            _side(protocol, parts, made, used, types, "aio", " for asyncio", aio=True),
        ),
    )


def _values(plan: Plan) -> tuple[ModuleView, ...]:
    """Return the modules of values, one per chapter."""
    modules = []
    for chapter in plan.protocol.chapters:
        views = [
            values_view(plan.protocol, v) for v in plan.values if v.message.chapter == chapter.name
        ]
        if views:
            imports = values_imports(plan.protocol.package, views)
            names = tuple(view.name for view in views)
            modules.append(ModuleView(chapter.name, imports, names, tuple(views)))
    return tuple(modules)


def _parts(protocol: Protocol, parts: Parts, types: MotionTypes) -> dict[str, list[PartView]]:
    """Return the parts for threads by chapter, in the order of the document."""
    made: dict[str, list[PartView]] = {chapter.name: [] for chapter in protocol.chapters}
    for part in parts.parts:
        made[part.calls[0].message.chapter].append(_part(protocol, part, parts, types))
    return {chapter: views for chapter, views in made.items() if views}


def _side(
    protocol: Protocol,
    parts: Parts,
    made: Mapping[str, Sequence[PartView]],
    used: Mapping[str, Collection[str]],
    types: MotionTypes,
    package: str,
    kind: str,
    aio: bool,
) -> SideView:
    """Return the classes for threads, or for asyncio.

    :param made: the parts for threads by chapter.
    :param used: the names in their methods by chapter.
    """
    modules = []
    for chapter, views in made.items():
        imports = parts_imports(protocol.package, used[chapter], aio)
        names = tuple(view.name for view in views)
        classes = tuple(map(_asynchronous, views) if aio else views)
        modules.append(ModuleView(chapter, imports, names, classes))
    units = tuple(
        view for unit in parts.units for view in unit_class_views(protocol, unit, kind, types)
    )
    members = [member for view in units for member in view.members]
    typed = any("_reported" in member for member in members)
    tables = any("(t." in member for member in members)
    every = tuple(view.name for view in units if not view.name.startswith("_"))
    bases = {plan.base for unit in parts.units for plan in unit.classes}
    bases |= {"Stoppable" for unit in parts.units for plan in unit.classes if plan.stops}
    chapters = [m.name for m in modules]
    imports = units_imports(protocol.package, package, bases, chapters, aio, typed, tables)
    return SideView(
        package=package,
        kind=kind,
        parts=tuple(modules),
        units=ModuleView("units", imports, every, units),
        typed=typed,
    )


def _part(protocol: Protocol, part: Part, parts: Parts, types: MotionTypes) -> PartView:
    """Return the view of a part for threads."""
    methods = [
        method_view(protocol, call, verb, verb + parts.names[call.constant], types.of_end(call))
        for call in part.calls
        for verb in (part.verbs if call.kind == "set" else call.methods)
    ]
    methods += [
        view
        for call in part.calls
        for verb in (call.methods if "also" in call.message.call else ())
        for view in also_views(protocol, call, verb, types.of_end(call))
    ]
    for call in part.calls:
        methods += further_views(
            protocol, call, [*(part.verbs if call.kind == "set" else call.methods)]
        )
    return PartView(part.name, part_doc(protocol, part.calls[0]), tuple(methods))


def _asynchronous(part: PartView) -> PartView:
    """Return the view of a part for asyncio."""
    methods = [method for method in part.methods if not method.decorator.endswith(".setter")]
    return PartView(part.name, part.doc, tuple(map(asynchronous, methods)))
