"""The checks that verify each rule, and the generated page ``docs/reference/conformance-rules.md``.

``python -m stagewire_conformance.device.rules_page FILE`` writes the page.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from stagewire.protocols import Protocol, load_protocol
from stagewire_conformance.device.check import Kind
from stagewire_conformance.device.checks import kinds_of
from stagewire_conformance.device.declaration import declare, known_units
from stagewire_conformance.device.permissions import Permissions
from stagewire_conformance.device.plans import plan
from stagewire_conformance.registry import known_rules, registry_of

_PROTOCOLS = ("thorlabs_apt", "asi_ms2000")

_HEAD = """\
<!-- Made by `python -m stagewire_conformance.device.rules_page docs/reference/conformance-rules.md` -->
# Rules and their checks

This page lists every rule that the documents state. A rule is a `must` if its document states a fact or a
requirement, and a `should` if it describes something as usual, typical or recommended. "Host" marks rules for
the program at the other end of the line.

The last column names the kinds of checks of `stagewire conformance device` that verify the rule. If no check
can verify it, the column gives the reason, called a *waiver*. Every `must` has either checks or a waiver,
never both.

The rules are in `spec/<protocol>/rules.yaml`, and those that a later issue adds in the `rules.yaml` of its
overlay, in our own words and with references to the sentences of the document. `stagewire conformance rules`
prints the same tables, and all details with `--json`. To run the checks of one kind, use `stagewire
conformance device URL --unit UNIT --only KIND`.
"""


def page() -> str:
    """Return the whole page in Markdown, with one table per protocol."""
    return "\n".join([_HEAD, *(_part(load_protocol(name)) for name in _PROTOCOLS)])


def _part(protocol: Protocol) -> str:
    rows = coverage(protocol)
    registry = protocol.registry()
    document = registry["document"]
    part = "section" if "sections" in document else "page"
    heading = "document and page" if "name" in document else part
    table = [
        f"| {heading} | rule | | requirement | checked by, or reason for the waiver |",
        "|---|---|---|---|---|",
    ]
    return "\n".join(
        [f"## {registry['title']}", "", _counted(rows), "", *table, *_rows(rows, part), ""]
    )


def _counted(rows: Sequence[Coverage]) -> str:
    musts = [row for row in rows if row.strength == "must"]
    checked = sum(bool(row.checks) for row in musts)
    return (
        f"{len(rows)} rules, {len(musts)} of them musts: {checked} have checks, "
        f"{len(musts) - checked} have waivers."
    )


def _rows(rows: Sequence[Coverage], part: str) -> Iterator[str]:
    for row in rows:
        strength = row.strength + (", host" if row.subject == "host" else "")
        seen = ", ".join(f"`{name}`" for name in row.checks) or _cell(row.waiver)
        where = row.where.removeprefix(f"{part} ")
        yield f"| {where} | {row.rule} | {strength} | {_cell(row.states)} | {seen} |"


def _cell(text: str) -> str:
    """Return a text with Markdown characters escaped for a table cell."""
    for mark in "\\|<>*_`[]":
        text = text.replace(mark, f"\\{mark}")
    return text


@dataclass(frozen=True, kw_only=True)
class Coverage:
    """A rule, and the checks that verify it.

    :param where: the document, if there are several, and its page or section.
    :param strength: ``must`` or ``should``.
    :param subject: the side that the rule binds: ``controller`` or ``host``.
    :param states: the requirement, in our own words.
    :param checks: the kinds of checks that verify the rule for at least one unit.
    :param waiver: why no check can verify the rule; empty if one does.
    """

    rule: str
    where: str
    strength: str
    subject: str
    states: str
    checks: tuple[str, ...]
    waiver: str

    @property
    def problem(self) -> str:
        """The problem of a rule with both a check and a waiver, or a must with neither; else empty."""
        if self.checks and self.waiver:
            return "has a check and a waiver"
        if self.strength == "must" and not self.checks and not self.waiver:
            return "has neither a check nor a waiver"
        return ""


def coverage(protocol: Protocol) -> tuple[Coverage, ...]:
    """Return all rules of a protocol with their checks, in the order of the documents.

    A kind counts only if one of its checks for some unit covers the rule.
    """
    registry = registry_of(protocol)
    seen = _seen(protocol)
    return tuple(
        Coverage(
            rule=name,
            where=registry.where((entry["page"],), registry.overlay_of(entry)),
            strength=entry["strength"],
            subject=entry["subject"],
            states=entry["states"],
            checks=tuple(seen.get(name, ())),
            waiver=entry["waiver"],
        )
        for name, entry in sorted(
            known_rules(registry).items(), key=lambda item: (registry.order(item[1]), item[0])
        )
    )


def unknown_rules(protocol: Protocol) -> Iterator[tuple[Kind, str]]:
    """Yield each kind of check with a rule that it names and the protocol does not have."""
    known = known_rules(registry_of(protocol))
    for kind in kinds_of(protocol):
        yield from ((kind, rule) for rule in kind.rules if rule not in known)


def _seen(protocol: Protocol) -> dict[str, dict[str, None]]:
    """Return, for each rule, the names of the kinds that verify it for some unit, in order."""
    found: dict[str, dict[str, None]] = {}
    for name, of in known_units().items():
        if of.name != protocol.name:
            continue
        for check in plan(declare(name), Permissions()):
            for rule in check.rules:
                if check.kind is not None:
                    found.setdefault(rule, {})[check.kind.name] = None
    return found


def summary_of_rules(rows: Sequence[Coverage]) -> str:
    """Return one line with the numbers of rules, musts, checks and waivers."""
    if not rows:
        return "the registry has no rules"
    musts = [row for row in rows if row.strength == "must"]
    checked, waived = sum(bool(row.checks) for row in musts), sum(bool(row.waiver) for row in musts)
    neither = sum(not row.checks and not row.waiver for row in musts)
    return (
        f"{len(rows)} rules, {len(musts)} of them musts: {checked} have checks, {waived} have waivers, "
        f"{neither} have neither"
    )


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(page(), encoding="utf-8", newline="\n")
