"""Add to the entries of a registry the documents of their pages, and their evidence."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
from typing import Any, TypeAlias

from stagewire_generator.model import Json, Protocol
from stagewire_generator.model_evidence import Evidence, EvidenceTable

_NESTED = frozenset({dict, list})
ClassesOf: TypeAlias = Callable[..., tuple[str, ...]]
"""Returns the classes of the sources that texts cite."""


def with_documents(protocol: Protocol, data: Json) -> Json:
    """Return a registry in which every page has its document, if there are several."""
    if not protocol.overlays:
        return data
    names = ("", *(overlay.name for overlay in protocol.overlays))
    documented: Json = _documented(data, {name: protocol.document_name(name) for name in names})
    return documented


def _documented(value: Any, documents: Mapping[str, str], overlay: str = "") -> Any:
    """Return a list or an object in which every entry with a page names the document of the page.

    :param overlay: the overlay of the entry that contains the value.
    """
    if isinstance(value, list):
        return [
            _documented(item, documents, overlay) if item.__class__ in _NESTED else item
            for item in value
        ]
    overlay = value.get("overlay", overlay)
    whole = dict(value)
    for key, item in value.items():
        if item.__class__ in _NESTED:
            whole[key] = _documented(item, documents, overlay)
    if whole.get("overlay") == "":
        del whole["overlay"]
    if "page" in value or isinstance(value.get("pages"), list):
        whole.setdefault("document", documents[overlay])
    return whole


def with_evidence(protocol: Protocol, data: Json) -> Json:
    """Return a registry with its sources of evidence, and in each entry what they show about it."""
    evidence = protocol.evidence
    if not evidence.sources:
        return data
    sources = {
        source.id: {
            "class": source.kind,
            **source.data,
            "text": source.text,
            **({"overlay": source.overlay} if source.overlay else {}),
        }
        for source in evidence.sources
    }
    classes_of = cache(evidence.classes_of)  # most scales share their texts with others
    added = {
        section: _added(evidence, section, data[section], classes_of)
        for section in {section for section, _ in evidence.of_entries}
    }
    return {**data, **added, "sources": sources}


def _added(evidence: EvidenceTable, section: str, entries: Any, classes_of: ClassesOf) -> Any:
    """Return a section with the evidence of its entries."""
    if isinstance(entries, list):
        return [_entry(evidence, section, entry["name"], entry, classes_of) for entry in entries]
    return {
        name: _entry(evidence, section, name, entry, classes_of) for name, entry in entries.items()
    }


def _entry(
    evidence: EvidenceTable, section: str, name: str, entry: Json, classes_of: ClassesOf
) -> Json:
    found = [_shown(one) for one in evidence.of(section, name)]
    if section == "stages":
        parts = [part for part in ("controllers", "ids", "limits") if part in entry]
        entry = {**entry, **{part: _cited(entry[part], classes_of) for part in parts}}
    return {**entry, "evidence": found} if found else entry


def _shown(evidence: Evidence) -> Json:
    return {
        "class": evidence.source.kind,
        "source": evidence.source.id,
        "shows": evidence.shows,
        **({"part": evidence.part} if evidence.part else {}),
    }


def _cited(value: Json, classes_of: ClassesOf) -> Json:
    """Return scales, limits or ids with the classes of the evidence that their sources cite."""
    whole = {
        key: _cited(inner, classes_of) if inner.__class__ is dict else inner
        for key, inner in value.items()
    }
    texts = [value[key] for key in ("source", "note") if isinstance(value.get(key), str)]
    classes = classes_of(*texts)
    return {**whole, "evidence": list(classes)} if classes else whole
