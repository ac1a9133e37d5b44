"""Merge the files of an overlay into those of a protocol, or of a protocol with other overlays.

First the entries below are revised: some are renamed and withdrawn, and others are added to
(``additions.py``). Then an entry of the overlay replaces the whole entry of the same name below, if the
overlay lists it in its ``overrides``. All other entries are new. The result is again a set of files, on which
the next overlay can be laid, and which is resolved and checked like a protocol without overlays.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType

from stagewire_generator.diagnostics import Diagnostics, Place
from stagewire_generator.overlays.additions import added, member, revise
from stagewire_generator.overlays.register import (
    ONE_OF_THEM,
    Gone,
    Home,
    Key,
    Register,
    owner,
    replaced,
    resembling,
)
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


@dataclass(frozen=True, slots=True)
class Composition:
    """A protocol with overlays, on which another overlay can be laid.

    :param below: the files of the protocol with the overlays merged into them.
    :param gone: the entries that overlays withdrew or renamed.
    :param added: entry -> overlays that add to it, each with the position.
    """

    below: Files
    gone: Mapping[Key, Gone] = field(default_factory=dict)
    added: Mapping[Key, Mapping[str, Place]] = field(default_factory=dict)

    @property
    def overlays(self) -> tuple[str, ...]:
        """The names of the overlays, in the order in which they were applied."""
        return tuple(head.overlay for head in self.below.get("overlay", ()))

    @property
    def files(self) -> Files:
        """The files, in which each entry of an overlay names it."""
        return {
            kind: [_marked(kind, document) if kind in _ONE else document for document in documents]
            for kind, documents in self.below.items()
        }


def compose(
    under: Composition,
    overlay: Files,
    diagnostics: Diagnostics,
    builds_on: Collection[str] = (),
    others: Mapping[Key, str] = MappingProxyType({}),
) -> Composition | None:
    """Return a protocol with one more overlay, which is applied after those that it already has.

    The witness is left out, because a document is only compared with the entries transcribed from it.
    Returns None, with diagnostics, if the overlay replaces an entry that it does not list, lists an entry
    that it does not replace, names an entry that does not exist, or changes one of an overlay below that it
    does not build on.

    :param builds_on: the overlays whose entries it may change as it may change those of the protocol.
    :param others: entry -> the overlay that defines it, for hints.
    """
    before = diagnostics.reported
    [head] = overlay["overlay"]
    mine = {"", head.overlay, *builds_on}
    applied = under.overlays
    others = {key: name for key, name in others.items() if name not in (*applied, head.overlay)}

    def register_of(files: Files) -> Register:
        members = _members(files)
        return Register(head.overlay, applied, mine, _homes(files), members, gone, others)

    gone = dict(under.gone)
    below = revise(under.below, overlay, register_of(under.below), diagnostics)
    register = register_of(below)
    own = dict(entries_of(overlay))
    _check_overrides(head, own, register, diagnostics)
    _check_additions(overlay, own, diagnostics)
    for key in own.keys() & under.added.keys() & register.homes.keys():
        for name, place in under.added[key].items():
            if name not in mine:
                diagnostics.add(place, "SW060", *replaced(key, head.overlay, "add to"))
    if diagnostics.reported > before:
        return None
    composed: Files = {"overlay": [*below.get("overlay", ()), head]}
    composed["protocol"] = [_head(below["protocol"][0], head)]
    for kind in _LISTED:
        kept = [_without(document, kind, own) for document in below.get(kind, ())]
        composed[kind] = [*kept, *overlay.get(kind, ())]
    for kind in _ONE:
        parts = overlay.get(kind, [])
        whole = [_merged(kind, document, parts) for document in below.get(kind, parts)[:1]]
        if kind == "units" and parts and not fits_schema(whole[0], kind, diagnostics):
            return None  # parts that are valid on their own may be invalid together
        composed[kind] = whole
    additions = {key: dict(found) for key, found in under.added.items() if key not in own}
    for document in overlay.get("additions", ()):
        for key, place in added(document):
            additions.setdefault(key, {})[head.overlay] = place
    return Composition(composed, gone, additions)


def _homes(files: Files) -> dict[Key, Home]:
    """Return where each entry is defined."""
    return {
        (section, name): Home(_HEADS.get(kind, kind), number, document.overlay_of(section, name))
        for kind, sections in SECTIONS.items()
        for number, document in enumerate(files.get(_HEADS.get(kind, kind), ()))
        for section in sections
        for name in document.data.get(section, ())
    }


def _members(files: Files) -> dict[str, tuple[str, ...]]:
    """Return the messages of each parameter set."""
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
        if key in register.homes:
            stranger = register.stranger(key)
            what = f"{key[0]}.{key[1]} would replace the entry of "
            if stranger:
                hint = f"choose another name, or {ONE_OF_THEM}"
                diagnostics.add(place, "SW060", what + owner(stranger), hint)
            elif key not in listed:
                diagnostics.add(place, "SW060", what + owner(register.homes[key].overlay))
    for key, place in listed.items():
        if key not in own:
            what = f"the overlay does not define {key[0]}.{key[1]}"
            hint = resembling(key, own) or "define it, or remove it from `overrides`"
            diagnostics.add(place, "SW061", what, hint)
        else:
            register.has(key, place, diagnostics, "if it is new, remove it from `overrides`")


def _check_additions(overlay: Files, own: Collection[Key], diagnostics: Diagnostics) -> None:
    """Check that the overlay does not replace an entry that it adds to: the additions would be lost."""
    overridden = overlay["overlay"][0].data.get("overrides", {})
    for document in overlay.get("additions", ()):
        for key, place in added(document):
            if key in own and key[1] in overridden.get(key[0], ()):  # else it may not replace it
                what = f"{key[0]}.{key[1]}: the overlay also replaces this entry"
                diagnostics.add(place, "SW063", what, "write the addition into the new entry")


def _head(head: Document, overlay: Document) -> Document:
    """Return the file of the protocol with the formats, contexts and groups of an overlay added."""
    whole = _merged("overlay", head, [overlay])
    known = head.data.get("groups", ())
    new = [name for name in overlay.data.get("groups", ()) if name not in known]
    return replace(whole, data={**whole.data, "groups": [*known, *new]}) if new else whole


def _without(document: Document, kind: str, replaced: Collection[Key]) -> Document:
    """Return a file without the entries that an overlay replaces."""
    data = dict(document.data)
    for section in SECTIONS[kind]:
        if section in data:
            kept = {n: e for n, e in data[section].items() if (section, n) not in replaced}
            data[section] = kept
    return replace(document, data=data)


def _merged(kind: str, document: Document, parts: Collection[Document]) -> Document:
    """Return the only file of a kind with the entries of an overlay added, each with its own position."""
    data, places, sources = dict(document.data), dict(document.places), dict(document.sources)
    if document.overlay:
        sources[document.name] = document.overlay
    for part in parts:
        sources[part.name] = part.overlay
        if part is document:
            continue
        for section in SECTIONS[kind]:
            entries = part.data.get(section, {})
            if entries:
                data[section] = {**data.get(section, {}), **entries}
            named = {(section, name) for name in entries}
            places |= {path: at for path, at in part.places.items() if path[:2] in named}
    return replace(document, data=data, places=places, overlay="", sources=sources)


def _marked(kind: str, document: Document) -> Document:
    """Return the file with the name of the overlay in every entry that an overlay defines."""
    data = dict(document.data)
    for section in SECTIONS[kind]:
        if section in data:
            data[section] = {
                name: {**entry, "overlay": overlay} if overlay else entry
                for name, entry in data[section].items()
                for overlay in [document.overlay_of(section, name)]
            }
    return replace(document, data=data)
