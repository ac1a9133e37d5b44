"""Compare documents, errata, rules, worked examples and captures: the evidence for the registry."""

from __future__ import annotations

from typing import Any

from stagewire_generator.change.comparison import NOWHERE, Comparison
from stagewire_generator.change.matching import Pairs, pair
from stagewire_generator.model import Erratum, Json, Protocol, Rule


def compare_overlays(comparison: Comparison, old: Protocol, new: Protocol) -> None:
    """Compare which overlays there are, and what each says of its document.

    What an overlay adds or replaces is reported where it shows.
    """
    names = ([overlay.name for overlay in protocol.overlays] for protocol in (old, new))
    comparison.attribute(NOWHERE, "overlays", "document", *names)
    before = {overlay.name: overlay for overlay in old.overlays}
    for overlay in new.overlays:
        if overlay.name in before:
            where = {"overlay": overlay.name}
            comparison.attributes(where, before[overlay.name], overlay)


def compare_proofs(comparison: Comparison, old: Protocol, new: Protocol) -> None:
    """Compare the errata, the rules, the worked examples and the captures."""
    errata = pair({e.id: e for e in old.errata}, {e.id: e for e in new.errata}, _erratum)
    _slugs(comparison, "erratum", errata)
    rules = pair({r.id: r for r in old.rules}, {r.id: r for r in new.rules}, _rule)
    _slugs(comparison, "rule", rules)
    _vectors(
        comparison,
        "example",
        _entries(old.examples, "examples"),
        _entries(new.examples, "examples"),
    )
    _vectors(
        comparison,
        "capture",
        _entries(old.captures, "captures"),
        _entries(new.captures, "captures"),
    )


def _erratum(erratum: Erratum) -> tuple[object, ...]:
    return erratum.pages, erratum.subject, erratum.printed, erratum.encoded


def _rule(rule: Rule) -> tuple[object, ...]:
    return rule.page, rule.says


def _slugs(comparison: Comparison, noun: str, pairs: Pairs[Erratum] | Pairs[Rule]) -> None:
    """Note what was added, removed, renamed and changed among things with slugs."""
    for thing in pairs.removed:
        comparison.add(f"{noun}-removed", {noun: thing.id}, thing.id, None)
    for thing in pairs.added:
        comparison.add(f"{noun}-added", {noun: thing.id}, None, thing.id)
    for before, after in pairs.kept:
        if before.id != after.id:
            comparison.add(f"{noun}-renamed", {noun: after.id}, before.id, after.id)
        comparison.attributes({noun: after.id}, before, after)


def _entries(data: Json, section: str) -> Json:
    found: Json = data.get(section, {})
    return found


def _vectors(comparison: Comparison, noun: str, old: Json, new: Json) -> None:
    for name in (*old, *(name for name in new if name not in old)):
        where = {noun: name}
        if name not in new:
            comparison.add("example-removed", where, name, None)
        elif name not in old:
            comparison.add("example-added", where, None, name)
        elif old[name] != new[name]:
            keys = (*old[name], *(key for key in new[name] if key not in old[name]))
            changed = [
                key for key in keys if not _same(old[name].get(key), new[name].get(key), comparison)
            ]
            if changed:
                comparison.add("example", {**where, "attribute": ", ".join(changed)})
    if list(old) != list(new) and sorted(old) == sorted(new):
        comparison.add("order", {"attribute": f"{noun}s"})


def _same(old: Any, new: Any, comparison: Comparison) -> bool:
    """Whether two parts of an example differ at most in names of messages that were renamed."""
    if isinstance(old, dict) and isinstance(new, dict):
        return old.keys() == new.keys() and all(_same(old[k], new[k], comparison) for k in old)
    if isinstance(old, list) and isinstance(new, list):
        pairs = zip(old, new, strict=False)
        return len(old) == len(new) and all(_same(a, b, comparison) for a, b in pairs)
    return bool(old == new) or (
        isinstance(old, str) and bool(new == comparison.renamed("message", old))
    )
