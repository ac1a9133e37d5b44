"""Whether every change on the wire says, in the same change, how anybody knows.

A WIRE change is vouched for when the new side refers to something for the changed thing that the old one did
not: an erratum, a page, a part of the witness, a worked example; or when the old one explained a difference
that is gone; or when it is another document. An overlay speaks for what changes in it, from its own document.
``docs/reference/changes.md`` has the rule in full.
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

_KEEP = "keep the protocol, or compare with a revision that does not have it"


def unvouched(changes: Sequence[Change], old: Spec, new: Spec) -> list[Diagnostic]:
    """Return a diagnostic for each WIRE change that comes without evidence, at its place in the new files.

    :param changes: what ``compare_specs`` found from ``old`` to ``new``.
    """
    found = Diagnostics()
    names = {c.new: c.old for c in changes if c.kind == "protocol-renamed"}
    witnesses: dict[str, _Witness] = {}
    for change in changes:
        if change.level is not ChangeClass.WIRE:
            continue
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
    """Return what a change is about, as one of the specs has it."""
    return Side(spec.model(change.title), spec.files[change.title], overlay=change.overlay)


class _Witness:
    """Both sides of a protocol or of one of its overlays, asked for one change after the other."""

    def __init__(self, old: Side, new: Side) -> None:
        self.matches: Matches = match(old.protocol, new.protocol)
        kinds = ("message", "set", "enumeration", "flags", "quantity", "controller", "stage")
        renamed = {o: n for kind in kinds for o, n in self.matches.renamed(kind).items()}
        self.old = replace(old, renamed=renamed)
        self.new = new
        self._known: dict[tuple[Subject, bool], bool] = {}  # one thing has many changes

    def hear(self, change: Change, found: Diagnostics) -> None:
        """Note a change that nothing vouches for."""
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
            what = f"{_shown(change)}; no new erratum{where} has {subjects[0]} in its subject"
            found.add(place, "SW051", what)
            return
        missing = f"no erratum, page, witness or example of it{where} is new or altered"
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
    """Return where a change is, from the outside, its kind, and both sides of it."""
    noun = next(iter(change.where), "attribute")
    where = " ".join(change.where.values())
    where = where if noun in ("attribute", "message") else f"{noun} {where}"
    return f"{where}: {change.kind}, {change.old or 'nothing'} -> {change.new or 'nothing'}"


def _hint(subject: Subject) -> str:
    """Return how an erratum names what has no place in its lists; nothing where the general cure says all."""
    if subject.noun in ("message", "set"):
        return ""
    return (
        f"add the page, witness or worked example that shows it, or an erratum with `{subject}` in "
        "its subject"
    )
