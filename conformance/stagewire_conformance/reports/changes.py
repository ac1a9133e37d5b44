"""The changes between two JSON reports, such as those of two firmware versions.

Results are compared by the id of their case, and findings by their text without its numbers, because times
and positions differ in every run. Only failures, departures and findings about robustness are compared.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass
from enum import StrEnum
from typing import Any, Final

from stagewire_conformance.reports.json_reader import (
    GRAVE,
    Finding,
    ReportFileError,
    Result,
    Run,
)
from stagewire_conformance.reports.model import Grade

_LEFT_OUT: Final = (Grade.SKIPPED, Grade.NOT_RUN)
_UNIMPORTANT: Final = frozenset({"identification_serial_number", "jitter_ms", "url", "starts"})
"""Facts that differ between runs and units, and say nothing about the implementation."""


class Change(StrEnum):
    """How the result of a case changed."""

    WORSE = "worse"
    BETTER = "better"
    OTHER = "other"
    NEW = "new"
    GONE = "gone"


@dataclass(frozen=True, kw_only=True)
class CaseChange:
    """A case with another result, or with other findings.

    :param old: the word of the old result; None for a new case.
    :param new: the word of the new result; None for a case that is gone.
    """

    id: str
    change: Change
    old: str | None
    new: str | None
    new_findings: tuple[Finding, ...] = ()
    gone_findings: tuple[Finding, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Difference:
    """A fact or an input of the run that differs. None means that one report does not have it."""

    name: str
    old: Any
    new: Any


@dataclass(frozen=True, kw_only=True)
class Changes:
    """The changes between two reports.

    :param facts: about the implementation and the permissions.
    :param inputs: such as the suite and the PICS, by the beginning of their digests.
    :param broken: rules that only the new report lists as broken.
    :param fixed: rules that only the old report lists as broken.
    :param new_gaps: reasons why only the new run is partial.
    :param same: the number of cases without a change.
    """

    old: Run
    new: Run
    facts: tuple[Difference, ...]
    inputs: tuple[Difference, ...]
    cases: tuple[CaseChange, ...]
    broken: tuple[str, ...]
    fixed: tuple[str, ...]
    new_gaps: tuple[str, ...]
    gone_gaps: tuple[str, ...]
    same: int

    def of(self, change: Change) -> list[CaseChange]:
        """Return the cases with a kind of change."""
        return [case for case in self.cases if case.change is change]

    @property
    def worse(self) -> bool:
        """Whether a result became worse, or the run is no longer complete."""
        return bool(self.of(Change.WORSE)) or (self.old.complete and not self.new.complete)


def compare(old: Run, new: Run) -> Changes:
    """Return the changes. Raises :class:`ReportFileError` for reports of different kinds."""
    if old.kind != new.kind:
        raise ReportFileError(
            f"a report of a {old.kind} cannot be compared with one of a {new.kind}"
        )
    found = [
        change
        for id in dict.fromkeys((*old.results, *new.results))
        if (change := _case(id, old.results.get(id), new.results.get(id)))
    ]
    return Changes(
        old=old,
        new=new,
        facts=tuple(
            each for each in _differences(old.facts, new.facts) if each.name not in _UNIMPORTANT
        ),
        inputs=tuple(_differences(_short(old.digests), _short(new.digests))),
        cases=tuple(found),
        broken=tuple(sorted(new.broken - old.broken)),
        fixed=tuple(sorted(old.broken - new.broken)),
        new_gaps=_without(new.gaps, old.gaps),
        gone_gaps=_without(old.gaps, new.gaps),
        same=len({*old.results, *new.results}) - len(found),
    )


def _case(id: str, old: Result | None, new: Result | None) -> CaseChange | None:
    if old is None or new is None:
        present = new or old
        assert present is not None
        if new is None:
            change = Change.WORSE if present.grade is Grade.PASSED else Change.GONE
        else:
            change = Change.WORSE if present.grade in GRAVE else Change.NEW
        return CaseChange(
            id=id,
            change=change,
            old=old.word if old else None,
            new=new.word if new else None,
            new_findings=new.findings if new else (),
            gone_findings=old.findings if old else (),
        )
    came, gone = _only(new.findings, old.findings), _only(old.findings, new.findings)
    if old.word == new.word and not came and not gone:
        return None
    return CaseChange(
        id=id,
        change=_change(old.grade, new.grade, bool(came)),
        old=old.word,
        new=new.word,
        new_findings=came,
        gone_findings=gone,
    )


def _change(old: Grade, new: Grade, more: bool) -> Change:
    """Return the kind of a change; ``more`` states whether there are new findings.

    A failure that is no longer tested is not an improvement.
    """
    before, after = (len(GRAVE) - GRAVE.index(each) if each in GRAVE else 0 for each in (old, new))
    if after > before or (after == before > 0 and more):
        return Change.WORSE
    if new in _LEFT_OUT:
        return Change.WORSE if old is Grade.PASSED else Change.OTHER
    return Change.BETTER if before or new is Grade.PASSED else Change.OTHER


def _only(these: Iterable[Finding], those: Iterable[Finding]) -> tuple[Finding, ...]:
    kinds = {finding.kind for finding in those}
    return tuple(finding for finding in these if finding.kind not in kinds)


def _without(these: Iterable[str], those: Iterable[str]) -> tuple[str, ...]:
    known = set(those)
    return tuple(dict.fromkeys(each for each in these if each not in known))


def _differences(old: Mapping[str, Any], new: Mapping[str, Any]) -> Iterator[Difference]:
    for name in dict.fromkeys((*old, *new)):
        if old.get(name) != new.get(name):
            yield Difference(name=name, old=old.get(name), new=new.get(name))


def _short(digests: Mapping[str, str]) -> dict[str, str]:
    return {name: str(digest)[:12] for name, digest in digests.items()}


def changes_as_json(changes: Changes) -> str:
    """Return the changes as one JSON object, described by ``conformance-changes.schema.json``."""
    data = {
        "schema_version": 1,
        "worse": changes.worse,
        "old": _head(changes.old),
        "new": _head(changes.new),
        "facts": [asdict(each) for each in changes.facts],
        "inputs": [asdict(each) for each in changes.inputs],
        "cases": [asdict(each) for each in changes.cases],
        "same": changes.same,
        "rules": {"broken": list(changes.broken), "fixed": list(changes.fixed)},
        "gaps": {"new": list(changes.new_gaps), "gone": list(changes.gone_gaps)},
    }
    return json.dumps(data, indent=1) + "\n"


def _head(run: Run) -> dict[str, Any]:
    return {
        key: getattr(run, key) for key in ("title", "verdict", "headline", "complete", "started")
    }


_HEADINGS: Final = {
    Change.WORSE: "worse",
    Change.BETTER: "better",
    Change.OTHER: "otherwise changed",
    Change.NEW: "new",
    Change.GONE: "gone",
}


def changes_as_text(changes: Changes) -> Iterator[str]:
    """Yield lines about the changes. They contain unescaped texts from the reports."""
    for name, run in (("old", changes.old), ("new", changes.new)):
        yield f"{name}: {run.headline}: {run.title}, {run.started}"
    for each in (*changes.facts, *changes.inputs):
        yield f"{each.name}: {_value(each.old)} -> {_value(each.new)}"
    if any(each.name in ("suite", "registry") for each in changes.inputs):
        yield "The suite or the registry differs, which can also change results."
    for change, heading in _HEADINGS.items():
        cases = changes.of(change)
        if cases:
            yield f"{heading}: {len(cases):,}"
        for case in cases:
            yield f"  {case.id}: {case.old or 'no case'} -> {case.new or 'no case'}"
            yield from (f"    new: {finding.text}" for finding in case.new_findings)
            yield from (f"    gone: {finding.text}" for finding in case.gone_findings)
    for heading, names in (("now broken", changes.broken), ("no longer broken", changes.fixed)):
        if names:
            yield f"rules {heading}: {', '.join(names)}"
    for heading, gaps in (("now partial", changes.new_gaps), ("no longer", changes.gone_gaps)):
        yield from (f"{heading}: {why}" for why in gaps)
    yield _last(changes)


def _value(value: Any) -> str:
    return "nothing" if value is None else str(value)


def _last(changes: Changes) -> str:
    numbers = [
        f"{len(cases):,} {heading}"
        for change, heading in _HEADINGS.items()
        if (cases := changes.of(change))
    ]
    word = "WORSE" if changes.worse else "NOT WORSE" if changes.cases else "UNCHANGED"
    verdicts = f"{changes.old.headline} -> {changes.new.headline}"
    return f"{word}: {verdicts}: {', '.join([*numbers, f'{changes.same:,} unchanged'])}"
