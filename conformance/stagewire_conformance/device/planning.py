"""Which checks a run has: all of the protocol's kinds, or those that were asked for."""

from __future__ import annotations

import difflib
from collections.abc import Iterator, Sequence
from dataclasses import replace
from fnmatch import fnmatchcase

from stagewire_conformance.device.check import Check, Kind
from stagewire_conformance.device.checks import kinds_of
from stagewire_conformance.device.declared import Declared
from stagewire_conformance.device.errors import NothingToRunError
from stagewire_conformance.device.permissions import Permissions
from stagewire_conformance.device.rules import about

__all__ = ["plan"]


def plan(
    declared: Declared,
    allowed: Permissions,
    *,
    only: Sequence[str] = (),
    kinds: Sequence[Kind] | None = None,
) -> list[Check]:
    """Return the checks of a run, in order; what is not allowed is among them, and not run.

    :param only: names of kinds, names of messages, or patterns of ids with ``*`` and ``?``; empty: all.
    :param kinds: the kinds of checks, such as some of your own; None: those of the suite.

    Raises :class:`.NothingToRunError` for one of them that chooses nothing.
    """
    bays = any(place.bay for place in declared.places)
    checks = [
        replace(
            check,
            kind=kind,
            rules=check.rules or about(declared.registry, kind.rules, check.messages, bays=bays),
        )
        for kind in (kinds_of(declared.protocol) if kinds is None else kinds)
        for check in kind.make(declared, allowed)
    ]
    ids = [check.id for check in checks]
    assert len(set(ids)) == len(ids)  # an id names one check
    if not only:
        return checks
    for pattern in only:
        if not any(_chooses(pattern, check) for check in checks):
            raise NothingToRunError(_nothing(pattern, checks, declared))
    return [check for check in checks if any(_chooses(pattern, check) for pattern in only)]


def _chooses(pattern: str, check: Check) -> bool:
    assert check.kind is not None
    return (
        pattern == check.kind.name
        or pattern.upper() in check.messages
        or fnmatchcase(check.id, pattern)
    )


def _nothing(pattern: str, checks: Sequence[Check], declared: Declared) -> str:
    names = [*dict.fromkeys(_names(checks))]
    close = difflib.get_close_matches(pattern, names, n=3, cutoff=0.5)
    hint = f"did you mean {' or '.join(close)}?" if close else "--list shows what there is"
    return f"no check of {declared.unit.name} is named {pattern or repr(pattern)}; {hint}"


def _names(checks: Sequence[Check]) -> Iterator[str]:
    for check in checks:
        kind: Kind | None = check.kind
        yield kind.name if kind else check.id
        yield from check.messages
        yield check.id
