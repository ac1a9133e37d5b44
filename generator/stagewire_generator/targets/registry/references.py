"""Add to the entries of a registry the documents of their pages, and their evidence."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from stagewire_generator.model import Json, Protocol
from stagewire_generator.model_evidence import Evidence, EvidenceTable

_NESTED = frozenset({dict, list})


def with_documents(protocol: Protocol, data: Json) -> Json:
    """Return a registry in which every page has its document, if there are several."""
    if not protocol.overlays:
        return data
    names = ("", *(overlay.name for overlay in protocol.overlays))
    documented: Json = _documented(data, {name: protocol.document_name(name) for name in names})
    return documented


def _documented(value: Any, documents: Mapping[str, str], overlay: str = "") -> Any:
    """Return data in which every entry with a page names the document of the page.

    :param overlay: the overlay of the entry that contains the value.
    """
    if isinstance(value, list):
        return [_documented(item, documents, overlay) for item in value]
    if not isinstance(value, dict):
        return value
    overlay = value.get("overlay", overlay)
    whole = {
        key: _documented(item, documents, overlay) if item.__class__ in _NESTED else item
        for key, item in value.items()
    }
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
    added = {
        section: _added(evidence, section, data[section])
        for section in {section for section, _ in evidence.of_entries}
    }
    return {**data, **added, "sources": sources}


def _added(evidence: EvidenceTable, section: str, entries: Any) -> Any:
    """Return a section with the evidence of its entries."""
    if isinstance(entries, list):
        return [_entry(evidence, section, entry["name"], entry) for entry in entries]
    return {name: _entry(evidence, section, name, entry) for name, entry in entries.items()}


def _entry(evidence: EvidenceTable, section: str, name: str, entry: Json) -> Json:
    found = [_shown(one) for one in evidence.of(section, name)]
    if section == "stages":
        parts = ("controllers", "limits")
        entry = {**entry, **{part: _cited(evidence, entry[part]) for part in parts}}
    return {**entry, "evidence": found} if found else entry


def _shown(evidence: Evidence) -> Json:
    return {
        "class": evidence.source.kind,
        "source": evidence.source.id,
        "shows": evidence.shows,
        **({"part": evidence.part} if evidence.part else {}),
    }


def _cited(evidence: EvidenceTable, value: Any) -> Any:
    """Return scales or limits with the classes of the evidence that their sources cite."""
    if not isinstance(value, dict):
        return value
    whole = {key: _cited(evidence, inner) for key, inner in value.items()}
    texts = [value[key] for key in ("source", "note") if isinstance(value.get(key), str)]
    classes = evidence.classes_of(*texts)
    return {**whole, "evidence": list(classes)} if classes else whole
