"""Names: references that point nowhere, and names that generated code cannot keep apart."""

from __future__ import annotations

import keyword
from collections.abc import Iterable

from stagewire_generator.diagnostics import Diagnostics, Place
from stagewire_generator.model import Message, Protocol

__all__ = ["RESERVED", "check_names"]

# What generated classes, or the languages they are written in, keep for themselves.
_C_KEYWORDS = frozenset(
    [
        "auto",
        "break",
        "case",
        "char",
        "const",
        "continue",
        "default",
        "do",
        "double",
        "else",
        "enum",
        "extern",
        "float",
        "for",
        "goto",
        "if",
        "inline",
        "int",
        "long",
        "register",
        "restrict",
        "return",
        "short",
        "signed",
        "sizeof",
        "static",
        "struct",
        "switch",
        "typedef",
        "union",
        "unsigned",
        "void",
        "volatile",
        "while",
        "bool",
        "true",
        "false",
        "class",
        "namespace",
        "template",
        "this",
        "new",
        "delete",
        "operator",
        "private",
        "public",
        "protected",
        "virtual",
        "friend",
        "using",
        "try",
        "catch",
        "throw",
        "typename",
        "explicit",
        "mutable",
    ]
)
_MEMBERS = frozenset(
    [
        "layout",
        "unpack",
        "pack",
        "values",
        "replace",
        "keep",
        "shared",
        "mro",
        "data",
        "param1",
        "param2",
    ]
)
RESERVED = _C_KEYWORDS | frozenset(keyword.kwlist) | frozenset({"self", "cls", "raw", "draft"})


def check_names(protocol: Protocol, diagnostics: Diagnostics) -> None:
    """Check every name of the protocol."""
    _fields(protocol, diagnostics)
    _classes(protocol, diagnostics)
    _exchanges(protocol, diagnostics)
    _units(protocol, diagnostics)


def _fields(protocol: Protocol, diagnostics: Diagnostics) -> None:
    for message in protocol.messages:
        for layout in message.layouts:
            seen: dict[str, str] = {}
            for field in layout.all_fields:
                unnamed = field.role == "constant" and field.name in ("param1", "param2")
                if (field.name in RESERVED or field.name in _MEMBERS) and not unnamed:
                    diagnostics.add(field.place, "SW023", f"{message.name}: the field {field.name}")
                folded = field.name.replace("_", "").lower()
                if folded in seen:
                    diagnostics.add(
                        field.place, "SW022", f"{message.name}: {field.name} and {seen[folded]}"
                    )
                seen[folded] = field.name
    for enumeration in protocol.enumerations:
        names = [value.name for value in enumeration.values]
        _distinct(names, f"the values of {enumeration.name}", enumeration.place, diagnostics)
        for name in names:
            if name in RESERVED or name == "mro":
                diagnostics.add(enumeration.place, "SW023", f"{enumeration.name}: the value {name}")
    for table in protocol.flags:
        names = [bit.name for bit in table.bits]
        _distinct(names, f"the bits of {table.name}", table.place, diagnostics)
        for name in names:
            if name in RESERVED or hasattr(int, name) or name in ("bits", "of", "names", "unnamed"):
                diagnostics.add(table.place, "SW023", f"{table.name}: the bit {name}")


def _distinct(names: Iterable[str], what: str, place: Place, diagnostics: Diagnostics) -> None:
    seen: dict[str, str] = {}
    for name in names:
        folded = name.replace("_", "").lower()
        if folded in seen:
            diagnostics.add(place, "SW022", f"{what}: {name} and {seen[folded]}")
        seen[folded] = name


def _classes(protocol: Protocol, diagnostics: Diagnostics) -> None:
    """Names that become classes must differ even where a file system or a language folds case."""
    seen: dict[str, str] = {}
    for name, place in (
        *((m.name, m.place) for m in protocol.messages),
        *((e.name, e.place) for e in protocol.enumerations),
        *((t.name, t.place) for t in protocol.flags),
    ):
        folded = name.replace("_", "").lower()
        if folded in seen and seen[folded] != name:
            diagnostics.add(place, "SW022", f"{name} and {seen[folded]}")
        seen[folded] = name
    stages: dict[str, str] = {}
    for stage in protocol.stages:
        folded = stage.name.lower()
        if folded in stages:
            diagnostics.add(stage.place, "SW022", f"{stage.name} and {stages[folded]}")
        stages[folded] = stage.name


def _exchanges(protocol: Protocol, diagnostics: Diagnostics) -> None:
    names = {message.name: message for message in protocol.messages}
    for message in protocol.messages:
        for key, value in message.exchange.items():
            if not isinstance(value, list):
                continue
            for name in value:
                other = names.get(name)
                if other is None:
                    diagnostics.add(
                        message.place, "SW021", f"{message.name}: {key} names no message {name}"
                    )
                elif key in _TO_HOST and other.direction == "to_controller":
                    diagnostics.add(
                        message.place,
                        "SW035",
                        f"{message.name}: {key} {name}, which only the host sends",
                    )


_TO_HOST = frozenset({"answered_by", "completes_with", "stops_with", "announces"})


def _units(protocol: Protocol, diagnostics: Diagnostics) -> None:
    messages = {message.name for message in protocol.messages}
    stages = {stage.name for stage in protocol.stages}
    data = protocol.units
    place = Place(f"{protocol.name}/units.yaml")
    lists = data.get("lists", {})
    families = data.get("families", {})
    for key, entry in lists.items():
        named = [*entry["messages"], *entry.get("completes", []), *entry.get("misprinted", {})]
        _known(named, messages, f"list {key}", "message", place, diagnostics)
    for key, entry in families.items():
        if isinstance(entry.get("messages"), list):
            _known(entry["messages"], messages, f"family {key}", "message", place, diagnostics)
    for key, entry in data.get("units", {}).items():
        _known(entry.get("stages", []), stages, f"unit {key}", "stage", place, diagnostics)
        _known([entry["family"]], set(families), f"unit {key}", "family", place, diagnostics)
        if "list" in entry:
            _known([entry["list"]], set(lists), f"unit {key}", "list", place, diagnostics)
        keeper = entry.get("keep_alive", "none")
        if keeper != "none":
            _known([keeper], messages, f"unit {key}", "message", place, diagnostics)


def _known(
    names: Iterable[str],
    known: set[str],
    where: str,
    kind: str,
    place: Place,
    diagnostics: Diagnostics,
) -> None:
    for name in names:
        if name not in known:
            diagnostics.add(place, "SW021", f"{where}: no {kind} is named {name}")


def message_classes(message: Message) -> dict[str, str]:
    """Return form -> class name of a message.

    The layout with the plain form ``data``, or the only layout, takes the plain name; the others
    append their form.
    """
    forms = [layout.form for layout in message.layouts]
    plain = forms[0] if len(forms) == 1 else "data"
    names = {}
    for form in forms:
        suffix = "" if form == plain else form.removeprefix("data:").capitalize()
        names[form] = message.class_name + suffix
    return names
