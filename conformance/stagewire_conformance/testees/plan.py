"""All cases for a testee, in their order."""

from __future__ import annotations

import fnmatch
from collections.abc import Collection, Iterable, Sequence

from stagewire.protocols import Protocol
from stagewire_conformance.testees.case import Case, Step, ask
from stagewire_conformance.testees.hello import Hello
from stagewire_conformance.testees.hostile import damaged, ids, lines
from stagewire_conformance.testees.large import large
from stagewire_conformance.testees.order import at_once
from stagewire_conformance.testees.vectors import OPERATIONS, cuts, stated
from stagewire_conformance.testees.worked import worked

__all__ = ["GROUPS", "chosen", "plan", "why_not"]

GROUPS = {
    "examples": "Worked examples of the document",
    "captures": "Captures of third parties",
    "cases": "Cases of the registry",
    "cut": "Streams, cut at every place",
    "large": "Requests larger than any frame",
    "lines": "Hostile and unusual lines",
    "order": "Many lines at once",
}
"""Last part of the name of a group -> what its cases are."""


def plan(protocols: Iterable[Protocol], seed: int, hello: Hello | None = None) -> list[Case]:
    """Return the cases of the protocols, then those that look at lines alone.

    :param seed: what chance decides follows from it.
    :param hello: what the testee can do; what it has not got is planned, and left out when it is run.
    """
    made: list[Case] = []
    for protocol in protocols:
        for part in (worked, stated, cuts, large):
            made += part(protocol)
    can = [case for case in made if not why_not(case, hello)]
    clean = _clean(can)
    seldom = [*lines(clean), *ids(clean)]
    return [*made, *seldom, *damaged(clean, seed), *at_once([*can, *seldom], seed)]


def chosen(cases: Sequence[Case], only: Collection[str]) -> list[Case]:
    """Return the cases whose id, group or message one of the patterns matches; all without a pattern."""
    if not only:
        return list(cases)
    return [
        case
        for case in cases
        for names in [(case.id, case.group, case.message)]
        if any(fnmatch.fnmatchcase(name, pattern) for name in names for pattern in only)
    ]


def why_not(case: Case, hello: Hello | None) -> str:
    """Return why a testee cannot be asked a case; empty where it can."""
    if hello is None:
        return ""
    if case.protocol and case.protocol not in hello.protocols:
        return f"the testee does not speak {case.protocol}"
    lacking = sorted(case.operations.difference(hello.operations))
    return f"the testee does not {' and '.join(lacking)}" if lacking else ""


def _clean(cases: Iterable[Case]) -> list[Step]:
    """Return a request for each protocol and operation that is granted; at least one."""
    found: dict[tuple[str, str], Step] = {}
    for case in cases:
        step = case.steps[0]
        for operation in case.operations:
            if step.wanted.get("ok"):
                found.setdefault((case.protocol, operation), step)
    ordered = sorted(found, key=lambda key: OPERATIONS.index(key[1]))
    return [found[key] for key in ordered] or [ask({"op": "hello"}, {})]
