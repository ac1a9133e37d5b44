"""Check that every change on the wire comes with evidence in the same change.

A WIRE change needs a new reference for the changed thing: an erratum, a page, a part of the witness, or a
worked example. It is also accepted if an erratum for the thing was withdrawn because a difference is
gone, or if the document is another one. A change in an overlay needs evidence from the document of the
overlay. ``docs/reference/changes.md`` describes the rules in full.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from stagewire_generator.change.changes import Change, ChangeClass
from stagewire_generator.change.compare import Spec
from stagewire_generator.change.matching import Matches, match
from stagewire_generator.change.references import Side
from stagewire_generator.change.subjects import Subject, old_name, place_of, subjects_of
from stagewire_generator.diagnostics import Diagnostic, Diagnostics, Place

_KEEP = "restore the protocol, or compare with a revision that does not have it"


def unvouched(changes: Sequence[Change], old: Spec, new: Spec) -> list[Diagnostic]:
    """Return a diagnostic for each WIRE change without evidence, at its position in the new files.

    :param changes: the changes from ``old`` to ``new``, as returned by ``compare_specs``.
    """
    found = Diagnostics()
    names = {c.new: c.old for c in changes if c.kind == "protocol-renamed"}
    witnesses: dict[str, _Witness] = {}
    for change in changes:
        if change.level is not ChangeClass.WIRE or change.kind == "overlay-default":
            continue  # the contents of an overlay have evidence of their own, applied by default or not
        if change.kind == "protocol-removed":
            gone = Place(old.files[change.protocol]["protocol"][0].name)
            found.add(gone, "SW051", f"the protocol {change.protocol} was removed", _KEEP)
            continue
        if change.title not in witnesses:
            before = replace(change, protocol=names.get(change.protocol) or change.protocol)
            witnesses[change.title] = _Witness(_side(old, before), _side(new, change))
        witnesses[change.title].hear(change, found)
    return list(found)


def _side(spec: Spec, change: Change) -> Side:
    """Return the side of one of the specs for a change."""
    return Side(spec.model(change.title), spec.files[change.title], overlay=change.overlay)


class _Witness:
    """Both sides of a protocol or overlay, for checking one change after the other."""

    def __init__(self, old: Side, new: Side) -> None:
        self.matches: Matches = match(old.protocol, new.protocol)
        kinds = ("message", "set", "enumeration", "flags", "quantity", "controller", "stage")
        renamed = {o: n for kind in kinds for o, n in self.matches.renamed(kind).items()}
        self.old = replace(old, renamed=renamed)
        self.new = new
        self._known: dict[tuple[Subject, bool], bool] = {}  # a subject may have many changes

    def hear(self, change: Change, found: Diagnostics) -> None:
        """Add a diagnostic if a change has no evidence."""
        if self.old.document != self.new.document:
            return
        removed = change.new is None and change.old == next(iter(change.where.values()), "")
        side = self.old if removed else self.new
        subjects = subjects_of(change, side.protocol)
        if any(self._vouched(subject, removed=removed) for subject in subjects):
            return
        place = place_of(change, self.new.protocol, self.new.files)
        where = f" in the overlay {change.overlay}" if change.overlay else ""
        if removed:
            what = f"{_shown(change)}; no new erratum{where} names {subjects[0]} in its subject"
            found.add(place, "SW051", what)
            return
        missing = f"no new or changed erratum, page, witness or example for it{where}"
        what = f"{_shown(change)}; {missing}"
        found.add(place, "SW050", what, _hint(subjects[0]))

    def _vouched(self, subject: Subject, *, removed: bool) -> bool:
        key = (subject, removed)
        if key not in self._known:
            self._known[key] = self._removal(subject) if removed else self._change(subject)
        return self._known[key]

    def _change(self, subject: Subject) -> bool:
        before = old_name(subject, self.matches)
        if self.new.references(subject) - self.old.references(before):
            return True
        withdrawn = self.old.explained(before) - self.new.explained()
        return bool(withdrawn) and self.new.tells_of(subject)

    def _removal(self, subject: Subject) -> bool:
        return bool(self.new.errata(subject) - self.old.errata(subject))


def _shown(change: Change) -> str:
    """Return the location of a change, outermost part first, its kind, and both values."""
    noun = next(iter(change.where), "attribute")
    where = " ".join(change.where.values())
    where = where if noun in ("attribute", "message") else f"{noun} {where}"
    return f"{where}: {change.kind}, {change.old or 'nothing'} -> {change.new or 'nothing'}"


def _hint(subject: Subject) -> str:
    """Return a hint on how an erratum names a subject other than a message; empty for messages."""
    if subject.noun in ("message", "set"):
        return ""
    return (
        f"add the page, witness or worked example that shows it, or an erratum with `{subject}` in "
        "its subject"
    )
