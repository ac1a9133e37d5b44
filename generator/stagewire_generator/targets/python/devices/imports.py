"""The imports of the modules of devices: exactly the names that the source uses."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Sequence

from stagewire_generator.targets.python.brackets import Import, Nested, Source, flat
from stagewire_generator.targets.python.devices.parts import MethodView
from stagewire_generator.targets.python.devices.tables_view import ValuesView
from stagewire_generator.targets.python.source import SUPPORT

_LITERAL = re.compile(r"""(["'])(?:\\.|(?!\1).)*\1""")
_ALIASES = {"e": "enumerations", "f": "flags", "m": "messages"}
_TABLES = ("Action", "Command", "Ends", "Given", "ParameterSet", "Poll", "Query", "Stored")
_FACTS = (
    *(
        "Alias",
        "ByCase",
        "BySetting",
        "ByStage",
        "ByUnit",
        "Enabling",
        "Facts",
        "Hindrance",
        "Need",
        "Order",
        "Poll",
        "Positions",
        "Rule",
        "Setting",
    ),
    *("Scale", "StageReport", "Told", "Unit", "UnknownScale", "Unsupported"),
)


def values_imports(package: str, views: Sequence[ValuesView]) -> tuple[Import, ...]:
    """Return the imports of a module of values."""
    used = _names(
        [
            *(member.made for view in views for member in view.members),
            *(view.message for view in views),
        ]
    )
    kinds = {kind for view in views for kind in view.kinds}
    return (Import(SUPPORT, ("Values", *kinds)), *_aliased(package, used))


def tables_imports(package: str, statements: Sequence[Nested]) -> tuple[Import, ...]:
    """Return the imports of the module of tables."""
    used = _names(statements)
    named = ["DeviceCommand as Command" if n == "Command" else n for n in _TABLES if n in used]
    return (
        *([Import(SUPPORT, tuple(named))] if named else []),
        *_aliased(package, used),
        *([Import(f"{package}.devices", ("values as v",))] if "v." in used else []),
    )


def facts_imports(package: str, statements: Sequence[Nested]) -> tuple[Import, ...]:
    """Return the imports of the module of facts."""
    used = _names(statements)
    return (
        *_imported("fractions", ("Fraction",), used),
        *_imported(SUPPORT, _FACTS, used),
        *_aliased(package, used),
        *([Import(package, ("quantities",))] if "quantities." in used else []),
        *([Import(f"{package}.devices", ("tables as t",))] if "t." in used else []),
        Import(f"{package}.messages", ("PROTOCOL",)),
    )


def names_in(methods: Iterable[MethodView]) -> set[str]:
    """Return the names in the source of methods, which are the same for threads and for asyncio."""
    return _names([source for method in methods for source in (method.signature, method.body)])


def parts_imports(package: str, used: Collection[str], aio: bool) -> tuple[Import, ...]:
    """Return the imports of a module of parts.

    :param used: the names in its methods.
    """
    motion = [name for name in ("Motion", "Mover") if name in used]
    more = [name for name in ("MotionEnd", "Number", "Reported") if name in used]
    return (
        Import(SUPPORT, (*_bases(["Part", *motion], aio), *more)),
        *_aliased(package, used),
        Import(f"{package}.devices", ("tables as t",)),
        *([Import(f"{package}.devices", ("values as v",))] if "v." in used else []),
    )


def units_imports(
    package: str,
    side: str,
    bases: Collection[str],
    chapters: Collection[str],
    aio: bool,
    typed: bool,
    tables: bool,
) -> tuple[Import, ...]:
    """Return the imports of the module of units.

    :param typed: whether classes have types of the values at the end of a motion.
    :param tables: whether they use the tables of calls.
    """
    parts = [Import(f"{package}.{side}.parts", tuple(chapters))] if chapters else []
    facts = Import(f"{package}.devices.facts", ("FACTS", "UNITS"))
    ours = [*parts, facts] if side < "devices" else [facts, *parts]
    if tables:
        ours.insert(int(side < "devices"), Import(f"{package}.devices", ("tables as t",)))
    if typed:
        ours.insert(
            int(tables) + (side < "devices"), Import(f"{package}.devices", ("values as v",))
        )
    return (Import(SUPPORT, tuple(_bases(bases, aio))), *ours)


def _bases(names: Iterable[str], aio: bool) -> list[str]:
    """Return the imports of base classes; those for asyncio have other names in the runtime."""
    return [f"Async{name} as {name}" if aio else name for name in names]


def _imported(module: str, names: Iterable[str], used: Collection[str]) -> list[Import]:
    found = tuple(name for name in names if name in used)
    return [Import(module, found)] if found else []


def _aliased(package: str, used: Collection[str]) -> list[Import]:
    return [
        Import(package, (f"{module} as {alias}",))
        for alias, module in _ALIASES.items()
        if f"{alias}." in used
    ]


def _names(sources: Iterable[Source]) -> set[str]:
    """Return the names in source; the first part of a dotted name is also included with its dot."""
    names: set[str] = set()
    text = _LITERAL.sub("", "\n".join(map(flat, sources)))
    for dotted in set(re.findall(r"[\w.]+", text)):
        first, *rest = dotted.split(".")
        names.update((first, *rest))
        if rest and rest[0]:
            names.add(f"{first}.")
    return names
