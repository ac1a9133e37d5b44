"""Rules of the document, and which of them can concern a check."""

from __future__ import annotations

import functools
from collections.abc import Iterable
from typing import Final

from stagewire_conformance.registry import Json, Registry

_OF_BAYS: Final = frozenset(
    {
        "one-line-for-bays", "motherboard-address", "slot-addressed-by-destination", "slot-source",
        "bays-are-single-channel", "bay-used", "bay-idents", "bay-states",
    }
)  # fmt: skip
"""Rules of APT that concern units with bays alone."""
_OF_OTHERS: Final = frozenset({"generic-unit-address"})
"""Rules of APT that concern units without bays alone."""


def about(
    registry: Registry, rules: Iterable[str], messages: Iterable[str], *, bays: bool | None = None
) -> tuple[str, ...]:
    """Return the rules that can concern messages: those about one of them, and those about none or all.

    Without messages all are returned. A name that is no rule stays; ``rules_page.unknown_rules`` finds it.

    :param bays: whether the unit has bays; rules that concern only others are left out. None: not known.
    """
    known, wanted = known_rules(registry), set(messages)
    others: frozenset[str] = frozenset() if bays is None else _OF_OTHERS if bays else _OF_BAYS
    return tuple(
        rule
        for rule in rules
        if rule not in others
        and (
            not (wanted and rule in known and known[rule]["messages"])
            or not wanted.isdisjoint(known[rule]["messages"])
        )
    )


@functools.cache
def known_rules(registry: Registry) -> dict[str, Json]:
    """Return the rules of a registry by their slugs."""
    return {rule["id"]: rule for rule in registry.data.get("rules", ())}
