"""What the modules of devices import: what their text names, and nothing else."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Sequence

from stagewire_generator.targets.python.devices.parts import MethodView
from stagewire_generator.targets.python.devices.tables_view import ValuesView
from stagewire_generator.targets.python.source import SUPPORT, imported

_ALIASES = {"e": "enumerations", "f": "flags", "m": "messages"}
_TABLES = ("Action", "Command", "Ends", "Given", "ParameterSet", "Poll", "Query", "Stored")
_FACTS = (
    *(
        "Alias",
        "ByCase",
        "BySetting",
        "ByStage",
        "ByUnit",
        "Facts",
        "Hindrance",
        "Poll",
        "Rule",
        "Setting",
    ),
    *("Scale", "Told", "Unit", "UnknownScale"),
)


def values_imports(package: str, views: Sequence[ValuesView]) -> tuple[str, ...]:
    """Return the imports of a module of values."""
    text = "\n".join(
        member for view in views for member in view.members if not member.startswith('"')
    )
    kinds = {kind for view in views for kind in view.kinds}
    return (
        imported(SUPPORT, ["Values", *kinds]),
        *_aliased(package, _names(text + "".join(view.message for view in views))),
    )


def tables_imports(package: str, statements: Sequence[str]) -> tuple[str, ...]:
    """Return the imports of the module of tables."""
    used = _names("\n".join(statements))
    named = ["DeviceCommand as Command" if n == "Command" else n for n in _TABLES if n in used]
    return (
        *([imported(SUPPORT, named)] if named else []),
        *_aliased(package, used),
        *([f"from {package}.devices import values as v"] if "v." in used else []),
    )


def facts_imports(package: str, text: str) -> tuple[str, ...]:
    """Return the imports of the module of facts."""
    used = _names(text)
    return (
        *(["from fractions import Fraction\n"] if " Fraction(" in text else []),
        *_imported(SUPPORT, _FACTS, used),
        *_aliased(package, used),
        *([f"from {package} import quantities"] if "quantities." in text else []),
        *([f"from {package}.devices import tables as t"] if "t." in used else []),
        f"from {package}.messages import PROTOCOL",
    )


def parts_imports(package: str, methods: Iterable[MethodView], aio: bool) -> tuple[str, ...]:
    """Return the imports of a module of parts."""
    used = _names("\n".join(f"{method.signature}\n{method.body}" for method in methods))
    motion = ["Motion"] if "Motion" in used else []
    more = [name for name in ("MotionEnd", "Number") if name in used]
    return (
        imported(SUPPORT, [*_bases(["Part", *motion], aio), *more]),
        *_aliased(package, used),
        f"from {package}.devices import tables as t",
        *([f"from {package}.devices import values as v"] if "v." in used else []),
    )


def units_imports(
    package: str, side: str, bases: Collection[str], chapters: Collection[str], aio: bool
) -> tuple[str, ...]:
    """Return the imports of the module of units."""
    parts = [imported(f"{package}.{side}.parts", list(chapters))] if chapters else []
    facts = imported(f"{package}.devices.facts", ["FACTS", "UNITS"])
    ours = [*parts, facts] if side < "devices" else [facts, *parts]
    return (imported(SUPPORT, _bases(bases, aio)), *ours)


def _bases(names: Iterable[str], aio: bool) -> list[str]:
    """Return what is imported of base classes: those for asyncio have names of their own there."""
    return [f"Async{name} as {name}" if aio else name for name in names]


def _imported(module: str, names: Iterable[str], used: Collection[str]) -> list[str]:
    found = [name for name in names if name in used]
    return [imported(module, found)] if found else []


def _aliased(package: str, used: Collection[str]) -> list[str]:
    return [
        f"from {package} import {module} as {alias}"
        for alias, module in _ALIASES.items()
        if f"{alias}." in used
    ]


def _names(text: str) -> set[str]:
    """Return the names in a text; one that a dotted name begins with also with its dot."""
    names: set[str] = set()
    for dotted in set(re.findall(r"[\w.]+", text)):
        first, *rest = dotted.split(".")
        names.update((first, *rest))
        if rest and rest[0]:
            names.add(f"{first}.")
    return names
