"""``stagewire conformance rules``: every must and should of the documents, and which checks see it."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated

import typer

from stagewire_cli.errors import WRONG
from stagewire_cli.output import console, printable, table
from stagewire_cli.protocols import one_or_all

if TYPE_CHECKING:
    from stagewire_conformance.device.rules_page import Coverage

__all__ = ["EXAMPLE", "rules"]

EXAMPLE = """\b
Examples:
  stagewire conformance rules
  stagewire conformance rules --protocol asi_ms2000 --json
"""


def rules(
    protocol: Annotated[str | None, typer.Option("--protocol", help="Only this protocol.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="One JSON object per line.")] = False,
) -> None:
    """List the rules of the documents, each with the checks that see it, or the reason why none can.

    Exits with 1 where a must has neither a check nor a waiver, or a rule has both.
    """
    from stagewire_conformance.device.rules_page import coverage

    found = [(one, coverage(one)) for one in one_or_all(protocol, whole=True)]
    for one, rows in found:
        if as_json:
            for row in rows:
                typer.echo(json.dumps({"protocol": one.name, **asdict(row)}))
            continue
        if rows:
            _table(rows)
        for row in rows:
            if row.problem:
                typer.echo(f"{one.name}: {row.rule} {row.problem}")
        typer.echo(f"{one.name}: {_summary(rows)}")
    if any(row.problem for _, rows in found for row in rows):
        raise typer.Exit(WRONG)


def _table(rows: tuple[Coverage, ...]) -> None:
    shown = table("rule", "where", "strength", "checks, or why there are none")
    for row in rows:
        seen = ", ".join(row.checks) or printable(row.waiver) or "nothing"
        shown.add_row(row.rule, row.where, row.strength, seen, style="red" if row.problem else None)
    console().print(shown)


def _summary(rows: tuple[Coverage, ...]) -> str:
    """Return one line: how many rules there are, how many are checked and how many are waived."""
    if not rows:
        return "the registry has no rules"
    musts = [row for row in rows if row.strength == "must"]
    checked, waived = sum(bool(row.checks) for row in musts), sum(bool(row.waiver) for row in musts)
    neither = sum(not row.checks and not row.waiver for row in musts)
    return (
        f"{len(rows)} rules, {len(musts)} of them musts; of these {checked} have checks, "
        f"{waived} waivers, {neither} neither"
    )
