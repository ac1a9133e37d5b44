"""Merge the files of overlays into those of a protocol.

First the protocol is revised: entries are renamed and withdrawn, and others are added to (``additions.py``).
Then an entry of an overlay replaces the whole entry of the protocol with the same name, if the overlay lists
it in its ``overrides``. All other entries are new. The result is again a set of files, which is resolved and
checked like a protocol without overlays.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import Any

from stagewire_generator.diagnostics import Diagnostics, Place
from stagewire_generator.overlays.additions import added, member, revise
from stagewire_generator.overlays.register import ONE_OF_THEM, Home, Key, Register, resembling
from stagewire_generator.reader import Files
from stagewire_generator.schemas import fits_schema
from stagewire_generator.strict_yaml import Document

SECTIONS: dict[str, tuple[str, ...]] = {
    "overlay": ("formats", "contexts"),
    "quantities": ("settings", "quantities"),
    "stages": ("controllers", "stages"),
    "units": (
        "families",
        "units",
        "lists",
        "addresses",
        "aliases",
        "known_prefixes",
        "unsupported",
        "hardware_types",
    ),
    "messages": (
        "enumerations",
        "flags",
        "blocks",
        "parameter_sets",
        "setup_commands",
        "commands",
        "messages",
    ),
    "errata": ("errata",),
    "rules": ("rules",),
    "evidence": ("sources", "evidence"),
    "examples": ("examples",),
    "captures": ("captures",),
}
"""Kind of file -> its sections of named entries; a name is unique in a section."""

_HEADS = {"overlay": "protocol"}  # sections of overlay.yaml are merged into protocol.yaml
_LISTED = (
    "quantities",
    "stages",
    "messages",
    "errata",
    "rules",
    "evidence",
)  # kinds whose files stay separate
_ONE = ("units", "examples", "captures")  # kinds with one file per protocol


def compose(
    base: Files,
    overlays: Sequence[Files],
    diagnostics: Diagnostics,
    others: Mapping[Key, str] = MappingProxyType({}),
) -> Files | None:
    """Return the files of a protocol with overlays applied in the given order.

    The witness is left out, because a document is only compared with the entries transcribed from it. Returns
    None, with diagnostics, if an overlay replaces an entry that it does not list, lists an entry that it does
    not replace, names an entry that does not exist, or defines or adds to an entry that another overlay
    defines.

    :param others: entry -> the overlay that defines it, for hints.
    """
    before = diagnostics.reported
    applied = {files["overlay"][0].overlay for files in overlays}
    others = {key: name for key, name in others.items() if name not in applied}
    gone: dict[Key, str] = {}
    for files in overlays:
        name = files["overlay"][0].overlay
        register = Register(name, _homes(base), _members(base), gone, others)
        base = revise(base, files, register, diagnostics)
    homes, members = _homes(base), _members(base)
    defined: dict[Key, str] = {}
    for files in overlays:
        head = files["overlay"][0]
        own = dict(entries_of(files))
        register = Register(head.overlay, homes, members, gone, others)
        _check_overrides(head, own, register, diagnostics)
        for key, place in own.items():
            if key in defined:
                what = f"{key[0]}.{key[1]} would replace the entry of the overlay {defined[key]}"
                diagnostics.add(place, "SW060", what, f"choose another name, or {ONE_OF_THEM}")
            defined[key] = head.overlay
    for files in overlays:
        _check_additions(files, defined, diagnostics)
    if diagnostics.reported > before:
        return None
    composed: Files = {"overlay": [files["overlay"][0] for files in overlays]}
    composed["protocol"] = [_head(base["protocol"][0], composed["overlay"])]
    for kind in _LISTED:
        kept = [_without(document, kind, defined) for document in base.get(kind, ())]
        composed[kind] = kept + [document for files in overlays for document in files.get(kind, ())]
    for kind in _ONE:
        parts = [document for files in overlays for document in files.get(kind, ())]
        whole = [_merged(kind, document, parts) for document in base.get(kind, parts)[:1]]
        if kind == "units" and parts and not fits_schema(whole[0], kind, diagnostics):
            return None  # parts that are valid on their own may be invalid together
        composed[kind] = [_marked(kind, document, parts) for document in whole]
    return composed


def _homes(files: Files) -> dict[Key, Home]:
    """Return where each entry of a protocol is defined."""
    return {
        (section, name): (_HEADS.get(kind, kind), number)
        for kind, sections in SECTIONS.items()
        for number, document in enumerate(files.get(_HEADS.get(kind, kind), ()))
        for section in sections
        for name in document.data.get(section, ())
    }


def _members(files: Files) -> dict[str, tuple[str, ...]]:
    """Return the messages of each parameter set of a protocol."""
    groups = files["protocol"][0].data.get("groups", ())
    return {
        name: tuple(member(name, role.upper(), groups) for role in entry["ids"])
        for document in files.get("messages", ())
        for name, entry in document.data.get("parameter_sets", {}).items()
    }


def entries_of(files: Files) -> Iterator[tuple[Key, Place]]:
    """Yield the section, name and position of every entry that an overlay defines."""
    for kind, sections in SECTIONS.items():
        for document in files.get(kind, ()):
            for section in sections:
                for name in document.data.get(section, ()):
                    yield (section, name), document.place(section, name)


def _check_overrides(
    head: Document, own: Mapping[Key, Place], register: Register, diagnostics: Diagnostics
) -> None:
    """Check that exactly the replaced entries are listed in ``overrides``."""
    listed = {
        (section, name): head.place("overrides", section, index)
        for section, names in head.data.get("overrides", {}).items()
        for index, name in enumerate(names)
    }
    for key, place in own.items():
        if key in register.homes and key not in listed:
            what = f"{key[0]}.{key[1]} would replace the entry of the protocol"
            diagnostics.add(place, "SW060", what)
    for key, place in listed.items():
        if key not in own:
            what = f"the overlay does not define {key[0]}.{key[1]}"
            hint = resembling(key, own) or "define it, or remove it from `overrides`"
            diagnostics.add(place, "SW061", what, hint)
        else:
            register.has(key, place, diagnostics, "if it is new, remove it from `overrides`")


def _check_additions(files: Files, defined: Mapping[Key, str], diagnostics: Diagnostics) -> None:
    """Check that no overlay replaces an entry that this one adds to: the additions would be lost."""
    overridden = files["overlay"][0].data.get("overrides", {})
    for document in files.get("additions", ()):
        for key, place in added(document):
            by = defined.get(key)
            if by == document.overlay:
                if key[1] not in overridden.get(key[0], ()):
                    continue  # not allowed to replace it, which is another error
                what = f"{key[0]}.{key[1]}: the overlay also replaces this entry"
                diagnostics.add(place, "SW063", what, "write the addition into the new entry")
            elif by is not None:
                what = (
                    f"{key[0]}.{key[1]}: the overlay {by} replaces the entry that this would add to"
                )
                diagnostics.add(place, "SW060", what, ONE_OF_THEM)


def _head(head: Document, overlays: Sequence[Document]) -> Document:
    """Return the file of the protocol with the formats, contexts and groups of overlays added."""
    data, places = dict(head.data), dict(head.places)
    for document in overlays:
        for section in SECTIONS["overlay"]:
            if section in document.data:
                data[section] = {**data.get(section, {}), **document.data[section]}
                own = {(section, name) for name in document.data[section]}
                places |= {path: at for path, at in document.places.items() if path[:2] in own}
        new = [
            name for name in document.data.get("groups", ()) if name not in data.get("groups", ())
        ]
        if new:
            data["groups"] = [*data.get("groups", ()), *new]
    return replace(head, data=data, places=places)


def _without(document: Document, kind: str, replaced: Collection[Key]) -> Document:
    """Return a file of the protocol without the entries that an overlay replaces."""
    data = dict(document.data)
    for section in SECTIONS[kind]:
        if section in data:
            kept = {n: e for n, e in data[section].items() if (section, n) not in replaced}
            data[section] = kept
    return replace(document, data=data)


def _merged(kind: str, document: Document, parts: Sequence[Document]) -> Document:
    """Return the only file of a kind with the entries of overlays added, each with its own position."""
    data, places = dict(document.data), dict(document.places)
    for part in parts:
        if part is document:
            continue
        for section in SECTIONS[kind]:
            entries = part.data.get(section, {})
            if entries:
                data[section] = {**data.get(section, {}), **entries}
            named = {(section, name) for name in entries}
            places |= {path: at for path, at in part.places.items() if path[:2] in named}
    return replace(document, data=data, places=places, overlay="")


def _marked(kind: str, document: Document, parts: Sequence[Document]) -> Document:
    """Return the file with the name of the overlay in every entry that an overlay defines."""
    data: dict[str, Any] = dict(document.data)
    for part in parts:
        for section in SECTIONS[kind]:
            marked = {
                name: {**entry, "overlay": part.overlay}
                for name, entry in part.data.get(section, {}).items()
            }
            if marked:
                data[section] = {**data[section], **marked}
    return replace(document, data=data)
