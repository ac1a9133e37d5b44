"""Resolve evidence: the entries that it names, and the facts about stages that cite a source."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterable, Iterator
from fnmatch import translate
from typing import Any

from stagewire_generator.model import Message
from stagewire_generator.model_evidence import Evidence, EvidenceTable, Source
from stagewire_generator.model_scales import Conflict, Stage
from stagewire_generator.resolver.tables import Tables

_FILES = {
    **dict.fromkeys(
        ("parameter_sets", "commands", "setup_commands", "enumerations", "flags"),
        "messages",
    ),
    "quantities": "quantities",
    "units": "units",
    "lists": "units",
    "stages": "stages",
}
"""Section of an entry -> the kind of its files."""


def resolve_evidence(tables: Tables, stages: Iterable[Stage]) -> EvidenceTable:
    """Return the evidence of all entries; report paths that name nothing, and sources without a use."""
    sources: dict[str, Source] = {}
    for document, id, entry, place in tables.entries("evidence", "sources", sources):
        data = {key: value for key, value in entry.items() if key not in ("class", "cited_as")}
        cited_as = entry.get("cited_as", "")
        sources[id] = Source(id, entry["class"], data, cited_as, place, document.overlay)
    found: dict[tuple[str, str], list[Evidence]] = {}
    used: set[str] = set()
    seen: dict[str, None] = {}
    for document, slug, entry, _ in tables.entries("evidence", "evidence", seen):
        seen[slug] = None
        at = document.place("evidence", slug, "source")
        source = tables.look_up(sources, entry["source"], "source of evidence", at)
        if source is None:
            continue
        used.add(source.id)
        for index, path in enumerate(entry["facts"]):
            keys = [*_entries(tables, path)]
            if not keys and document.overlay == tables.top:  # it may withdraw entries below
                place = document.place("evidence", slug, "facts", index)
                what = f"{slug}: the registry has nothing that {path} names"
                tables.diagnostics.add(place, "SW049", what)
            part = path.split("/", 2)[2] if path.count("/") > 1 else ""
            for key in keys:
                found.setdefault(key, []).append(Evidence(source, part, entry["shows"]))
    table = EvidenceTable(tuple(sources[id] for id in sorted(sources)))
    for stage in stages:
        cited = {source.id: source for source in table.cited(*_texts(stage))}
        used |= cited.keys()
        for id in sorted(cited):
            shows = Evidence(cited[id], "", "scales, limits and ids that cite it")
            found.setdefault(("stages", stage.name), []).append(shows)
    for source in sources.values():
        if source.id not in used and source.overlay == tables.top:
            what = f"no evidence and no scale uses the source {source.id}"
            tables.diagnostics.add(source.place, "SW093", what)
    return EvidenceTable(table.sources, {key: tuple(entries) for key, entries in found.items()})


def _texts(stage: Stage) -> Iterator[str]:
    """Yield the source and the note of each scale and limit of a stage, and the source of each id."""
    for scales in stage.scales.values():
        for scale in scales.values():
            factors = [*scale.factors.values()] if isinstance(scale, Conflict) else [scale]
            for factor in factors:
                yield from () if isinstance(factor, str) else (factor.source, factor.note)
    for limit in stage.limits.values():
        yield from () if isinstance(limit, str) else (limit.source, limit.note)
    yield from (found.source for found in stage.ids.values())


def _entries(tables: Tables, path: str) -> Iterator[tuple[str, str]]:
    """Yield section and name of each resolved entry that a path names; those of a set are its messages."""
    section, pattern, *rest = path.split("/")
    matches = _matcher(pattern)
    if section == "messages":
        for name, message in tables.messages.items():
            if matches(name, message.aliases) and _has_form(message, rest):
                yield section, name
        return
    for document in tables.files.get(_FILES[section], ()):
        for name, entry in document.data.get(section, {}).items():
            if matches(name, entry.get("also_named", ())) and _has(entry, rest):
                if section != "parameter_sets":
                    yield _RESOLVED.get(section, section), name
                elif name in tables.sets:
                    members = (
                        tables.messages[member] for member in tables.sets[name].members.values()
                    )
                    form = rest if rest[:1] == ["layouts"] else []
                    yield from (("messages", m.name) for m in members if _has_form(m, form))


_RESOLVED = {"commands": "messages", "setup_commands": "messages"}


def _matcher(pattern: str) -> Callable[..., bool]:
    """Return a function that tells whether a name, or another one, matches an alternative of a pattern."""
    parts = pattern.split("|")
    named = frozenset(parts)
    wild = "|".join(translate(part) for part in parts if not part.isidentifier())
    like = re.compile(wild).match if wild else None

    def matches(name: str, others: Collection[str]) -> bool:
        if name in named or not named.isdisjoint(others):
            return True
        return like is not None and any(map(like, (name, *others)))

    return matches


def _has_form(message: Message, keys: list[str]) -> bool:
    """Return whether a message has the form that ``layouts/FORM`` names; no keys mean the whole message."""
    forms = [layout.form for layout in message.layouts]
    return not keys or (
        len(keys) == 2 and keys[0] == "layouts" and keys[1].replace("_", ":", 1) in forms
    )


def _has(entry: Any, keys: list[str]) -> bool:
    """Return whether an entry has a value at these keys."""
    for key in keys:
        if not isinstance(entry, dict) or key not in entry:
            return False
        entry = entry[key]
    return True
