"""Which checks hold a controller to which rules of the document, and which rules no check can see."""

from __future__ import annotations

import functools
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Final

from stagewire.protocols import Protocol
from stagewire_conformance.device.check import Kind
from stagewire_conformance.registry import Json, Registry, registry_of

__all__ = ["Coverage", "about", "coverage", "unknown_rules"]


_OF_BAYS: Final = frozenset(
    {
        "one-line-for-bays", "motherboard-address", "slot-addressed-by-destination", "slot-source",
        "bays-are-single-channel", "bay-used", "bay-idents", "bay-states",
    }
)  # fmt: skip
"""Rules of APT that concern units with bays alone."""
_OF_OTHERS: Final = frozenset({"generic-unit-address"})
"""Rules of APT that concern units without bays alone."""


@dataclass(frozen=True, kw_only=True)
class Coverage:
    """A rule, and what sees whether it is kept.

    :param where: the page, or the section, of the document.
    :param strength: ``must`` or ``should``.
    :param subject: whom it binds: ``controller`` or ``host``.
    :param says: the words of the document.
    :param checks: the kinds of checks that hold a controller of some unit to it.
    :param waiver: why there can be none; empty where there are.
    """

    rule: str
    where: str
    strength: str
    subject: str
    says: str
    checks: tuple[str, ...]
    waiver: str

    @property
    def problem(self) -> str:
        """What is wrong: a must has either a check or a waiver, and no rule has both; empty if nothing is."""
        if self.checks and self.waiver:
            return "has a check and a waiver"
        if self.strength == "must" and not self.checks and not self.waiver:
            return "has neither a check nor a waiver"
        return ""


def about(
    registry: Registry, rules: Iterable[str], messages: Iterable[str], *, bays: bool | None = None
) -> tuple[str, ...]:
    """Return the rules that can concern messages: those about one of them, and those about none or all.

    Without messages all are returned. A name that is no rule stays; :func:`unknown_rules` finds it.

    :param bays: whether the unit has bays; rules that concern only others are left out. None: not known.
    """
    known, wanted = _known(registry), set(messages)
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


def unknown_rules(protocol: Protocol) -> Iterator[tuple[Kind, str]]:
    """Yield what kinds of checks name as a rule and the protocol does not have."""
    known = _known(registry_of(protocol))
    for kind in _kinds(protocol):
        yield from ((kind, rule) for rule in kind.rules if rule not in known)


def coverage(protocol: Protocol) -> tuple[Coverage, ...]:
    """Return all rules of a protocol in the order of its document, each with what sees it.

    A kind counts where one of its checks for some unit is about the rule, not where it is only named.
    """
    registry = registry_of(protocol)
    seen = _seen(protocol)
    return tuple(
        Coverage(
            rule=name,
            where=registry.where((entry["page"],)),
            strength=entry["strength"],
            subject=entry["subject"],
            says=entry["says"],
            checks=tuple(seen.get(name, ())),
            waiver=entry["waiver"],
        )
        for name, entry in sorted(
            _known(registry).items(), key=lambda item: (item[1]["page"], item[0])
        )
    )


@functools.cache
def _known(registry: Registry) -> dict[str, Json]:
    return {rule["id"]: rule for rule in registry.data.get("rules", ())}


def _kinds(protocol: Protocol) -> tuple[Kind, ...]:
    from stagewire_conformance.device.checks import kinds_of

    return kinds_of(protocol)


def _seen(protocol: Protocol) -> dict[str, dict[str, None]]:
    """Return the names of the kinds that hold a controller of some unit to a rule, by rule, in order."""
    # planning asks this module which rules a check is about, and so do checks
    from stagewire_conformance.device.declared import declare, known_units
    from stagewire_conformance.device.permissions import Permissions
    from stagewire_conformance.device.planning import plan

    found: dict[str, dict[str, None]] = {}
    for name, of in known_units().items():
        if of.name != protocol.name:
            continue
        for check in plan(declare(name), Permissions()):
            for rule in check.held_to:
                if check.kind is not None:
                    found.setdefault(rule, {})[check.kind.name] = None
    return found
