"""Compare two checked specs, and list every difference with its kind.

Each side of the comparison is a spec with its protocols, and each protocol with each of its overlays applied.
This module also compares the evidence for the registry: documents, errata, rules, worked examples, captures.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from stagewire_generator.change.changes import Change
from stagewire_generator.change.comparison import NOWHERE, Comparison, change
from stagewire_generator.change.matching import Pairs, match, pair
from stagewire_generator.change.messages import (
    compare_chapters,
    compare_firmware,
    compare_messages,
    compare_sets,
)
from stagewire_generator.change.quantities import compare_scales, compare_tables
from stagewire_generator.change.subjects import find_place
from stagewire_generator.model import Erratum, Json, Protocol, Rule
from stagewire_generator.pipeline import Checked
from stagewire_generator.reader import Files


def compare_overlays(comparison: Comparison, old: Protocol, new: Protocol) -> None:
    """Compare the list of overlays, and the document of each.

    The entries of overlays are compared with those of the protocol.
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
    return rule.page, rule.states


def _slugs(comparison: Comparison, noun: str, pairs: Pairs[Erratum] | Pairs[Rule]) -> None:
    """Record which things with slugs were added, removed, renamed or changed."""
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
    """Whether two parts of an example are the same apart from renamed messages."""
    if isinstance(old, dict) and isinstance(new, dict):
        return old.keys() == new.keys() and all(_same(old[k], new[k], comparison) for k in old)
    if isinstance(old, list) and isinstance(new, list):
        pairs = zip(old, new, strict=False)
        return len(old) == len(new) and all(_same(a, b, comparison) for a, b in pairs)
    return bool(old == new) or (
        isinstance(old, str) and bool(new == comparison.renamed("message", old))
    )


@dataclass(frozen=True, slots=True)
class Spec:
    """A checked spec. A title is ``PROTOCOL`` or ``PROTOCOL/OVERLAY``.

    :param protocols: the protocols without overlays.
    :param files: title -> the files of the protocol, or of the overlay only.
    :param overlays: title -> the protocol with only this overlay applied.
    """

    protocols: Sequence[Protocol]
    files: Mapping[str, Files] = field(default_factory=dict)
    overlays: Mapping[str, Protocol] = field(default_factory=dict)

    @classmethod
    def of(cls, checked: Mapping[str, Checked]) -> Spec:
        """Return a spec from the results of a check."""
        models = {title: one.protocol for title, one in checked.items()}
        return cls(
            protocols=[model for title, model in models.items() if "/" not in title],
            files={title: one.files for title, one in checked.items()},
            overlays={title: model for title, model in models.items() if "/" in title},
        )

    def model(self, title: str) -> Protocol:
        """Return the model of a title."""
        found = self.overlays.get(title)
        return found or next(p for p in self.protocols if p.name == title)

    def below(self, protocol: str, names: tuple[str, ...]) -> Protocol | None:
        """Return a protocol with these overlays, or None if no overlay is checked on the others."""
        found = self.model("/".join((protocol, *names[-1:])))
        return found if tuple(overlay.name for overlay in found.overlays) == names else None

    def overlays_of(self, protocol: str) -> list[str]:
        """Return the names of the overlays of a protocol, sorted."""
        titles = (title.split("/") for title in sorted(self.overlays))
        return [overlay for name, overlay in titles if name == protocol]


def compare(old: Sequence[Protocol], new: Sequence[Protocol]) -> list[Change]:
    """Return the changes from the checked models ``old`` to ``new``, gravest first.

    Within a class the changes are in the order of the registry.
    """
    return compare_specs(Spec(old), Spec(new))


def compare_specs(old: Spec, new: Spec) -> list[Change]:
    """Return the changes in the protocols and in each of their overlays, gravest first."""
    before_by_name, after_by_name = ({p.name: p for p in s.protocols} for s in (old, new))
    pairs = pair(before_by_name, after_by_name, _messages)
    changes: list[Change] = []
    changes += [change("protocol-removed", p.name, old=p.name) for p in pairs.removed]
    changes += [change("protocol-added", p.name, new=p.name) for p in pairs.added]
    for before, after in pairs.kept:
        if before.name != after.name:
            changes.append(change("protocol-renamed", after.name, NOWHERE, before.name, after.name))
        of_protocol = _protocol(before, after)
        changes += of_protocol
        changes += _overlays(old, new, before.name, after.name, of_protocol)
    return sorted(changes, key=lambda change: -change.level)


def _messages(protocol: Protocol) -> frozenset[tuple[str, int | None]]:
    return frozenset((message.name, message.id) for message in protocol.messages)


def _protocol(old: Protocol, new: Protocol) -> list[Change]:
    comparison = Comparison(new.name, match(old, new))
    comparison.attributes(NOWHERE, old, new)
    compare_overlays(comparison, old, new)
    compare_firmware(comparison, NOWHERE, old.firmware, new.firmware)
    compare_chapters(comparison, old, new)
    compare_messages(comparison, old, new)
    compare_sets(comparison)
    compare_tables(comparison)
    compare_scales(comparison)
    compare_proofs(comparison, old, new)
    return comparison.changes


def _overlays(
    old: Spec, new: Spec, before: str, after: str, of_protocol: Sequence[Change]
) -> Iterator[Change]:
    """Yield the changes in the overlays of a protocol, which may have been renamed.

    A change in the protocol also changes the protocol with an overlay, and a change in an overlay those that
    build on it. It is reported once, unless the overlay itself contains the changed thing: then it also
    changed there, and concerns another document. If it now builds on other overlays, the differences between
    those are not reported again.
    """
    told = {"": {_facts(change) for change in of_protocol}}
    was, is_ = old.overlays_of(before), new.overlays_of(after)
    for name in (name for name in was if name not in is_):
        yield change("overlay-removed", after, {"overlay": name}, old=name)
        if _is_default(old, f"{before}/{name}", name):
            yield change("overlay-default", after, {"overlay": name}, old="true")
    depths = {name: len(new.overlays[f"{after}/{name}"].overlays) for name in is_}
    for name in sorted(is_, key=lambda name: depths[name]):  # after those that it builds on
        told[name] = set()
        if name not in was:
            yield change("overlay-added", after, {"overlay": name}, new=name)
            if _is_default(new, f"{after}/{name}", name):
                yield change("overlay-default", after, {"overlay": name}, new="true")
            continue
        titles = f"{before}/{name}", f"{after}/{name}"
        models = old.overlays[titles[0]], new.overlays[titles[1]]
        under = [tuple(overlay.name for overlay in model.overlays[:-1]) for model in models]
        heard = set().union(*(told[other] for other in ("", *under[1])))
        if under[0] != under[1]:
            below = old.below(before, under[0]), new.below(after, under[1])
            if below[0] is not None and below[1] is not None:
                heard |= {_facts(found) for found in _protocol(below[0], below[1])}
        for found in _protocol(*models):
            told[name].add(_facts(found))
            spec, title = (old, titles[0]) if found.new is None else (new, titles[1])
            own = find_place(found, spec.overlays[title], spec.files[title])
            if own or _facts(found) not in heard:
                yield replace(found, overlay=name)


def _is_default(spec: Spec, title: str, name: str) -> bool:
    return any(o.default for o in spec.overlays[title].overlays if o.name == name)


def _facts(change: Change) -> tuple[object, ...]:
    return change.kind, *change.where.items(), change.old, change.new
