"""What the modules of devices import: what their text names, and nothing else."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Sequence

from stagewire_generator.targets.python.devices.methods_view import MethodView
from stagewire_generator.targets.python.devices.values_view import ValuesView
from stagewire_generator.targets.python.source import imported

__all__ = ["facts_imports", "parts_imports", "tables_imports", "units_imports", "values_imports"]

_ALIASES = {"e": "enumerations", "f": "flags", "m": "messages"}
_TABLES = ("Action", "Command", "Ends", "Given", "ParameterSet", "Poll", "Query", "Stored")
_SCALES = ("ByCase", "BySetting", "ByStage", "ByUnit", "Rule")
_UNIT = ("Alias", "Facts", "Hindrance", "Setting", "Told", "Unit")


def values_imports(package: str, views: Sequence[ValuesView]) -> tuple[str, ...]:
    """Return the imports of a module of values."""
    text = "\n".join(
        member for view in views for member in view.members if not member.startswith('"')
    )
    kinds = {kind for view in views for kind in view.kinds}
    return (
        imported("stagewire.devices.values", ["Values", *kinds]),
        *_aliased(package, text + "".join(view.message for view in views)),
    )


def tables_imports(package: str, statements: Sequence[str]) -> tuple[str, ...]:
    """Return the imports of the module of tables."""
    text = "\n".join(statements)
    return (
        *_imported("stagewire.devices.tables", _TABLES, text),
        *_aliased(package, text),
        *([f"from {package}.devices import values as v"] if _uses("v", text) else []),
    )


def facts_imports(package: str, text: str) -> tuple[str, ...]:
    """Return the imports of the module of facts."""
    return (
        *(["from fractions import Fraction\n"] if " Fraction(" in text else []),
        *_imported("stagewire.devices.scales", _SCALES, text),
        *_imported("stagewire.devices.tables", ("Poll",), text),
        *_imported("stagewire.devices.unit", _UNIT, text),
        *_imported("stagewire.quantities", ("Scale", "UnknownScale"), text),
        *_aliased(package, text),
        *([f"from {package} import quantities"] if "quantities." in text else []),
        *([f"from {package}.devices import tables as t"] if _uses("t", text) else []),
        f"from {package}.messages import PROTOCOL",
    )


def parts_imports(package: str, methods: Iterable[MethodView], aio: bool) -> tuple[str, ...]:
    """Return the imports of a module of parts."""
    text = "\n".join(f"{method.signature}\n{method.body}" for method in methods)
    return (
        *_imported(_bases(aio), ("Motion",), text, "Part"),
        *_imported("stagewire.devices.tables", ("MotionEnd",), text),
        *_imported("stagewire.quantities", ("Number",), text),
        *_aliased(package, text),
        f"from {package}.devices import tables as t",
        *([f"from {package}.devices import values as v"] if _uses("v", text) else []),
    )


def units_imports(
    package: str, side: str, bases: Collection[str], chapters: Collection[str], aio: bool
) -> tuple[str, ...]:
    """Return the imports of the module of units."""
    parts = [imported(f"{package}.{side}.parts", list(chapters))] if chapters else []
    facts = imported(f"{package}.devices.facts", ["FACTS", "UNITS"])
    ours = [*parts, facts] if side < "devices" else [facts, *parts]
    return (imported(_bases(aio), list(bases)), *ours)


def _bases(aio: bool) -> str:
    return f"stagewire.devices.{'asynchronous' if aio else 'synchronous'}"


def _imported(module: str, names: Iterable[str], text: str, *always: str) -> list[str]:
    found = [*always, *(name for name in names if re.search(rf"\b{name}\b", text))]
    return [imported(module, found)] if found else []


def _aliased(package: str, text: str) -> list[str]:
    return [
        f"from {package} import {module} as {alias}"
        for alias, module in _ALIASES.items()
        if _uses(alias, text)
    ]


def _uses(alias: str, text: str) -> bool:
    return re.search(rf"(?<![\w.]){alias}\.\w", text) is not None
