"""The files of a protocol with those of overlays laid over them.

An entry of an overlay whose name the protocol has replaces the whole entry, if the overlay says so in its
``overrides``; any other entry is added. What comes out are files again, so that they are resolved and
checked as those of a protocol without overlays are.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, TypeAlias

from stagewire_generator.diagnostics import Diagnostics, Place
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
    "examples": ("examples",),
    "captures": ("captures",),
}
"""Kind of a file of an overlay -> its sections of entries by name; each name of a section occurs once."""

_HEADS = {"overlay": "protocol"}  # what an overlay has in its head stands in that of the protocol
_LISTED = ("quantities", "stages", "messages", "errata", "rules")  # kinds whose files stay apart
_ONE = ("units", "examples", "captures")  # kinds of which a protocol has one file

Key: TypeAlias = tuple[str, str]  # section and name


def compose(base: Files, overlays: Sequence[Files], diagnostics: Diagnostics) -> Files | None:
    """Return the files of a protocol under overlays, in the order in which they are given.

    The witness is not among them: what a document prints is compared with what is registered from it.
    Returns None, with diagnostics, where an overlay replaces what it does not name, names what it does not
    replace, or defines what another one defines.
    """
    before = len(diagnostics.found)
    known = dict(_entries(base, "protocol"))
    defined: dict[Key, str] = {}
    for files in overlays:
        head = files["overlay"][0]
        own = dict(_entries(files, "overlay"))
        _check_overrides(head, own, known, diagnostics)
        for key, place in own.items():
            if key in defined:
                what = f"{key[0]}.{key[1]} would replace the entry of the overlay {defined[key]}"
                hint = "lay one of the two over, or write an overlay that says what holds"
                diagnostics.add(place, "SW060", what, hint)
            defined[key] = head.overlay
    if len(diagnostics.found) > before:
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
            return None  # each part may be right, and what they give together not
        composed[kind] = [_marked(kind, document, parts) for document in whole]
    return composed


def _entries(files: Files, head: str) -> Iterator[tuple[Key, Place]]:
    """Yield section and name of every entry, and where it stands.

    :param head: the kind of the file that has formats and contexts.
    """
    for kind, sections in SECTIONS.items():
        for document in files.get(head if kind in _HEADS else kind, ()):
            for section in sections:
                for name in document.data.get(section, ()):
                    yield (section, name), document.place(section, name)


def _check_overrides(
    head: Document, own: Mapping[Key, Place], known: Collection[Key], diagnostics: Diagnostics
) -> None:
    """Check that what replaces is listed as replacing, and the reverse; a slip must not add an entry."""
    listed = {
        (section, name): head.place("overrides", section, index)
        for section, names in head.data.get("overrides", {}).items()
        for index, name in enumerate(names)
    }
    for key, place in own.items():
        if key in known and key not in listed:
            what = f"{key[0]}.{key[1]} would replace the entry of the protocol"
            diagnostics.add(place, "SW060", what)
    for key, place in listed.items():
        if key not in own:
            diagnostics.add(place, "SW061", f"{key[0]}.{key[1]} is not in the overlay")
        elif key not in known:
            diagnostics.add(place, "SW061", f"{key[0]}.{key[1]} is not in the protocol")


def _head(head: Document, overlays: Sequence[Document]) -> Document:
    """Return the file of the protocol with the formats, contexts and groups of overlays."""
    data = dict(head.data)
    for document in overlays:
        for section in SECTIONS["overlay"]:
            if section in document.data:
                data[section] = {**data.get(section, {}), **document.data[section]}
        new = [
            name for name in document.data.get("groups", ()) if name not in data.get("groups", ())
        ]
        if new:
            data["groups"] = [*data.get("groups", ()), *new]
    return replace(head, data=data)


def _without(document: Document, kind: str, replaced: Collection[Key]) -> Document:
    """Return a file of the protocol without the entries that an overlay replaces."""
    data = dict(document.data)
    for section in SECTIONS[kind]:
        if section in data:
            kept = {n: e for n, e in data[section].items() if (section, n) not in replaced}
            data[section] = kept
    return replace(document, data=data)


def _merged(kind: str, document: Document, parts: Sequence[Document]) -> Document:
    """Return the only file of a kind with the entries of overlays in it, each with its own place."""
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
    """Return the file with the name of its overlay in every entry that comes from one."""
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
